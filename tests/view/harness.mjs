// What the checks of the live page share: programs that run, a browser, and waiting for conditions.
import {spawn, execFileSync} from 'node:child_process';
import {mkdtempSync, readFileSync, rmSync, writeFileSync} from 'node:fs';
import {tmpdir} from 'node:os';
import {join} from 'node:path';
import puppeteer from 'puppeteer-core';

export const splid = process.env.SPLID;
export const source = process.env.SPLID_SOURCE;
export const folder = mkdtempSync(join(tmpdir(), 'splid-view-'));

const patience_ms = 120_000;
export const pause = (milliseconds) => new Promise((done) => setTimeout(done, milliseconds));

// Asks until the answer is true, or as good as true, and returns it. what: for the error.
export async function until(what, condition) {
  const end = Date.now() + patience_ms;
  for (;;) {
    const answer = await condition();
    if (answer) return answer;
    if (Date.now() > end) throw new Error(`waited in vain until ${what}`);
    await pause(50);
  }
}

// A run of a program, of splid where none is named, ended at the latest when the checks are over.
export class Program {
  static all = new Set();
  static of(program, ...words) { return new Program(...words, {program}); }
  constructor(...words) {
    const program = typeof words.at(-1) === 'object' ? words.pop().program : splid;
    this.words = words;
    this.out = '';
    this.err = '';
    this.child = spawn(program, words, {stdio: ['ignore', 'pipe', 'pipe']});
    this.child.stdout.on('data', (text) => { this.out += text; });
    this.child.stderr.on('data', (text) => { this.err += text; });
    this.ended = new Promise((done) => this.child.on('close', (code) => { this.code = code; done(code); }));
    Program.all.add(this);
  }
  async end(signal = 'SIGTERM') {
    Program.all.delete(this);
    this.child.kill(signal);
    return this.ended;
  }
  // Of /proc/PID/status, in MiB.
  memory_mib(member) {
    const text = readFileSync(`/proc/${this.child.pid}/status`, 'utf8');
    return Number(new RegExp(`${member}:\\s+(\\d+) kB`).exec(text)[1]) / 1024;
  }
  // The address that the program says it serves a page at.
  async url() {
    const address = /http:\/\/127\.0\.0\.1:\d+\//;
    return until(`${this.words[0]} says where the page is`, () => {
      if (this.code !== undefined) throw new Error(`splid ${this.words.join(' ')}: ${this.err}`);
      return address.exec(this.err)?.[0];
    });
  }
}

let endpoints = 0;
export const new_endpoint = () => `ipc://${join(folder, `socket-${++endpoints}`)}`;

// A configuration with this source and endpoint; returns its file.
export function configuration(name, endpoint, scene, more = {}) {
  const file = join(folder, name);
  writeFileSync(file, JSON.stringify({
    schema: 'splid.config', v: [1, 0], source: scene,
    pattern: {file: join(source, 'config/patterns/interleaved-180-189.json')}, publish: {endpoint}, control: {endpoint: 'off'}, ...more,
  }));
  return file;
}

export function run_to_end(...words) {
  return execFileSync(splid, words, {stdio: ['ignore', 'pipe', 'ignore']}).toString();
}

export function new_browser() {
  return puppeteer.launch({
    executablePath: process.env.CHROMIUM, headless: true, timeout: patience_ms, protocolTimeout: 2 * patience_ms,
    args: ['--no-sandbox', '--disable-dev-shm-usage', '--disable-gpu', '--mute-audio', '--no-first-run'],
  });
}

// A page of the live view, with what went wrong on it in `page.faults`.
export async function open_page(browser, url, {width = 1280, height = 800, dark = false} = {}) {
  const page = await browser.newPage();
  page.faults = [];
  page.elsewhere = [];
  page.on('console', (message) => { if (['error', 'warn', 'warning'].includes(message.type())) page.faults.push(message.text()); });
  page.on('pageerror', (error) => page.faults.push(String(error)));
  page.on('request', (request) => {
    if (!request.url().startsWith(url) && !/^(data|blob):/.test(request.url())) page.elsewhere.push(request.url());
  });
  await page.setViewport({width, height});
  await page.emulateMediaFeatures([{name: 'prefers-color-scheme', value: dark ? 'dark' : 'light'}]);
  await page.goto(url, {waitUntil: 'domcontentloaded', timeout: patience_ms});
  return page;
}

export const text_of = (page, id) => page.$eval(`#${id}`, (element) => element.textContent);
export const value_of = (page, id) => page.$eval(`#${id}`, (element) => element.dataset.value);
export const shows = (page, what, condition, ...more) =>
  until(what, () => page.evaluate(condition, ...more));

export function expect(holds, what) { if (!holds) throw new Error(what); }

let failed = 0;
let passed = 0;
export async function check(name, run) {
  const began = Date.now();
  try {
    await run();
    ++passed;
    console.log(`ok    ${name}, ${((Date.now() - began) / 1e3).toFixed(1)} s`);
  } catch (error) {
    ++failed;
    console.log(`FAIL  ${name}: ${error.stack || error}`);
  }
}

// Ends every program and leaves no file behind.
export async function end_all() {
  await Promise.all([...Program.all].map((program) => program.end('SIGKILL')));
  rmSync(folder, {recursive: true, force: true});
}

export async function finish(browser) {
  await browser?.close();
  await end_all();
  console.log(`${passed} checks held, ${failed} did not`);
  process.exit(failed === 0 && passed > 0 ? 0 : 1);
}
