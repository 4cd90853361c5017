'use strict';
// The live page of `splid view`. It listens to one stream of server-sent events, shows the values of
// the last frame as they came, and draws the histories that the server thinned. It sends nothing.

// In the order of Series in daemon/view/view_history.hpp.
const SERIES = ['distance', 'velocity', 'reference_distance', 'reference_velocity', 'signal',
  'background', 'sbr', 'drift', 'jitter', 'latency', 'ring', 'count_rate', 'signal_rate'];
// Their names in a table, with units.
const TABLE_NAMES = ['distance_m', 'velocity_mps', 'reference_distance_m', 'reference_velocity_mps',
  'signal_per_pulse', 'background_per_s', 'sbr', 'sync_drift_ppm', 'sync_jitter_ps', 'latency_ms',
  'ring_fill_ratio', 'count_rate_per_s', 'signal_rate_per_s'];
const STATUSES = ['not_run', 'ok', 'no_target', 'ambiguous', 'incomplete', 'no_sync', 'saturated'];
const FIRST_SERIES = 4;  // in a row: number, frames, valid frames, status, then the series
const WINDOWS_S = [10, 30, 60, 300, 900, 3600];

const at = (id) => document.getElementById(id);
const in_words = (name) => String(name).replaceAll('_', ' ');

// valid: the last valid frame; *_ms: when a frame came, by performance.now(). picture: what of these
// is on the page, which is not drawn anew for each frame.
const shown = {seconds: 60, width_s: 0.06, window_s: 60, rows: [], frame: null, frame_ms: 0, valid: null,
  valid_ms: 0, paused: false, held_rows: [], zoom: null, view_is_gone: false, trouble: '', drawn: 0, best: {},
  frame_is_new: false, picture: {}};
let stream = null;
let state_message = null;
let past_ms = 0;  // how old the next frame is
let palette = {};

function put(id, text, value) {
  const element = at(id);
  if (element.textContent !== text) element.textContent = text;
  if (value === undefined) delete element.dataset.value;
  else if (element.dataset.value !== String(value)) element.dataset.value = value;
}

function paint(id, kind) {
  if (at(id).className !== kind) at(id).className = kind;
}

// ---- what the server sends

const pixel_argument = () => (field.pixel ? '&pixel=' + encodeURIComponent(field.pixel) : '');

function listen() {
  if (stream) stream.close();
  stream = new EventSource(`events?seconds=${shown.seconds}${photons.on ? '&fold=1' : ''}${pixel_argument()}`);
  const on = (name, take) => stream.addEventListener(name, (event) => {
    let message;
    try { message = JSON.parse(event.data); } catch (error) { return; }
    take(message);
    schedule();
  });
  on('page', take_page);
  on('version', take_version);
  on('status', take_status);
  on('bins', take_bins);
  on('past', take_past);
  on('frame', take_frame);
  on('fold', take_fold);
  on('layout', take_layout);
  on('picture', take_picture);
  stream.onerror = () => set_gone(true);
  stream.onopen = () => set_gone(false);
}

function set_gone(gone) {
  shown.view_is_gone = gone;
  show_health();
}

function take_page(page) {
  shown.trouble = page.trouble;
  put('endpoint', 'daemon at ' + page.endpoint);
  const refused = page.refused ? `, ${page.refused} requests refused` : '';
  put('viewers', `${page.viewers} ${page.viewers === 1 ? 'viewer' : 'viewers'}${refused}`);
  show_health();
}

function take_version(version) {
  put('pattern', `${version.pattern} (${version.mode})`);
  put('release', 'splid ' + version.release);
}

function take_status(status) {
  state_message = status;
  const uncounted = status.uncounted_losses ? ` + ${whole(status.uncounted_losses)} losses` : '';
  put('lost', whole(status.lost_tags) + uncounted, status.lost_tags);
  paint('lost', Number(status.lost_tags) > 0 || uncounted !== '' ? 'alarm' : 'good');
  put('frames', `${whole(status.frames)}, ${whole(status.valid_frames)} valid`);
  paint('effort', status.effort_is_lowered ? 'alarm' : 'good');
  show_recording(status.recording);
  show_findings(status.findings);
  show_health();
}

// The last frame comes next, and may have come to the server long ago.
function take_past(past) {
  const now = performance.now();
  past_ms = past.frame_age_s * 1e3;
  if (!past.valid) return;
  shown.valid = past.valid;
  shown.valid_ms = now - past.valid_age_s * 1e3;
}

function take_frame(frame) {
  shown.frame_ms = performance.now() - past_ms;
  past_ms = 0;
  shown.frame = frame;
  if (frame.valid) [shown.valid, shown.valid_ms] = [frame, shown.frame_ms];
  shown.frame_is_new = true;
}

// Rows come with the bins that changed: new ones, and the last one again while it fills.
function take_bins(bins) {
  const was_end = shown.rows.length > 0 ? time_of(shown.rows[shown.rows.length - 1]) : Infinity;
  Object.assign(shown, {best: bins.best, width_s: bins.width_s, window_s: bins.window_s});
  if (bins.anew) shown.rows = [];
  for (const row of bins.rows) {
    const last = shown.rows[shown.rows.length - 1];
    if (last && last[0] === row[0]) shown.rows[shown.rows.length - 1] = row;
    else if (!last || last[0] < row[0]) shown.rows.push(row);
  }
  if (shown.rows.length > 0) {
    const first = shown.rows[shown.rows.length - 1][0] - Math.round(bins.window_s / bins.width_s);
    let old = 0;
    while (shown.rows[old][0] <= first) ++old;
    if (old > 0) shown.rows.splice(0, old);
  }
  // A zoom shows no more when more has come after it.
  if (!shown.paused && (bins.anew || !shown.zoom || shown.zoom[1] >= was_end)) mark(bins.anew);
}

const time_of = (row) => row[0] * shown.width_s * 1e3;
const shown_rows = () => (shown.paused ? shown.held_rows : shown.rows);

function date_window() {
  if (shown.zoom) return shown.zoom;
  const rows = shown_rows();
  const end = rows.length > 0 ? time_of(rows[rows.length - 1]) + shown.width_s * 1e3 : Date.now();
  return [end - shown.window_s * 1e3, end];
}

// ---- how the measurement is

// {words, kind, reason}: as protocol/status_json.hpp has the headline. kind: its colour.
function health() {
  if (shown.view_is_gone) {
    return {words: 'no view', kind: 'bad', reason: 'The server of this page does not answer. Start splid view again; this page connects by itself.'};
  }
  if (shown.trouble) return {words: 'no connection', kind: 'bad', reason: shown.trouble};
  if (!state_message) return {words: 'connecting', kind: 'wait', reason: 'Waiting for the first status.'};
  const {state, measurement, reason} = state_message;
  if (state !== 'streaming' && state !== 'degraded') return {words: in_words(state), kind: 'wait', reason};
  if (measurement !== 'ok') return {words: in_words(measurement), kind: measurement, reason};
  return state === 'degraded' ? {words: 'ok, degraded', kind: 'wait', reason} : {words: 'ok', kind: 'good', reason};
}

const is_cut_off = () => shown.view_is_gone || shown.trouble !== '';

function show_health() {
  const {words, kind, reason} = health();
  paint('state', 'pill ' + kind);
  put('state', words);
  put('reason', reason || '');
  document.body.classList.toggle('old', is_cut_off());
  show_device();
  show_values();
}

// What the daemon said of it last is no news while the daemon cannot be reached.
function show_device() {
  if (!state_message) return;
  const {device, device_name: name} = state_message;
  const words = in_words(device) + (name ? ': ' + name : '');
  put('device', is_cut_off() ? 'last heard: ' + words : words);
  paint('device', is_cut_off() ? '' : device === 'connected' ? 'good' : 'alarm');
  put('stream', is_cut_off() ? '–' : in_words(state_message.state));
}

// What the last frames show beyond the configured model, each finding with what to do about it.
function show_findings(findings) {
  const list = Array.isArray(findings) ? findings : [];
  at('findings-panel').hidden = list.length === 0;
  const words = list.map((finding) => [words_of([finding]), String(finding.advice)]);
  const key = JSON.stringify(words);
  if (at('findings').dataset.key === key) return;
  at('findings').dataset.key = key;
  at('findings').replaceChildren(...words.map(([what, advice]) => {
    const item = document.createElement('li');
    item.appendChild(document.createElement('strong')).textContent = what;
    item.append(' ' + advice);
    return item;
  }));
}

// The file by its name, and the whole path where somebody points at it.
function show_recording(recording) {
  const state = recording ? recording.state : 'off';
  const file = recording && recording.file ? recording.file : '';
  const words = {off: 'off', waiting: 'waits for the first tag', failing: 'fails'};
  const size = file ? `${file.slice(file.lastIndexOf('/') + 1)}, ${in_one(recording.bytes, undefined, 'B')}, ${duration_text(recording.seconds)}` : '';
  put('recording', state === 'writing' ? size : words[state] || String(state), file || undefined);
  if (at('recording').title !== file) at('recording').title = file;
  paint('recording', {writing: 'rolling', failing: 'alarm'}[state] || '');
}

// ---- the last frame

function show_frame(frame) {
  put('significance', nats(frame.significance), frame.significance);
  put('odds', is_number(frame.range_odds_nats) ? `range odds ${nats(frame.range_odds_nats)} nats` : '');
  put('frame-status', in_words(frame.status), frame.status);
  paint('frame-status', 'pill ' + (frame.status === 'ok' ? 'good' : frame.status));
  const found = words_of(frame.findings);
  put('frame-note', `${found ? found + ', ' : ''}${whole(frame.photons)} photons`, frame.photons);
  put('effort', frame.effort || '–');
  put('clock', clock(frame.timestamp * 1e3));
  document.body.dataset.sequence = frame.sequence;
  show_alignment(frame, frame.sync || {});
  show_targets(frame.targets);
}

// Values of this age are old: some frames should have come since.
const is_old = (age_ms, frame) => age_ms > Math.max(1500, 4 * frame.duration_ms);

// Why the values that are shown do not hold, in a word or two; empty: they hold. They are the frame's
// own where it has any, and otherwise those of the last valid frame.
function doubt(frame, age_ms) {
  const {words, kind} = health();
  if (is_cut_off()) return words;
  if (frame && !frame.valid) return in_words(frame.status);
  if (frame && is_old(age_ms, frame)) return kind === 'good' ? 'old' : words;
  return frame && frame.status === 'ambiguous' ? 'ambiguous' : '';
}

function show_values() {
  const {frame, frame_ms, valid, valid_ms} = shown.picture;
  const age_ms = performance.now() - valid_ms;
  show_age(valid, age_ms);
  const why = doubt(frame, performance.now() - frame_ms);
  for (const [id, name, unit, places] of [['distance', 'distance_m', 'm', 4], ['velocity', 'velocity_mps', 'm/s', 3]]) {
    const own = frame && is_number(frame[name]);
    const from = own ? frame : valid || {};
    const std = (from.std || {})[name];
    const {text, spread} = written(from[name], std, unit, places);
    put(id, text, own ? from[name] : undefined);
    const age = !own && valid ? `, ${time_words(age_ms / 1e3)} old` : '';
    put(id + '-std', [why + age, spread && `${spread} ${unit}`].filter((part) => part !== '').join(', '), own ? std : undefined);
    paint(id + '-tile', 'tile wide ' + (why === '' ? '' : why === 'ambiguous' ? 'unsure' : 'doubtful'));
  }
}

function show_age(valid, age_ms) {
  put('age', !valid ? 'none yet' : is_old(age_ms, valid) ? `${time_words(age_ms / 1e3)} ago` : 'now');
  paint('age', !valid || is_old(age_ms, valid) ? 'alarm' : 'good');
}

function show_title() {
  const {words} = health();
  const distance = shown.frame && words === 'ok' ? in_one(shown.frame.distance_m, (shown.frame.std || {}).distance_m, 'm', 4) : '';
  const title = [words, distance, 'splid'].filter((part) => part !== '').join(' · ');
  if (document.title !== title) document.title = title;
}

function show_alignment(frame, sync) {
  const seen_s = frame.duration_ms / 1e3 * (frame.seen_fraction === undefined ? 1 : frame.seen_fraction);
  const counts = is_number(frame.photons) && seen_s > 0 ? frame.photons / seen_s : undefined;
  const signal = frame.valid && sync.period_ps > 0 ? frame.signal_per_period / (sync.period_ps * 1e-12) : undefined;
  show_beside_best('count-rate', counts, shown.best.count_rate, 'counts/s');
  show_beside_best('signal-rate', signal, shown.best.signal_rate, 'counts/s');
  show_beside_best('sbr', frame.valid ? frame.sbr : undefined, shown.best.sbr, '');
}

function show_beside_best(id, value, best, unit) {
  const {text, unit: prefixed} = written(value, undefined, unit);
  put(id, text, is_number(value) ? value : undefined);
  put(id + '-unit', prefixed);
  put(id + '-best', in_one(best, undefined, unit), is_number(best) ? best : undefined);
  const share = is_number(value) && best > 0 ? Math.min(value / best, 1) : 0;
  const scale = `scaleX(${share.toFixed(3)})`;
  if (at(id + '-bar').style.transform !== scale) at(id + '-bar').style.transform = scale;
}

// "acceleration -12.30 ± 0.80 m/s²", several separated by commas.
const words_of = (findings) => (findings || []).map(({name, value, std, unit}) => {
  const {text, spread} = written(value, std, 'of a finding', undefined);
  return `${in_words(name)} ${text} ${spread}` + (unit ? ' ' + unit.replace(/s2$/, 's²').replace(/s3$/, 's³') : '');
}).join(', ');

// The columns of the table of targets: a heading, and the text of a target's cell.
const TARGET_COLUMNS = [
  ['target', (target, i) => String(i + 1)],
  ['status', (target) => in_words(target.status)],
  ['distance', (target, i, std) => in_one(target.distance_m, std.distance_m, 'm', 4)],
  ['velocity', (target, i, std) => in_one(target.velocity_mps, std.velocity_mps, 'm/s', 3)],
  ['signal', (target, i, std) => in_one(target.signal_per_pulse, std.signal_per_pulse, 'counts/pulse')],
  ['significance, nats', (target) => nats(target.significance)],
  ['range odds, nats', (target) => nats(target.range_odds_nats)],
  ['findings', (target) => words_of(target.findings) || '–'],
];

function table_row(cells, kind) {
  const line = document.createElement('tr');
  for (const cell of cells) line.appendChild(document.createElement(kind)).textContent = cell;
  return line;
}

// Several returns, the strongest first. A frame that looked for several and found none has an empty
// table, so that the page does not jump.
function show_targets(targets) {
  at('targets-panel').hidden = !Array.isArray(targets);
  if (!Array.isArray(targets)) return;
  put('targets-note', targets.length === 0 ? 'none in this frame' : '');
  at('targets').replaceChildren(...targets.map((target, i) => table_row(
    TARGET_COLUMNS.map(([, text]) => text(target, i, target.std || {})), 'td')));
}

// ---- at most ten pictures a second, and none while nothing comes

const between_pictures_ms = 100;
let last_picture_ms = -between_pictures_ms, is_scheduled = false;

function schedule() {
  if (is_scheduled) return;
  is_scheduled = true;
  const wait_ms = clamp(last_picture_ms + between_pictures_ms - performance.now(), 0, between_pictures_ms);
  setTimeout(() => requestAnimationFrame(draw_picture), wait_ms);
}

function draw_picture() {
  is_scheduled = false;
  last_picture_ms = performance.now();
  if (shown.frame_is_new && !shown.paused) {
    const {frame, frame_ms, valid, valid_ms} = shown;
    Object.assign(shown, {frame_is_new: false, picture: {frame, frame_ms, valid, valid_ms}});
    show_frame(frame);
    show_values();
  }
  if (field.is_new && !shown.paused) draw_field();
  sing();
  if (draw_charts()) schedule();
}

// Ages go on while nothing comes.
setInterval(() => { show_values(); show_title(); }, 1000);

// ---- the tone: an octave for each factor of ten of the signal rate, 440 Hz at 1,000 counts/s

let tone = null;
function toggle_tone() {
  if (tone) {
    tone.context.close();
    tone = null;
  } else {
    const context = new AudioContext();
    const oscillator = context.createOscillator();
    const gain = context.createGain();
    gain.gain.value = 0;
    oscillator.connect(gain).connect(context.destination);
    oscillator.start();
    tone = {context, oscillator, gain};
  }
  at('tone').setAttribute('aria-pressed', String(tone !== null));
}

function sing() {
  if (!tone) return;
  const signal = Number(at('signal-rate').dataset.value);
  const now = tone.context.currentTime;
  tone.gain.gain.setTargetAtTime(signal > 0 ? 0.08 : 0, now, 0.03);
  if (!(signal > 0)) return;
  const hertz = clamp(55 * 2 ** Math.log10(signal), 55, 3520);
  tone.oscillator.frequency.setTargetAtTime(hertz, now, 0.03);
}

// ---- what people press; the address keeps what is open

function keep_in_address() {
  const address = new URLSearchParams({seconds: shown.seconds});
  if (photons.on) address.set('photons', '1');
  if (field.pixel) address.set('pixel', field.pixel);
  if (document.body.classList.contains('aligning')) address.set('align', '1');
  history.replaceState(null, '', '#' + address);
}

function set_seconds(seconds) {
  shown.seconds = seconds;
  for (const button of at('windows').children) {
    button.setAttribute('aria-pressed', String(Number(button.dataset.seconds) === seconds));
  }
  if (shown.paused) toggle_pause();
  set_zoom(null);
  keep_in_address();
  listen();
}

function toggle_pause() {
  shown.paused = !shown.paused;
  if (shown.paused) shown.held_rows = shown.rows.slice();
  at('pause').setAttribute('aria-pressed', String(shown.paused));
  put('pause', shown.paused ? 'Go on' : 'Pause');
  mark(true);
}

// What the charts show, as they show it: the rows within the zoom.
function table() {
  const [from, to] = date_window();
  const head = ['time_utc', 'frames', 'valid_frames', 'status'];
  for (const name of TABLE_NAMES) {
    const [, stem, unit] = /^(.*?)(_(?:m|mps|per_pulse|per_s|ppm|ps|ms|ratio))?$/.exec(name);
    head.push(name, `${stem}_low${unit || ''}`, `${stem}_high${unit || ''}`);
  }
  const lines = [head.join(',')];
  for (const row of shown_rows()) {
    const time = time_of(row);
    if (time < from || time > to) continue;
    const cells = [new Date(time).toISOString(), row[1], row[2], STATUSES[row[3]]];
    for (let i = FIRST_SERIES; i < row.length; ++i) {
      const value = reach(row[i], 1);
      cells.push(...(value ? [value[1], value[0], value[2]] : ['', '', '']));
    }
    lines.push(cells.join(','));
  }
  return lines.join('\n') + '\n';
}

// The frames themselves, as long as the server keeps them, and otherwise the means of the charts.
async function save_table() {
  const [from, to] = date_window();
  const answer = await fetch(`frames.csv?from=${(from / 1e3).toFixed(3)}&to=${(to / 1e3).toFixed(3)}${pixel_argument()}`).catch(() => null);
  const has_frames = answer !== null && answer.status === 200;
  const text = has_frames ? await answer.text() : table();
  const link = document.createElement('a');
  link.href = URL.createObjectURL(new Blob([text], {type: 'text/csv'}));
  link.download = `splid-${has_frames ? 'frames' : 'means'}-${new Date().toISOString().slice(0, 19).replaceAll(':', '')}.csv`;
  link.click();
  setTimeout(() => URL.revokeObjectURL(link.href), 1000);
}

function set_theme(name) {
  document.documentElement.dataset.theme = name;
  const style = getComputedStyle(document.documentElement);
  palette = {};
  for (const colour of [...SERIES, ...STATUSES, 'reference', 'line', 'muted']) palette[colour] = style.getPropertyValue('--' + colour).trim();
  mark(true);
  draw_photons();
  draw_field();
}

function toggle_aligning() {
  const on = document.body.classList.toggle('aligning');
  at('bigger').setAttribute('aria-pressed', String(on));
  draw_field();
  keep_in_address();
}

function on_key(event) {
  if (event.ctrlKey || event.metaKey || event.altKey) return;
  const on_button = event.target instanceof HTMLButtonElement;
  if (event.key === ' ' && !on_button) toggle_pause();
  else if (event.key === 'Escape') set_zoom(null);
  else if (event.key === 'a') toggle_aligning();
  else return;
  event.preventDefault();
}

function start() {
  const dark = matchMedia('(prefers-color-scheme: dark)');
  dark.addEventListener('change', () => set_theme(dark.matches ? 'dark' : 'light'));
  charts.forEach(make_chart);
  set_theme(dark.matches ? 'dark' : 'light');
  at('targets-head').appendChild(table_row(TARGET_COLUMNS.map(([heading]) => heading), 'th'));
  for (const button of at('windows').children) {
    button.addEventListener('click', () => set_seconds(Number(button.dataset.seconds)));
  }
  at('pause').addEventListener('click', toggle_pause);
  at('whole').addEventListener('click', () => set_zoom(null));
  at('csv').addEventListener('click', save_table);
  at('tone').addEventListener('click', toggle_tone);
  at('bigger').addEventListener('click', toggle_aligning);
  at('theme').addEventListener('click', () =>
    set_theme(document.documentElement.dataset.theme === 'dark' ? 'light' : 'dark'));
  start_photons();
  start_field();
  document.addEventListener('keydown', on_key);
  const address = new URLSearchParams(location.hash.slice(1));
  field.pixel = address.get('pixel') || '';
  if (address.get('photons') === '1') open_photons();
  if (address.get('align') === '1') toggle_aligning();
  const seconds = Number(address.get('seconds'));
  set_seconds(WINDOWS_S.includes(seconds) ? seconds : 60);
}

start();
