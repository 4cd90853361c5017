// The pictures of several pixels on the live page. page.mjs calls this with its page and its view.
import {join} from 'node:path';
import {Program, check, configuration, expect, pause, shows, until, value_of} from './harness.mjs';

// A plate that moves before a wall, on 16 x 16 pixels, of which the first counts nothing.
const letters = 'abcdefghijklmnop';
const array_of = (endpoint) => configuration('array.json', endpoint, {
  driver: 'simulator', ambient_per_s: 200, array: {columns: 16, rows: 16, pitch_deg: 0.1, planes: [
    {motion: 'linear', distance_m: 20, velocity_mps: 1.2, signal_per_pulse: 0.0003, azimuth_deg: [-0.4, 0.4], elevation_deg: [-0.4, 0.4]},
    {motion: 'linear', distance_m: 40, signal_per_pulse: 0.0003}]},
}, {frame: {length_ms: 200}, scene: {max_speed_mps: 5}, estimator: {tracked: true}, pixels: Array.from({length: 256}, (_, i) => ({
  name: `${letters[Math.floor(i / 16)]}${i % 16 + 1}`, input: i === 0 ? 1000 : i + 1,
  azimuth_deg: 0.1 * (i % 16) - 0.75, elevation_deg: 0.75 - 0.1 * Math.floor(i / 16)}))});
const heard_of = (program) => program.out.split('\n').filter((line) => line.endsWith('}')).map((line) => JSON.parse(line));

// The middle of a pixel's cell in a picture.
async function middle_of(page, id, name) {
  const box = await (await page.$(`#${id}`)).boundingBox();
  const [x, y] = await page.evaluate((picture, pixel) => {
    const cell = field.boxes[picture];
    const [left, top] = corner_of(field.layout.pixel.indexOf(pixel), cell);
    return [left + cell.w / 2, top + cell.h / 2];
  }, id, name);
  return [box.x + x, box.y + y];
}
const shows_pixel = (page, name) => shows(page, `pixel ${name}`, (pixel) => field.pixel === pixel && shown.frame && shown.frame.pixel === pixel &&
  document.getElementById('field-pixel').textContent === pixel && new URLSearchParams(location.hash.slice(1)).get('pixel') === pixel, name);

// view: `splid view` of the endpoint `later`, with its page `follower`. live: a configuration of one pixel.
export async function check_array({view, follower, later, live, accessibility, screenshots}) {
  const field_daemon = new Program('run', '--config', array_of(later));
  const scenes = new Program('listen', '--endpoint', later, '--json', 'scene');
  await follower.setViewport({width: 1280, height: 2600});

  await check('an array is shown in pictures whose values equal the messages', async () => {
    await shows(follower, 'pictures', () => !document.getElementById('field').hidden && Number(document.getElementById('field-note').dataset.value) > 2);
    const seen = await follower.evaluate(() => ({layout: field.layout, picture: field.picture,
      note: document.getElementById('field-note').textContent}));
    const scene = await until('the listener has the scene', () => heard_of(scenes).find(({sequence}) => sequence === seen.picture.sequence));
    expect(seen.layout.is_grid && seen.layout.columns === 16 && seen.layout.rows === 16 &&
      seen.layout.pixel.join() === scene.pixel.join() && seen.layout.cell.every((cell, i) => cell === i), JSON.stringify(seen.layout));
    const is_valid = (i) => ['ok', 'ambiguous'].includes(scene.status[i]);
    for (const name of ['distance_m', 'velocity_mps', 'signal_per_pulse']) {
      seen.picture[name].forEach((value, i) => expect(is_valid(i) ? Math.abs(value - scene[name][i]) <= 1e-8 * Math.abs(value) : value === null,
        `${name} of ${scene.pixel[i]}: ${value} instead of ${scene[name][i]}`));
    }
    expect(seen.picture.distance_m[0] === null && /^256 pixels: \d+ ok, .*\d+ no target/.test(seen.note), seen.note);
  });

  await check('the pictures have the colours of their scale, a scale with a unit, and a cross where a pixel is not valid', async () => {
    const {colours, cross, ground, texts} = await follower.evaluate(() => {
      const texts = [];
      const original = CanvasRenderingContext2D.prototype.fillText;
      CanvasRenderingContext2D.prototype.fillText = function (text, ...more) { texts.push(text); return original.call(this, text, ...more); };
      draw_field();
      CanvasRenderingContext2D.prototype.fillText = original;
      const canvas = document.getElementById('field-velocity'), box = field.boxes['field-velocity'], ratio = devicePixelRatio;
      const colour_at = (i, right, down) => {
        const [x, y] = corner_of(i, box);
        return [...canvas.getContext('2d').getImageData(Math.round((x + box.w * right) * ratio), Math.round((y + box.h * down) * ratio), 1, 1).data];
      };
      const [low, high] = field.scales.velocity_mps;
      const colours = [8 * 16 + 8, 2 * 16 + 2].map((i) => [colour_at(i, 0.4, 0.6),
        field.picture.velocity_mps[i] === null ? null : ramp((field.picture.velocity_mps[i] - low) / (high - low)).map(Math.round)]);
      return {colours, cross: colour_at(0, 0.5, 0.5), ground: colour_at(0, 0.5, 0.2), texts};
    });
    for (const [shown, expected] of colours) {
      expect(expected !== null && expected.every((value, i) => Math.abs(value - shown[i]) <= 2), `${shown} instead of ${expected}`);
    }
    expect(colours[0][0].join() !== colours[1][0].join(), 'plate and wall have one colour');
    expect(cross[3] > 100 && ground[3] === 0, `the cross is ${cross} on ${ground}`);
    expect(['m', 'm/s', 'µcounts/pulse'].every((unit) => texts.includes(unit)), texts.join());
    expect(texts.filter((text) => /^-?\d/.test(text)).length >= 6, texts.join());
  });

  await check('a click chooses the pixel whose values and charts are shown, from its past on', async () => {
    await until('two seconds of scenes', () => heard_of(scenes).length > 10);
    for (const [name, velocity] of [['h8', 1.2], ['b2', 0]]) {
      const own = new Program('listen', '--endpoint', later, '--json', `frame/${name}`);
      await until('the listener hears', () => own.out.includes('}\n'));
      await follower.mouse.click(...await middle_of(follower, 'field-velocity', name));
      await shows_pixel(follower, name);
      const rows = await follower.evaluate(() => shown.rows.filter((row) => row[2] > 0).length);
      expect(rows >= 5, `${name} has a past of ${rows} bins`);
      const mean = await follower.evaluate(() => {
        const means = shown.rows.filter((row) => row[5] !== 0).map((row) => (row[5].length === 1 ? row[5][0] : row[5][1]));
        return means.reduce((sum, value) => sum + value, 0) / means.length;
      });
      expect(Math.abs(mean - velocity) < 0.1, `${name} moves at ${mean} m/s`);
      await shows(follower, 'the alignment of its own message', () => Number(document.getElementById('signal-rate').dataset.value) > 0);
      const [sequence, text] = await until('a frame that the listener has', async () => {
        const values = await follower.evaluate(() => [Number(document.body.dataset.sequence), document.getElementById('distance').dataset.value]);
        return heard_of(own).some((frame) => frame.sequence === values[0]) && values;
      });
      const frame = heard_of(own).find((one) => one.sequence === sequence && one.pixel === name);
      expect(String(frame.distance_m) === text, `${text} m on the page, ${frame.distance_m} m in the message`);
      await own.end();
    }
  });

  await check('arrow keys choose a pixel, and pointing tells of another', async () => {
    await follower.focus('#field-pictures');
    for (const [key, name] of [['ArrowRight', 'b3'], ['ArrowDown', 'c3'], ['ArrowLeft', 'c2'], ['ArrowUp', 'b2']]) {
      await follower.keyboard.press(key);
      await shows_pixel(follower, name);
    }
    for (let i = 0; i < 20; ++i) await follower.keyboard.press('ArrowLeft');
    await shows_pixel(follower, 'b1');
    await follower.mouse.move(...await middle_of(follower, 'field-distance', 'a1'));
    await shows(follower, 'the pixel under the cursor', () => document.getElementById('field-velocity-readout').textContent === 'a1: no target');
    await follower.mouse.move(...await middle_of(follower, 'field-signal', 'h9'));
    await shows(follower, 'another', () => /^h9: \d+\.\d+ m$/.test(document.getElementById('field-distance-readout').textContent) &&
      /^h9: [\d.]+ µcounts\/pulse$/.test(document.getElementById('field-signal-readout').textContent));
    await follower.mouse.move(1, 1);
    await shows(follower, 'the chosen one', () => document.getElementById('field-distance-readout').textContent.startsWith('b1: '));
  });

  await check('a pixel without a target says so, and its choice survives a reload', async () => {
    await follower.mouse.click(...await middle_of(follower, 'field-distance', 'a1'));
    await shows_pixel(follower, 'a1');
    // By chance one frame of a thousand reports a target, whose distance stays with its age.
    await shows(follower, 'no values', () => document.getElementById('distance').dataset.value === undefined &&
      document.getElementById('frame-status').textContent === 'no target');
    await follower.reload({waitUntil: 'domcontentloaded'});
    await shows_pixel(follower, 'a1');
    await follower.mouse.click(...await middle_of(follower, 'field-distance', 'h8'));
    await shows_pixel(follower, 'h8');
    const csv = await follower.evaluate(() => fetch(`frames.csv?from=0&to=1e12${pixel_argument()}`.replace('1e12', '999999999999')).then((answer) => answer.text()));
    const [head, ...rows] = csv.trim().split('\n').map((line) => line.split(','));
    expect(rows.length > 10 && rows.every((row) => row[head.indexOf('pixel')] === 'h8'), `${rows.length} rows: ${rows[0]}`);
  });

  await check('pause holds the pictures, too', async () => {
    await follower.evaluate(() => document.activeElement.blur());
    await follower.keyboard.press(' ');
    await pause(300);
    const held = await value_of(follower, 'field-note');
    await until('newer scenes', () => heard_of(scenes).at(-1).sequence > Number(held) + 3);
    expect(await value_of(follower, 'field-note') === held, 'a scene was drawn in the pause');
    await follower.keyboard.press(' ');
    await shows(follower, 'newer pictures', (before) => Number(document.getElementById('field-note').dataset.value) > Number(before) + 3, held);
  });

  await check('accessible with pictures of pixels in light', async () => accessibility(false, await view.url()));
  await check('accessible with pictures of pixels in dark', async () => accessibility(true, await view.url()));

  if (screenshots) {
    for (const [name, width, height, dark] of [['phone', 390, 844, false], ['desk', 1280, 900, false], ['wall', 1920, 1080, true]]) {
      await follower.setViewport({width, height});
      await follower.emulateMediaFeatures([{name: 'prefers-color-scheme', value: dark ? 'dark' : 'light'}]);
      await follower.evaluate(() => scrollTo(0, 0));
      await pause(2000);
      await follower.screenshot({path: join(screenshots, `array-${name}.png`), type: 'png'});
    }
    await follower.emulateMediaFeatures([{name: 'prefers-color-scheme', value: 'light'}]);
  }
  await follower.setViewport({width: 1280, height: 800});

  await check('pixels without directions stand in their order, and one pixel is shown as ever', async () => {
    await scenes.end();
    expect(await field_daemon.end() === 0, field_daemon.err);
    const unordered = new Program('run', '--config', configuration('unordered.json', later, {
      driver: 'simulator', signal_per_pulse: 0.005, ambient_per_s: 2000}, {pixels: [1, 2, 3, 4, 5].map((input) => ({input}))}));
    await shows(follower, 'three columns', () => field.layout && field.layout.columns === 3 && field.layout.rows === 2 &&
      document.getElementById('field-order').textContent.includes('order') && field.pixel === '1' && shown.frame && shown.frame.pixel === '1');
    expect(await unordered.end() === 0, unordered.err);
    const single = new Program('run', '--config', live);
    await shows(follower, 'one pixel', () => document.getElementById('field').hidden && shown.frame && shown.frame.pixel === undefined &&
      document.getElementById('frame-status').textContent === 'ok' && charts[0].range !== null);
    expect(await single.end() === 0, single.err);
  });
}
