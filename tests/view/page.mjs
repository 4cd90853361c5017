// The live page in a real browser. scripts/test-view runs this.
import {readFileSync} from 'node:fs';
import {createRequire} from 'node:module';
import {spawn} from 'node:child_process';
import http from 'node:http';
import {join} from 'node:path';
import {Program, check, configuration, expect, finish, folder, new_browser, new_endpoint, open_page, pause,
  run_to_end, shows, source, text_of, until, value_of} from './harness.mjs';
import {check_array} from './array.mjs';

const axe = readFileSync(createRequire(import.meta.url).resolve('axe-core/axe.min.js'), 'utf8');
const screenshots = process.env.SCREENSHOTS;
const endpoint = new_endpoint();
const browser = await new_browser();
const demo = new Program('demo', '--endpoint', endpoint, '--http', '127.0.0.1:*');
const url = await demo.url();
const listener = new Program('listen', '--endpoint', endpoint, '--json', 'frame');

const frames_heard = () => new Map(listener.out.split('\n').filter((line) => line.endsWith('}'))
  .map((line) => JSON.parse(line)).map((frame) => [frame.sequence, frame]));

// Tall enough for all charts: what is out of sight is not drawn.
const page = await open_page(browser, url, {height: 2600});
await shows(page, 'the first frame', () => document.body.dataset.sequence !== undefined);

await check('values on the page equal the messages', async () => {
  const seen = new Map();
  await until('twenty frames were shown', async () => {
    const [sequence, values] = await page.evaluate(() => {
      const ids = ['distance', 'distance-std', 'velocity', 'velocity-std', 'significance', 'sbr', 'frame-status', 'frame-note'];
      return [Number(document.body.dataset.sequence), ids.map((id) => document.getElementById(id).dataset.value)];
    });
    seen.set(sequence, values);
    return seen.size >= 20;
  });
  await until('the listener has them all', () => Math.max(...frames_heard().keys()) >= Math.max(...seen.keys()));
  const heard = frames_heard();
  let compared = 0;
  for (const [sequence, values] of seen) {
    const frame = heard.get(sequence);
    if (!frame) continue;  // from before the listener came
    const expected = [frame.distance_m, frame.std?.distance_m, frame.velocity_mps, frame.std?.velocity_mps,
      frame.significance, frame.valid ? frame.sbr : undefined, frame.status, frame.photons]
      .map((value) => (value === undefined ? undefined : String(value)));
    expect(JSON.stringify(values) === JSON.stringify(expected), `frame ${sequence}: ${values} instead of ${expected}`);
    ++compared;
  }
  expect(compared >= 15, `only ${compared} frames were compared`);
});

await check('every chart draws, and shows its last value with its unit', async () => {
  await shows(page, 'all readouts', () => [...document.querySelectorAll('#charts .readout')].length === 9 &&
    [...document.querySelectorAll('#charts .readout')].every((line) => /\d/.test(line.textContent)));
  const drawn = await page.evaluate(() => Number(document.body.dataset.drawn));
  await shows(page, 'more pictures', (before) => Number(document.body.dataset.drawn) > before + 5, drawn);
});

await check('pause holds the picture still, and goes on with the newest', async () => {
  await page.keyboard.press(' ');
  await pause(200);
  const held = await page.evaluate(() => document.body.dataset.sequence);
  await pause(500);
  expect(held === await page.evaluate(() => document.body.dataset.sequence), 'a frame was shown in the pause');
  await page.keyboard.press(' ');
  await shows(page, 'newer frames', (before) => Number(document.body.dataset.sequence) > Number(before) + 5, held);
});

await check('dragging zooms all charts, and escape leads back', async () => {
  const box = await (await page.$('.chart.main .plot')).boundingBox();
  await page.mouse.move(box.x + box.width * 0.5, box.y + 40);
  await page.mouse.down();
  await page.mouse.move(box.x + box.width * 0.8, box.y + 45, {steps: 5});
  await page.mouse.up();
  await shows(page, 'a zoom', () => shown.zoom !== null && !document.getElementById('whole').disabled);
  await shows(page, 'the same time in all charts', () => charts.every((chart) => chart.window.join() === shown.zoom.join()));
  await page.keyboard.press('Escape');
  await shows(page, 'the whole time', () => shown.zoom === null);
});

await check('shift and dragging moves all charts', async () => {
  const box = await (await page.$('.chart.main .plot')).boundingBox();
  await page.evaluate(() => { const [from, to] = charts[0].window; set_zoom([from + (to - from) * 0.4, from + (to - from) * 0.6]); });
  const before = await page.evaluate(() => shown.zoom);
  await shows(page, 'the zoom', () => charts.every((chart) => chart.window.join() === shown.zoom.join()));
  await page.keyboard.down('Shift');
  await page.mouse.move(box.x + box.width * 0.7, box.y + 40);
  await page.mouse.down();
  await page.mouse.move(box.x + box.width * 0.5, box.y + 40, {steps: 5});
  await page.mouse.up();
  await page.keyboard.up('Shift');
  const width = before[1] - before[0];
  await shows(page, 'later times of the same length in all charts', (from, span) => charts.every((chart) => {
    const [left, right] = chart.window;
    return left > from + span * 0.05 && Math.abs(right - left - span) < span * 0.01;
  }), before[0], width);
  await page.keyboard.press('Escape');
  await shows(page, 'the whole time', () => shown.zoom === null);
});

await check('every chart says what is under the cursor, with its unit', async () => {
  await page.keyboard.press(' ');
  await shows(page, 'a standing picture', () => charts.every((chart) => !chart.stale));
  const box = await (await page.$('.chart.main .plot')).boundingBox();
  await page.mouse.move(box.x + box.width * 0.97, box.y + 60);
  // The clock stands before the values only where the cursor is.
  const units = ['m', 'm/s', 'mcounts/pulse', 'kcounts/s', '', 'ppm', 'ps', 'ms', '%'];
  const readouts = await until('nine values', async () => {
    const lines = await page.evaluate(() => charts.map((chart) => chart.readout.textContent.trim()));
    return lines.every((line) => /^\d\d:\d\d:\d\d\.\d{3} .*\d/.test(line)) && lines;
  });
  readouts.forEach((line, i) => expect(line.endsWith(units[i]), `${line} instead of ${units[i]}`));
  const value = await page.evaluate(() => value_in(charts[0], 'distance', selected_row()));
  // Two digits of the spread; of a bin with two frames, between which the target moved, it is centimetres.
  const half = Number(((value[2] - value[0]) / 2).toPrecision(2));
  const [, mean, spread] = readouts[0].match(/ ([\d.]+) ± ([\d.]+) m$/) || [];
  const places = spread ? spread.split('.')[1].length : 5;
  expect(Number(spread) === half && mean === value[1].toFixed(places), `${readouts[0]} instead of ${value[1]} ± ${half} m`);
  await page.keyboard.press(' ');
});

await check('axes have their units, and a chart without a value has no numbers', async () => {
  await shows(page, 'pictures', () => charts.every((chart) => chart.range));
  const units = await page.evaluate(() => charts.map((chart) => chart.axis_unit).join());
  expect(units === 'm,m/s,mcounts/pulse,kcounts/s,,ppm,ps,ms,%', units);
  const texts = await page.evaluate(() => {
    const said = [];
    const original = CanvasRenderingContext2D.prototype.fillText;
    CanvasRenderingContext2D.prototype.fillText = function (text, ...more) { said.push(text); return original.call(this, text, ...more); };
    const kept = shown.rows;
    shown.rows = [];
    draw(charts[0]);
    shown.rows = kept;
    CanvasRenderingContext2D.prototype.fillText = original;
    return said.filter((text) => !text.includes(':'));
  });
  expect(texts.join() === 'no value', texts.join());
});

await check('at most ten pictures a second, and none where nothing comes', async () => {
  const drawn = () => page.evaluate(() => [shown.drawn, performance.now()]);
  const [before, began] = await drawn();
  await pause(2000);
  const [after, ended] = await drawn();
  const a_second = (after - before) / (ended - began) * 1e3 / 9;
  expect(a_second > 0.5 && a_second <= 10.5, `${a_second} pictures of each chart a second`);
  await page.keyboard.press(' ');
  await shows(page, 'a standing picture', () => charts.every((chart) => !chart.stale));
  const [held] = await drawn();
  await pause(500);
  expect((await drawn())[0] === held, 'pictures of nothing new');
  await page.keyboard.press(' ');
});

await check('numbers have one format', async () => {
  const said = await page.evaluate(() => [in_one(0.00135, 0.0000123, 'counts/pulse'), in_one(173180, undefined, 'counts/s'),
    in_one(284.500123, 0.00057, 'm'), in_one(-3.2, 0.021, 'm/s'), in_one(0.0123, undefined, ''), in_one(12345678, 1e4, 'counts/s'),
    in_one(0, 20, 'counts/s'), in_one(undefined, 1, 'm'), in_one(999.96, undefined, 'counts/s')]);
  expect(said.join('|') === '1.350 ± 0.012 mcounts/pulse|173.2 kcounts/s|284.50012 ± 0.00057 m|-3.200 ± 0.021 m/s|' +
    '0.01230|12.346 ± 0.010 Mcounts/s|0 ± 20 counts/s|–|1000.0 counts/s', said.join('|'));
});

await check('the title has the state and the distance', async () => {
  await shows(page, 'a title', () => /^ok · \d+\.\d+ ± \d+\.\d+ m · splid$/.test(document.title));
});

await check('the length of time, the pictures and the alignment survive a reload', async () => {
  const one = await open_page(browser, url, {width: 1440, height: 900});
  await one.click('[data-seconds="300"]');
  await one.click('#photons');
  await one.keyboard.press('a');
  await one.reload({waitUntil: 'domcontentloaded'});
  await shows(one, 'what was open', () => shown.seconds === 300 && photons.on && !document.getElementById('pictures').hidden &&
    document.body.classList.contains('aligning'));
  await shows(one, 'frames', () => Number(document.body.dataset.sequence) > 0);
  for (const [width, height] of [[1440, 900], [390, 844]]) {
    await one.setViewport({width, height});
    await one.evaluate(() => scrollTo(0, 0));
    if (screenshots) await one.screenshot({path: join(screenshots, `align-${width}.png`)});
    const box = await (await one.$('#bigger')).boundingBox();
    expect(box && box.y >= 0 && box.y + box.height <= height && box.x + box.width <= width, `the button lies at ${JSON.stringify(box)}`);
  }
  await one.click('#bigger');
  expect(await one.evaluate(() => !document.body.classList.contains('aligning') && !location.hash.includes('align')), 'it stays large');
  await one.close();
});

await check('the tone is off until it is asked for, and rises an octave for ten times the signal', async () => {
  expect(await page.evaluate(() => tone === null), 'a tone unasked');
  await page.click('#tone');
  await shows(page, 'the tone of the signal rate', () => {
    const signal = Number(document.getElementById('signal-rate').dataset.value);
    return tone.gain.gain.value > 0.02 && Math.abs(Math.log2(tone.oscillator.frequency.value / 440) - Math.log10(signal / 1000)) < 0.1;
  });
  await page.click('#tone');
  expect(await page.evaluate(() => tone === null), 'the tone stays');
});

await check('the table of means has what the charts show, with units', async () => {
  const lines = (await page.evaluate(() => table())).trim().split('\n');
  const head = lines[0].split(',');
  expect(lines[0].startsWith('time_utc,frames,valid_frames,status,distance_m,distance_low_m,distance_high_m,velocity_mps,velocity_low_mps,') &&
    head.includes('sbr_high') && head.includes('signal_low_per_pulse') && head.includes('signal_rate_per_s'), lines[0]);
  const distance = Number(lines.at(-1).split(',')[head.indexOf('distance_m')]);
  expect(distance > 280 && distance < 290, `the last distance is ${distance} m`);
  // Zoomed at the middle half of the rows that are there, however long the demonstration has run.
  const [rows, within, inside] = await page.evaluate(() => {
    const times = () => table().trim().split('\n').slice(1).map((line) => Date.parse(line.split(',')[0]));
    const all = times();
    const [left, right] = [all[Math.floor(all.length / 4)], all[Math.floor(all.length * 3 / 4)]];
    set_zoom([left, right]);
    const zoomed = times();
    set_zoom(null);
    // A millisecond for the times, which are written in whole ones.
    const expected = all.filter((time) => time >= left - 1 && time <= right + 1);
    return [all.length, zoomed.length, zoomed.every((time) => expected.includes(time)) && expected.length - zoomed.length <= 2];
  });
  expect(within > 1 && within < rows - 1 && inside, `${within} of ${rows} rows are zoomed at`);
});

// What the button saves: the frames of the time shown, as they were published.
await check('the button saves the frames, and the means where the server has no frames any more', async () => {
  const save = () => page.evaluate(() => new Promise((done) => {
    const made = URL.createObjectURL;
    URL.createObjectURL = (blob) => { URL.createObjectURL = made; blob.text().then(done); return made.call(URL, blob); };
    document.getElementById('csv').click();
  }));
  const lines = (await save()).trim().split('\n').map((line) => line.split(','));
  const [head, ...rows] = lines;
  const column = (name) => head.indexOf(name);
  const heard = frames_heard();
  const known = rows.filter((row) => heard.has(Number(row[column('sequence')])));
  expect(known.length > 20 && known.every((row) => {
    const frame = heard.get(Number(row[column('sequence')]));
    return row[column('distance_m')] === String(frame.distance_m) && row[column('std_distance_m')] === String(frame.std.distance_m);
  }), `${known.length} of ${rows.length} frames compared`);
  const means = await page.evaluate(() => { window.fetch = () => Promise.resolve({status: 204}); return table().split('\n')[0]; });
  expect((await save()).startsWith(means), 'no means');
  await page.evaluate(() => { delete window.fetch; });
});

await check('no picture of photons is made until somebody looks, and then all three', async () => {
  expect(await page.evaluate(() => photons.fold === null && document.getElementById('pictures').hidden), 'asked for early');
  await page.click('#photons');
  await shows(page, 'a fold', () => photons.fold && photons.fold.plane);
  const fold = await page.evaluate(() => photons.fold);
  expect(fold.stack.counts.length === 200 && fold.period.counts.length === 1024 && fold.plane.gain_nats.length === 4096,
    'the pictures have other sizes');
  expect(Number(await value_of(page, 'fold-note')) === fold.sequence || await page.evaluate(() => photons.fold.sequence) > fold.sequence,
    'the note names another frame');
  for (const id of ['stack', 'period', 'plane']) {
    const colours = await page.$eval(`#${id}`, (canvas) => new Set(
      new Uint32Array(canvas.getContext('2d').getImageData(0, 0, canvas.width, canvas.height).data.buffer)).size);
    expect(colours > 10, `${id} has ${colours} colours`);
  }
  const box = await (await page.$('#plane')).boundingBox();
  await page.mouse.move(box.x + box.width / 2 + 15, box.y + box.height / 2 - 15);
  const value = () => /mm, .* m\/s: .* nats/.test(document.getElementById('plane-readout').textContent);
  await shows(page, 'a value under the cursor', value);
  const pointed_at = await page.evaluate(() => photons.fold.sequence);
  await shows(page, 'a newer picture', (before) => photons.fold.plane && photons.fold.sequence > before, pointed_at);
  expect(await page.evaluate(value), 'the next picture takes the value away');
});

// On a page of its own: what axe itself does to a page is no fault of the page.
async function accessibility(dark, place = url) {
  const one = await open_page(browser, place, {dark});
  await one.click('#photons');
  await shows(one, 'a fold', () => photons.fold && photons.fold.plane);
  await one.evaluate(axe);
  const result = await one.evaluate(() => window.axe.run(document, {resultTypes: ['violations']}));
  const bad = result.violations.filter(({impact}) => ['serious', 'critical'].includes(impact))
    .map(({id, nodes}) => `${id}: ${nodes.map(({target}) => target).join(' ')}`);
  await one.close();
  expect(bad.length === 0, bad.join('; '));
}
await check('accessible in light', () => accessibility(false));
await check('accessible in dark', () => accessibility(true));

await check('everything that is pressed can be pressed by keyboard', async () => {
  const reached = new Set();
  for (let i = 0; i < 40; ++i) {
    await page.keyboard.press('Tab');
    reached.add(await page.evaluate(() => document.activeElement.id || document.activeElement.dataset.seconds));
  }
  for (const id of ['10', '3600', 'pause', 'csv', 'tone', 'bigger', 'photons', 'theme']) {
    expect(reached.has(id), `${id} was not reached: ${[...reached]}`);
  }
  await page.focus('#bigger');
  await page.keyboard.press('Enter');
  expect(await page.evaluate(() => document.body.classList.contains('aligning')), 'Enter does not press');
  await page.keyboard.press('a');
  expect(await page.evaluate(() => !document.body.classList.contains('aligning')), 'key a does not toggle');
});

if (screenshots) {
  await page.emulateMediaFeatures([{name: 'prefers-color-scheme', value: 'light'}]);
  await page.evaluate(() => document.activeElement.blur());
  await shows(page, 'twenty seconds of frames', () => Number(document.body.dataset.sequence) > 400);
  await page.evaluate(() => set_seconds(30));
  for (const [name, width, height, dark] of [['phone', 390, 844, false], ['desk', 1280, 900, false], ['wall', 1920, 1080, true]]) {
    await page.setViewport({width, height});
    await page.emulateMediaFeatures([{name: 'prefers-color-scheme', value: dark ? 'dark' : 'light'}]);
    await page.evaluate(() => scrollTo(0, 0));
    await pause(3000);
    await page.screenshot({path: join(screenshots, `view-${name}.png`), type: 'png'});
  }
}

await check('ten viewers at once see the same', async () => {
  const pages = [];
  for (let i = 0; i < 10; ++i) {
    // As of ten browsers: one of them opens six connections to a server at most.
    pages.push(await open_page(await browser.createBrowserContext(), url, {width: 800, height: 600}));
  }
  for (const one of pages) await shows(one, 'frames', () => Number(document.body.dataset.sequence) > 0);
  const newest = Math.max(...await Promise.all(pages.map((one) => one.evaluate(() => Number(document.body.dataset.sequence)))));
  for (const one of pages) await shows(one, 'what another has seen', (frame) => Number(document.body.dataset.sequence) >= frame, newest);
  await shows(page, 'eleven viewers', () => document.getElementById('viewers').textContent.startsWith('11 '));
  for (const one of pages) {
    expect(one.faults.length === 0, one.faults.join('; '));
    await one.browserContext().close();
  }
  await shows(page, 'one viewer', () => document.getElementById('viewers').textContent.startsWith('1 viewer'));
});

await check('a thousand connections come and go', async () => {
  const before = demo.memory_mib('VmRSS');
  const connect = () => new Promise((done, fail) => {
    const request = http.get(`${url}events?seconds=10`, (answer) => {
      answer.once('data', () => { request.destroy(); done(); });
      answer.on('error', () => {});
    });
    request.on('error', (error) => (error.code === 'ECONNRESET' ? done() : fail(error)));
  });
  for (let i = 0; i < 100; ++i) await Promise.all(Array.from({length: 10}, connect));
  await shows(page, 'one viewer', () => document.getElementById('viewers').textContent.startsWith('1 viewer'));
  expect(demo.memory_mib('VmRSS') < before + 60, `${before} MiB became ${demo.memory_mib('VmRSS')} MiB`);
});

await check('nothing went wrong on the page, and it asked for nothing elsewhere', async () => {
  expect(page.faults.length === 0, page.faults.join('; '));
  expect(page.elsewhere.length === 0, page.elsewhere.join(' '));
});
await page.close();
await listener.end();
await check('the demonstration ends cleanly', async () => {
  const code = await demo.end('SIGINT');
  expect(code === 0, `exit code ${code}: ${demo.err}`);
  const refused = await new Promise((done) => http.get(url, () => done('an answer')).on('error', (error) => done(error.code)));
  expect(refused === 'ECONNREFUSED', `the page's place gives ${refused}`);
});

const later = new_endpoint();
const view = new Program('view', '--endpoint', later, '--http', '127.0.0.1:*');
const follower = await open_page(browser, await view.url());
const live = configuration('live.json', later, {driver: 'simulator', signal_per_pulse: 0.005, ambient_per_s: 2000});

await check('a daemon that is not there yet, stops and comes back', async () => {
  await shows(follower, 'trouble', () => document.getElementById('state').textContent === 'no connection');
  for (let turn = 0; turn < 2; ++turn) {
    const daemon = new Program('run', '--config', live);
    await shows(follower, 'ok', () => document.getElementById('state').textContent.startsWith('ok') &&
      document.getElementById('device').className === 'good' && !document.body.classList.contains('old') && Number(document.body.dataset.sequence) > 3);
    expect(await daemon.end() === 0, daemon.err);
    await shows(follower, 'trouble', () => document.getElementById('state').textContent === 'no connection' &&
      document.body.classList.contains('old'));
    await shows(follower, 'nothing that looks well', () => document.getElementById('device').className === '' &&
      document.getElementById('device').textContent.startsWith('last heard: ') &&
      /^no connection/.test(document.getElementById('distance-std').textContent) &&
      document.getElementById('distance-tile').className.includes('doubtful') &&
      /\d+ s ago/.test(document.getElementById('age').textContent) && document.title === 'no connection · splid');
    await follower.evaluate(() => { delete document.body.dataset.sequence; });
  }
});

// The headline in words and colour, its reason beside nothing else, and the values where they do not hold.
await check('each state of the measurement is shown in words and colour', async () => {
  const seen = await follower.evaluate(() => {
    const text = (id) => document.getElementById(id).textContent;
    const background = (id) => getComputedStyle(document.getElementById(id)).backgroundColor;
    const [status, frame, trouble] = [state_message, shown.frame, shown.trouble];
    const valid = {...frame, status: 'ok', valid: true, distance_m: 284.5, velocity_mps: -3, std: {distance_m: 0.0006, velocity_mps: 0.02}};
    take_frame(valid);
    draw_picture();
    shown.trouble = '';
    const said = ['ok', 'no_target', 'ambiguous', 'saturated', 'wrong_pattern', 'no_signal', 'no_sync', 'incomplete', 'none'].map((measurement) => {
      const has_values = ['ok', 'ambiguous', 'saturated'].includes(measurement);
      const {distance_m, velocity_mps, std, ...bare} = valid;
      take_frame({...(has_values ? valid : bare), status: measurement === 'none' || measurement.startsWith('wrong') || measurement === 'no_signal' ? 'no_target' : measurement,
        valid: measurement === 'ok' || measurement === 'ambiguous'});
      draw_picture();
      take_status({...status, state: 'streaming', measurement, reason: measurement === 'ok' ? '' : `why ${measurement}`});
      show_title();
      return [text('state'), background('state'), text('reason'), text('distance-std').replace(/\d+ s old/, 'N s old'),
        getComputedStyle(document.querySelector('#distance-tile .value')).color, document.title.split(' · ')[0]];
    });
    const reason = document.getElementById('reason');
    reason.textContent = 'publish.endpoint '.repeat(12);
    const [header, box] = [reason.closest('header').getBoundingClientRect(), reason.getBoundingClientRect()];
    const shape = [box.width / header.width, box.height / parseFloat(getComputedStyle(reason).lineHeight)];
    Object.assign(shown, {trouble});
    take_status(status);
    take_frame(frame);
    return {said, shape};
  });
  const words = ['ok', 'no target', 'ambiguous', 'saturated', 'wrong pattern', 'no signal', 'no sync', 'incomplete', 'none'];
  const notes = ['', 'no target, N s old, ', 'ambiguous, ', 'saturated, ', 'no target, N s old, ', 'no target, N s old, ', 'no sync, N s old, ', 'incomplete, N s old, ',
    'no target, N s old, '].map((note) => note + '± 0.00060 m');
  const [green, black] = [seen.said[0][1], seen.said[0][4]];
  seen.said.forEach(([state, colour, reason, note, ink, title], i) => {
    expect(state === words[i] && title === words[i], `${state} and the title ${title} instead of ${words[i]}`);
    expect((colour === green) === (i === 0), `${state} is ${colour}`);
    expect(reason === (i === 0 ? '' : `why ${words[i].replaceAll(' ', '_')}`), `${state} because of ${reason}`);
    expect(note === notes[i] && (ink === black) === (i === 0), `${state}: ${note} in ${ink}`);
  });
  expect(seen.shape[0] > 0.9 && seen.shape[1] < 2.1, `the reason takes ${seen.shape}`);
});

await check('a lowered effort has the colour of an alarm', async () => {
  const colours = await follower.evaluate(() => [true, undefined].map((effort_is_lowered) => {
    take_status({...state_message, effort_is_lowered});
    return document.getElementById('effort').className;
  }));
  expect(colours[0] === 'alarm' && colours[1] === 'good', colours.join(', '));
});

await check('a target that is lost and found again', async () => {
  const dark_bins = () => shown.rows.filter((row) => row[2] === 0 && row[3] === STATUSES.indexOf('no_target'));
  const steps = [[true, 'ok'], [false, 'no target'], [true, 'ok']];
  for (const [bright, status] of steps) {
    // What the page says of the daemon before is no answer of this one.
    await follower.evaluate(() => { document.getElementById('frame-status').textContent = ''; });
    const daemon = new Program('run', '--config', configuration('step.json', later, {
      driver: 'simulator', signal_per_pulse: bright ? 0.005 : 0, ambient_per_s: 2000,
    }));
    await shows(follower, status, (text) => document.getElementById('frame-status').textContent === text, status);
    const [distance, signal] = [await text_of(follower, 'distance'), await text_of(follower, 'signal-rate')];
    expect(bright ? /\d/.test(distance) && /\d/.test(signal) : signal === '–', `${status} with the distance ${distance} and the signal ${signal}`);
    // The last valid distance stands, grey, with the word and its age.
    if (!bright) {
      await shows(follower, 'an old distance that says so', () => /\d/.test(document.getElementById('distance').textContent) &&
        document.getElementById('distance').dataset.value === undefined &&
        /^no target, \d+ s old/.test(document.getElementById('distance-std').textContent) &&
        document.getElementById('distance-tile').className.includes('doubtful'));
      await shows(follower, 'the state and why', () => document.getElementById('state').textContent === 'no target' &&
        document.getElementById('reason').textContent.includes('show no target'));
    }
    expect(Number(await value_of(follower, 'signal-rate-best')) > 0, 'the best signal of the last minute is gone');
    // The daemon's last frame is cut short, and says so. It may share a bin with the frame before it,
    // and the bin then has its status. So the dark needs a bin that is not the last.
    if (!bright) await shows(follower, 'two bins without a target', `(${dark_bins})().length >= 2`);
    await daemon.end();
  }
  // The charts: no value while it was lost, and no line across that time.
  const [lost, bridged] = await follower.evaluate(`(() => {
    const dark = (${dark_bins})();
    const [from, to] = [time_of(dark[0]), time_of(dark[dark.length - 1])];
    const lines = lines_of(charts[0], 'distance', shown.rows, 1);
    return [dark.length, lines.filter((line) => line[0][0] < from && line[line.length - 1][0] > to).length];
  })()`);
  expect(lost > 0 && bridged === 0, `${lost} bins without a target, ${bridged} lines across them`);
});

// Real scenes that are not ok, each from the daemon to the eye.
for (const [words, scene, more] of [
  ['no signal', {signal_per_pulse: 0, ambient_per_s: 0, dark_per_s: 0}, {}],
  ['no target', {signal_per_pulse: 0, ambient_per_s: 20000}, {}],
  ['saturated', {signal_per_pulse: 0.5, ambient_per_s: 20000}, {detector: {dead_time_ns: 50, dead_time: 'flagged'}}],
  ['ambiguous', {signal_per_pulse: 0.01, ambient_per_s: 2000}, {pattern: {file: join(source, 'config/patterns/ambiguous-94.5.json')}}],
]) {
  await check(`a scene that is ${words}`, async () => {
    await follower.setViewport({width: 1440, height: 900});
    const daemon = new Program('run', '--config', configuration('scene.json', later, {driver: 'simulator', ...scene}, more));
    await shows(follower, words, (text) => document.getElementById('state').textContent === text &&
      document.getElementById('state').className !== 'pill good' && document.getElementById('reason').textContent.length > 20 &&
      document.getElementById('frame-status').textContent === (text === 'no signal' ? 'no target' : text) &&
      document.getElementById('distance-std').textContent.startsWith(text === 'no signal' ? 'no target' : text), words);
    if (screenshots) {
      await pause(2500);
      await follower.screenshot({path: join(screenshots, `state-${words.replace(' ', '-')}.png`)});
      await follower.setViewport({width: 390, height: 844});
      await pause(500);
      await follower.screenshot({path: join(screenshots, `state-${words.replace(' ', '-')}-phone.png`)});
    }
    expect(await daemon.end() === 0, daemon.err);
  });
}
await follower.setViewport({width: 1280, height: 800});

await check('recording, encoder and several targets are shown as the messages have them', async () => {
  expect(await text_of(follower, 'recording') === 'off', await text_of(follower, 'recording'));
  const folder_of_recordings = join(folder, 'recordings');
  const rich = new Program('run', '--config', configuration('rich.json', later, {
    driver: 'simulator', signal_per_pulse: 0.01, ambient_per_s: 2000, encoder_rate_hz: 1000,
    target: {motion: 'linear', distance_m: 284.5}, more_targets: [{motion: 'linear', distance_m: 282.5, signal_per_pulse: 0.005}],
  }, {channels: {photon: [1], sync: 'sync', encoder: 'marker:1'}, encoder: {m_per_count: 0.0001}, scene: {targets: 2},
    record: {folder: folder_of_recordings, max_file_s: 2}}));
  const heard = new Program('listen', '--endpoint', later, '--json', 'frame', 'status');
  const messages = (schema) => heard.out.split('\n').filter((line) => line.endsWith('}')).map((line) => JSON.parse(line))
    .filter((message) => message.schema === schema);
  const named = new Set();
  await until('two files were named on the page', async () => {
    const file = await value_of(follower, 'recording');
    if (file) named.add(file);
    expect(/^(off|waits .*|\S+\.ptu, [\d.]+ [kM]?B, \d:\d\d:\d\d)$/.test(await text_of(follower, 'recording')), await text_of(follower, 'recording'));
    return named.size >= 2;
  });
  await until('the messages name them', () => [...named].every((file) =>
    messages('splid.status').some((status) => status.recording && status.recording.file === file)));
  await shows(follower, 'two targets', () => document.querySelectorAll('#targets tr').length === 2 && !document.getElementById('targets-panel').hidden);
  const seen = await follower.evaluate(() => [Number(document.body.dataset.sequence),
    [...document.querySelectorAll('#targets tr')].map((row) => [...row.children].map((cell) => cell.textContent))]);
  await until('the listener has the frame', () => messages('splid.frame').some((frame) => frame.sequence >= seen[0]));
  const frame = messages('splid.frame').find(({sequence}) => sequence === seen[0]);
  frame.targets.forEach((target, i) => {
    const [, status, distance, velocity, signal] = seen[1][i];
    const near = (text, value, deviation) => Math.abs(parseFloat(text) - value) <= deviation / 10 && text.includes('±');
    expect(status === target.status && near(distance, target.distance_m, target.std.distance_m) &&
      near(velocity, target.velocity_mps, target.std.velocity_mps) && signal.endsWith(' mcounts/pulse') &&
      Math.abs(parseFloat(signal) / 1e3 / target.signal_per_pulse - 1) < 0.01,
    `${seen[1][i]} for ${JSON.stringify(target)}`);
  });
  await shows(follower, 'the line of the encoder', () => charts.filter((chart) => chart.main).every((chart) =>
    /\d.* encoder -?\d/.test(chart.readout.textContent) && lines_of(chart, chart.series[1], shown.rows, 1).length > 0));
  await heard.end();
  expect(await rich.end() === 0, rich.err);
});

await check('findings are shown: of the status with what to do, of a frame and of its targets', async () => {
  const [status, state, note, cells, hidden] = await follower.evaluate(() => {
    const findings = [{name: 'pulse_width', value: 0.3841, std: 0.0123, gain_nats: 30, advice: 'Calibrate the pulse.'},
      {name: 'jerk', value: -37.5, std: 4, unit: 'm/s3', gain_nats: 20, advice: 'Shorten frames.'}];
    const text = (id) => document.getElementById(id).textContent;
    const status_before = state_message;
    const frame_before = shown.frame;
    const trouble = shown.trouble;
    shown.trouble = '';
    take_status({...status_before, state: 'degraded', measurement: 'wrong_pattern', findings});
    show_frame({...frame_before, photons: 1234, findings, targets: [{status: 'ok'}, {status: 'ok', findings: [findings[1]]}]});
    const seen = [[...document.querySelectorAll('#findings li')].map((item) => item.textContent), text('state'),
      text('frame-note'), [...document.querySelectorAll('#targets tr')].map((row) => row.lastElementChild.textContent)];
    shown.trouble = trouble;
    take_status({...status_before, findings: undefined});
    show_frame(frame_before);
    return [...seen, document.getElementById('findings-panel').hidden];
  });
  const jerk = 'jerk -37.5 ± 4.0 m/s³';
  expect(status.join('|') === `pulse width 0.384 ± 0.012 Calibrate the pulse.|${jerk} Shorten frames.`, status.join('|'));
  expect(state === 'wrong pattern' && note === `pulse width 0.384 ± 0.012, ${jerk}, 1,234 photons`, `${state}, ${note}`);
  expect(cells.join('|') === `–|${jerk}`, cells.join('|'));
  expect(hidden, 'the panel stays without findings');
});

await check('a fault of the instrument is shown with its reason, and its recovery', async () => {
  const address = `unix:${join(folder, 'instrument')}`;
  const daemon = new Program('run', '--config', configuration('instrument.json', later, {driver: 'bridge', address},
    {channels: {photon: [1], sync: '8', encoder: ''}}));
  const waits = (words) => shows(follower, 'waiting for the instrument', (place) =>
    document.getElementById('state').textContent === 'waiting for device' && document.body.textContent.includes(place), words);
  for (let turn = 0; turn < 2; ++turn) {
    await waits(address.slice(5));
    await follower.evaluate(() => { delete document.body.dataset.sequence; });
    const instrument = Program.of('/usr/bin/python3', join(source, 'tests/view/instrument.py'), address);
    await shows(follower, 'frames', () => document.getElementById('stream').textContent === 'streaming' &&
      document.body.dataset.sequence !== undefined);
    await instrument.end('SIGKILL');
  }
  await waits(address.slice(5));
  expect(await daemon.end() === 0, daemon.err);
});

await check('a replay is shown as it was recorded', async () => {
  const scene = configuration('scene.json', later, {driver: 'simulator', signal_per_pulse: 0.005, ambient_per_s: 2000});
  const recording = join(folder, 'scene.ptu');
  run_to_end('simulate', '--config', scene, '--seconds', '3', '--output', recording);
  const replay = new Program('replay', recording, '--config', scene, '--speed', '1', '--json');
  await shows(follower, 'the last frame', () => Number(document.body.dataset.sequence) >= 55);
  await replay.ended;
  const [sequence, distance] = await follower.evaluate(() => [Number(document.body.dataset.sequence),
    document.getElementById('distance').dataset.value]);
  const frame = replay.out.trim().split('\n').map((line) => JSON.parse(line)).find((one) => one.sequence === sequence);
  expect(String(frame.distance_m) === distance, `${distance} m on the page, ${frame.distance_m} m in the replay`);
});

await check_array({view, follower, later, live, accessibility, screenshots});

// What viewers that read nothing have not read is more than the system's connections hold. Of that
// the view is to keep the last of each message alone, and it is to serve another viewer all along.
await check('viewers that read nothing cost the others nothing, and very many frames no more memory than a few', async () => {
  const place = await view.url();
  const asleep = [];
  for (let i = 0; i < 40; ++i) {
    asleep.push(await new Promise((done) => http.get(`${place}events?seconds=10`, (answer) => { answer.pause(); done(answer); })));
  }
  const before = view.memory_mib('VmRSS');
  const fast = configuration('fast.json', later, {
    driver: 'simulator', pace: 'max', seconds: 200, signal_per_pulse: 0.005, ambient_per_s: 2000,
  });
  const daemon = new Program('run', '--config', fast);
  const begin = Date.now();
  let [changed, longest_ms, sequence] = [begin, 0, ''];
  while (daemon.code === undefined) {
    const now = await follower.evaluate(() => document.body.dataset.sequence);
    if (now !== sequence) changed = Date.now();
    longest_ms = Math.max(longest_ms, Date.now() - changed);
    sequence = now;
    await pause(20);
  }
  const took_ms = Date.now() - begin;
  // A view that had no processor for long has lost the last messages to its queue, and holds the last that it heard.
  const table = (await (await fetch(`${place}frames.csv?from=0&to=999999999999`)).text()).trim().split('\n').map((line) => line.split(','));
  const last = Number(table.at(-1)[table[0].indexOf('sequence')]);
  expect(last > 1000, `the view heard ${last} frames`);
  await shows(follower, 'what came last', (sequence) => Number(document.body.dataset.sequence) >= sequence, last);
  const rows = await follower.evaluate(() => shown.rows.length);
  expect(rows <= 2000, `${rows} points a series`);
  const {JSHeapUsedSize} = await follower.metrics();
  expect(JSHeapUsedSize < 64 * 2 ** 20, `the page holds ${JSHeapUsedSize} bytes`);
  console.log(`      no frame for ${longest_ms} ms at most in ${took_ms} ms; view ${before.toFixed(1)} MiB before, ${view.memory_mib('VmHWM').toFixed(1)} at most`);
  expect(longest_ms < took_ms / 2, `the page stood still for ${longest_ms} ms of ${took_ms} ms`);
  expect(view.memory_mib('VmHWM') < before + 40, `the view took ${before} MiB, then ${view.memory_mib('VmHWM')}`);
  for (const answer of asleep) answer.destroy();
});

if (process.env.LONG) {
  await check("two days' worth of frames take no more memory than the first hour's", async () => {
    const stored = new_endpoint();
    const long_view = new Program('view', '--endpoint', stored, '--http', '127.0.0.1:*');
    const long_page = await open_page(browser, await long_view.url());
    await long_page.evaluate(() => set_seconds(3600));
    const heap_mib = async () => (await long_page.metrics()).JSHeapUsedSize / 2 ** 20;
    const publisher = spawn('/usr/bin/python3', [join(source, 'tests/view/two_days.py'), stored], {stdio: ['ignore', 'ignore', 'inherit']});
    const ended = new Promise((done) => publisher.on('close', done));
    await shows(long_page, 'the first hour', () => Number(document.body.dataset.sequence) > 72_000);
    const first = {view: long_view.memory_mib('VmRSS'), page: await heap_mib()};
    let most = 0;
    const meter = setInterval(async () => { most = Math.max(most, await heap_mib()); }, 1000);
    const code = await ended;
    clearInterval(meter);
    expect(code === 0, `the publisher ended with ${code}`);
    await shows(long_page, 'the last frame', () => Number(document.body.dataset.sequence) === 3_455_999);
    const rows = await long_page.evaluate(() => shown.rows.length);
    expect(rows <= 2000, `${rows} points a series`);
    console.log(`      view ${first.view.toFixed(0)} MiB after an hour, ${long_view.memory_mib('VmRSS').toFixed(0)} after two days, ` +
      `at most ${long_view.memory_mib('VmHWM').toFixed(0)}; page ${first.page.toFixed(0)} MiB, at most ${most.toFixed(0)}`);
    expect(long_view.memory_mib('VmHWM') < first.view + 32, `the view took ${long_view.memory_mib('VmHWM')} MiB`);
    expect(most < first.page + 64, `the page took ${most} MiB`);
    await long_page.close();
    await long_view.end();
  });
}

await check('a view that stops and comes back', async () => {
  const place = new URL(await view.url()).host;
  expect(await view.end() === 0, view.err);
  await shows(follower, 'no view', () => document.getElementById('state').textContent === 'no view');
  const again = new Program('view', '--endpoint', later, '--http', place);
  await shows(follower, 'the view again', () => document.getElementById('state').textContent !== 'no view');
  await again.end();
});

await finish(browser);
