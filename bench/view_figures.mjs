// What the live page and the topic `fold` cost; prints the tables docs/evidence/data/view*.csv.
//
//   scripts/test-view --figures
//
// Takes some seven minutes. Times of processors are those that the kernel counts for a process or a thread.
import {readdirSync, readFileSync} from 'node:fs';
import http from 'node:http';
import {Program, configuration, end_all, new_browser, new_endpoint, open_page, pause, shows, until} from './harness.mjs';

const ticks_a_second = 100;  // USER_HZ: /proc counts in these on every Linux
const window_ms = 10_000;
const scene = {driver: 'simulator', signal_per_pulse: 0.00135, ambient_per_s: 175000};

// Seconds of processor time of a process or of one of its threads, whose folder in /proc this is.
function processor_s(folder) {
  const fields = readFileSync(`${folder}/stat`, 'utf8').replace(/^.*\) /s, '').split(' ');
  return (Number(fields[11]) + Number(fields[12])) / ticks_a_second;
}

// The same of all threads with one of these names.
function threads_s(pid, names) {
  return readdirSync(`/proc/${pid}/task`).map((id) => `/proc/${pid}/task/${id}`)
    .filter((folder) => names.includes(readFileSync(`${folder}/comm`, 'utf8').trim()))
    .reduce((sum, folder) => sum + processor_s(folder), 0);
}

// What a measure grows by, for each second of the window.
async function growth(measure) {
  const before = measure(), began = performance.now();
  await pause(window_ms);
  return (measure() - before) / ((performance.now() - began) / 1e3);
}

// A viewer without a browser, which reads all that it is sent.
function viewer(url) {
  const one = {frames: 0};
  one.request = http.get(`${url}events?seconds=60`, (answer) => {
    answer.on('data', (text) => { one.frames += text.toString().split('event: frame').length - 1; });
    answer.on('error', () => {});
  });
  one.request.on('error', () => {});
  return one;
}

function measurement(endpoint, length_ms, pixels = 1) {
  if (pixels === 1) return new Program('run', '--config', configuration('figures.json', endpoint, scene, {frame: {length_ms}}));
  const columns = Math.sqrt(pixels), direction = (i) => 0.1 * (i - (columns - 1) / 2);
  return new Program('run', '--config', configuration('figures.json', endpoint, {
    driver: 'simulator', ambient_per_s: 200, array: {columns, rows: columns, pitch_deg: 0.1, planes: [
      {motion: 'linear', distance_m: 20, velocity_mps: 1.2, signal_per_pulse: 0.0003, azimuth_deg: [-0.2, 0.2], elevation_deg: [-0.2, 0.2]},
      {motion: 'linear', distance_m: 40, signal_per_pulse: 0.0003}]},
  }, {frame: {length_ms}, scene: {max_speed_mps: 5}, estimator: {tracked: true}, pixels: Array.from({length: pixels}, (_, i) => ({
    input: i + 1, azimuth_deg: direction(i % columns), elevation_deg: -direction(Math.floor(i / columns))}))}));
}

const percent = (share) => `${(100 * share).toFixed(1)} %`;
const milliseconds = (seconds) => `${(1e3 * seconds).toFixed(1)} ms`;
const median = (values) => [...values].sort((one, other) => one - other)[Math.floor(values.length / 2)];

async function cost_of_view() {
  console.log('\n| frames a second | viewers | processor time of splid view | frames a second to each viewer |\n|---|---|---|---|');
  for (const length_ms of [50, 5]) {
    const endpoint = new_endpoint();
    const daemon = measurement(endpoint, length_ms);
    const view = new Program('view', '--endpoint', endpoint, '--http', '127.0.0.1:*');
    const url = await view.url();
    for (const count of [1, 10]) {
      const viewers = Array.from({length: count}, () => viewer(url));
      await until('all viewers have frames', () => viewers.every((one) => one.frames > 3));
      let frames = viewers[0].frames;
      const share = await growth(() => processor_s(`/proc/${view.child.pid}`));
      frames = (viewers[0].frames - frames) / (window_ms / 1e3);
      console.log(`| ${1000 / length_ms} | ${count} | ${percent(share)} of a core | ${frames.toFixed(1)} |`);
      for (const one of viewers) one.request.destroy();
    }
    await view.end();
    await daemon.end();
  }
}

// How much later than a subscriber in a terminal the page has a frame's numbers on it, for each frame.
async function lateness(browser, url, endpoint) {
  const listener = new Program('listen', '--endpoint', endpoint, '--json', 'frame');
  const heard = new Map();
  listener.child.stdout.on('data', (text) => {
    for (const [, sequence] of text.toString().matchAll(/"sequence":(\d+)/g)) heard.set(Number(sequence), Date.now());
  });
  const page = await open_page(browser, url);
  await shows(page, 'frames', () => Number(document.body.dataset.sequence) > 0);
  await page.evaluate(() => {
    window.seen = [];
    new MutationObserver(() => window.seen.push([Number(document.body.dataset.sequence), Date.now()]))
      .observe(document.body, {attributes: true, attributeFilter: ['data-sequence']});
  });
  const drawn = () => page.evaluate(() => Number(document.body.dataset.drawn));
  const before = await drawn(), began = performance.now();
  await pause(window_ms);
  const pictures = (await drawn() - before) / ((performance.now() - began) / 1e3);
  const late = (await page.evaluate(() => window.seen)).filter(([sequence]) => heard.has(sequence))
    .map(([sequence, time_ms]) => time_ms - heard.get(sequence));
  await page.close();
  await listener.end();
  return {late, pictures};
}

async function latency_and_pictures() {
  console.log('\n| frames a second | message to page, median | 95th of 100 | frames compared | charts drawn a second |\n|---|---|---|---|---|');
  const browser = await new_browser();
  for (const length_ms of [50, 5]) {
    const endpoint = new_endpoint();
    const daemon = measurement(endpoint, length_ms);
    const view = new Program('view', '--endpoint', endpoint, '--http', '127.0.0.1:*');
    const {late, pictures} = await lateness(browser, await view.url(), endpoint);
    const sorted = late.sort((one, other) => one - other);
    console.log(`| ${1000 / length_ms} | ${median(sorted)} ms | ${sorted[Math.floor(sorted.length * 0.95)]} ms | ${sorted.length} | ${pictures.toFixed(1)} |`);
    await view.end();
    await daemon.end();
  }
  await browser.close();
}

// A process and all that it started, by the parents that /proc names.
function family(pid) {
  const parents = readdirSync('/proc').filter((id) => /^\d+$/.test(id)).flatMap((id) => {
    try {
      return [[Number(id), Number(readFileSync(`/proc/${id}/stat`, 'utf8').replace(/^.*\) /s, '').split(' ')[1])]];
    } catch (error) { return []; }  // it has just ended
  });
  const all = new Set([pid]);
  for (let before = 0; before !== all.size;) {
    before = all.size;
    for (const [id, parent] of parents) if (all.has(parent)) all.add(id);
  }
  return [...all];
}

// All processes of a browser without a graphics processor, with the page and no other in sight.
async function cost_of_page() {
  console.log('\n| the page shows | frames a second | processor time of the browser | charts drawn a second |\n|---|---|---|---|');
  for (const [words, length_ms, prepare, pixels] of [
    ['the last minute', 50, () => {}],
    ['the last minute', 5, () => {}],
    ['the last ten seconds', 50, () => set_seconds(10)],
    ['the last hour', 50, () => set_seconds(3600)],
    ['the last minute and the photons', 50, () => document.getElementById('photons').click()],
    ['8 x 8 pixels and the last minute', 50, () => {}, 64],
    ['16 x 16 pixels and the last minute', 200, () => {}, 256],
  ]) {
    const endpoint = new_endpoint();
    const daemon = measurement(endpoint, length_ms, pixels);
    const view = new Program('view', '--endpoint', endpoint, '--http', '127.0.0.1:*');
    const browser = await new_browser();
    const page = await open_page(browser, await view.url(), {width: 1440, height: 900});
    for (const other of await browser.pages()) if (other !== page) await other.close();
    await page.evaluate(prepare);
    await shows(page, 'frames', () => Number(document.body.dataset.sequence) > 0);
    await pause(15_000);  // charts have their points then
    const used = () => family(browser.process().pid).reduce((sum, id) => {
      try { return sum + processor_s(`/proc/${id}`); } catch (error) { return sum; }
    }, 0);
    const drawn = () => page.evaluate(() => Number(document.body.dataset.drawn));
    const before = await drawn(), began = performance.now();
    const share = await growth(used);
    const pictures = (await drawn() - before) / ((performance.now() - began) / 1e3);
    console.log(`| ${words} | ${1000 / length_ms} | ${percent(share)} of a core | ${pictures.toFixed(1)} |`);
    await browser.close();
    await view.end();
    await daemon.end();
  }
}

async function size_of_page() {
  const view = new Program('view', '--endpoint', new_endpoint(), '--http', '127.0.0.1:*');
  const url = await view.url();
  let bytes = 0;
  for (const file of ['', 'view.js', 'numbers.js', 'charts.js', 'photons.js', 'field.js', 'view.css', 'icon.svg']) {
    bytes += await new Promise((done) => http.get(url + file, {headers: {'accept-encoding': 'gzip'}}, (answer) => {
      answer.resume();
      done(Number(answer.headers['content-length']));
    }));
  }
  await view.end();
  console.log(`\nThe page and all its files: ${bytes} bytes, compressed.`);
}

// Windows with and without a subscriber in turn, so that what else the machine does meets both alike.
async function cost_of_fold() {
  const endpoint = new_endpoint();
  const daemon = measurement(endpoint, 50);
  const listener = new Program('listen', '--endpoint', endpoint, '--json', 'frame');
  await until('frames come', () => listener.out.length > 0);
  const pid = daemon.child.pid;
  const measures = {whole: () => processor_s(`/proc/${pid}`), fold: () => threads_s(pid, ['fold']),
    others: () => processor_s(`/proc/${pid}`) - threads_s(pid, ['fold'])};
  const found = {on: [], off: []};
  for (let turn = 0; turn < 10; ++turn) {
    const folds = turn % 2 === 0 ? null : new Program('listen', '--endpoint', endpoint, '--json', 'fold');
    if (folds) await until('pictures come', () => folds.out.includes('}\n'));
    else await pause(3000);  // until the last picture for the subscriber before is made
    const before = Object.fromEntries(Object.entries(measures).map(([name, measure]) => [name, measure()]));
    const began = performance.now();
    await pause(window_ms);
    const seconds = (performance.now() - began) / 1e3;
    found[folds ? 'on' : 'off'].push(Object.fromEntries(Object.entries(measures)
      .map(([name, measure]) => [name, (measure() - before[name]) / seconds])));
    await folds?.end();
  }
  await listener.end();
  await daemon.end();
  console.log('\n| of the daemon, for each second: median of 5 windows (least, most) | without a subscriber to `fold` | with one |\n|---|---|---|');
  for (const [name, words] of [['fold', 'thread `fold`'], ['others', 'all other threads'], ['whole', 'whole process']]) {
    const cell = (list) => {
      const values = list.map((one) => one[name]);
      return `${milliseconds(median(values))} (${milliseconds(Math.min(...values))}, ${milliseconds(Math.max(...values))})`;
    };
    console.log(`| ${words} | ${cell(found.off)} | ${cell(found.on)} |`);
  }
}

for (const part of [size_of_page, cost_of_view, cost_of_page, latency_and_pictures, cost_of_fold]) await part();
await end_all();
