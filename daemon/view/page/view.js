'use strict';
// The live page of `splid view`. It listens to one stream of server-sent events, shows the values of
// the last frame as they came, and draws the histories that the server thinned. It sends nothing.

// In the order of Series in daemon/view/view_history.hpp.
const SERIES = ['distance', 'velocity', 'reference_distance', 'reference_velocity', 'signal',
  'background', 'sbr', 'drift', 'jitter', 'latency', 'ring', 'count_rate', 'signal_rate'];
const STATUSES = ['not_run', 'ok', 'no_target', 'ambiguous', 'incomplete', 'no_sync', 'saturated'];
const FIRST_SERIES = 4;  // in a row: number, frames, valid frames, status, then the series

const CHARTS = [
  {title: 'Distance', unit: 'm', digits: 5, main: true, series: ['distance', 'reference_distance']},
  {title: 'Velocity', unit: 'm/s', digits: 4, main: true, series: ['velocity', 'reference_velocity']},
  {title: 'Signal', unit: 'counts/pulse', digits: 3, significant: true, series: ['signal']},
  {title: 'Background', unit: 'counts/s', digits: 4, significant: true, series: ['background']},
  {title: 'Signal over background', unit: '', digits: 3, significant: true, series: ['sbr']},
  {title: 'Sync drift', unit: 'ppm', digits: 4, series: ['drift']},
  {title: 'Sync jitter', unit: 'ps', digits: 2, series: ['jitter']},
  {title: 'Latency', unit: 'ms', digits: 2, series: ['latency']},
  {title: 'Ring fill', unit: '%', digits: 1, series: ['ring'], factor: 100, floor: [0, 1]},
];
const COLOURS = {reference_distance: 'reference', reference_velocity: 'reference'};

const at = (id) => document.getElementById(id);
const is_number = (value) => typeof value === 'number' && Number.isFinite(value);

// ---- numbers for people

function fixed(value, digits) {
  return is_number(value) ? value.toFixed(Math.min(Math.max(digits, 0), 12)) : '–';
}

// Groups of three digits; small numbers with three significant digits.
function rate(value) {
  if (!is_number(value)) return '–';
  if (Math.abs(value) >= 1000) return Math.round(value).toLocaleString('en');
  return String(Number(value.toPrecision(3)));
}

// As many decimals as one more than the deviation speaks for.
function decimals(deviation, otherwise) {
  if (!is_number(deviation) || deviation <= 0) return otherwise;
  return Math.min(Math.max(1 - Math.floor(Math.log10(deviation)), 0), 9);
}

// "0.57 mm": a deviation in the unit of the thousand that it is in.
function small(value, unit) {
  if (!is_number(value)) return '';
  const [factor, prefix] = value < 1e-3 ? [1e6, 'µ'] : value < 1 ? [1e3, 'm'] : [1, ''];
  return `± ${Number((value * factor).toPrecision(3))} ${prefix}${unit}`;
}

function bytes_text(bytes) {
  if (!is_number(bytes)) return '–';
  const power = Math.min(Math.max(Math.floor(Math.log10(Math.max(bytes, 1)) / 3), 0), 4);
  return `${Number((bytes / 1e3 ** power).toPrecision(3))} ${['B', 'kB', 'MB', 'GB', 'TB'][power]}`;
}

function duration_text(seconds) {
  if (!is_number(seconds)) return '–';
  const whole = Math.floor(seconds);
  const two = (number) => String(number).padStart(2, '0');
  return `${Math.floor(whole / 3600)}:${two(Math.floor(whole / 60) % 60)}:${two(whole % 60)}`;
}

function clock(milliseconds) {
  const date = new Date(milliseconds);
  return date.toLocaleTimeString('en-GB') + '.' + String(date.getMilliseconds()).padStart(3, '0');
}

// ---- what the server sends

const shown = {seconds: 60, width_s: 0.06, window_s: 60, rows: [], frame: null, paused: false,
  zoom: null, trouble: '', drawn: 0, best: {}};
let stream = null;
let state_message = null;

function put(id, text, value) {
  const element = at(id);
  if (element.textContent !== text) element.textContent = text;
  if (value === undefined) delete element.dataset.value;
  else element.dataset.value = value;
}

function listen() {
  if (stream) stream.close();
  stream = new EventSource(`events?seconds=${shown.seconds}${photons.on ? '&fold=1' : ''}`);
  const on = (name, take) => stream.addEventListener(name, (event) => {
    let message;
    try { message = JSON.parse(event.data); } catch (error) { return; }
    take(message, event.data);
  });
  on('page', take_page);
  on('version', take_version);
  on('status', take_status);
  on('bins', take_bins);
  on('frame', take_frame);
  on('fold', take_fold);
  stream.onerror = () => {
    show_state('bad', 'no view', 'The server of this page does not answer. Start splid view again; this page connects by itself.');
    document.body.classList.add('old');
  };
  stream.onopen = () => document.body.classList.toggle('old', shown.trouble !== '');
}

function show_state(kind, state, reason) {
  at('state').className = 'pill ' + kind;
  put('state', state);
  put('reason', reason);
}

function show_health() {
  if (shown.trouble) return show_state('bad', 'no connection', shown.trouble);
  if (!state_message) return show_state('wait', 'connecting', 'Waiting for the first status.');
  const kinds = {streaming: 'good', degraded: 'bad'};
  show_state(kinds[state_message.state] || 'wait', String(state_message.state).replaceAll('_', ' '),
    state_message.reason || '');
}

function take_page(page) {
  shown.trouble = page.trouble;
  document.body.classList.toggle('old', page.trouble !== '');
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
  const name = status.device_name ? ': ' + status.device_name : '';
  put('device', String(status.device).replaceAll('_', ' ') + name);
  at('device').className = status.device === 'connected' ? 'good' : 'alarm';
  const uncounted = status.uncounted_losses ? ` + ${status.uncounted_losses} losses` : '';
  put('lost', Number(status.lost_tags).toLocaleString('en') + uncounted, status.lost_tags);
  at('lost').className = Number(status.lost_tags) > 0 || uncounted !== '' ? 'alarm' : 'good';
  put('frames', `${Number(status.frames).toLocaleString('en')}, ${Number(status.valid_frames).toLocaleString('en')} valid`);
  at('effort').className = status.effort_is_lowered ? 'alarm' : 'good';
  put('measurement', String(status.measurement || '–').replaceAll('_', ' '), status.measurement);
  at('measurement').className = status.measurement === 'ok' ? 'good' : 'alarm';
  show_recording(status.recording);
  show_findings(status.findings);
  show_health();
}

// What the last frames show beyond the configured model, each finding with what to do about it.
function show_findings(findings) {
  const list = Array.isArray(findings) ? findings : [];
  at('findings-panel').hidden = list.length === 0;
  at('findings').replaceChildren(...list.map((finding) => {
    const item = document.createElement('li');
    item.appendChild(document.createElement('strong')).textContent = words_of([finding]);
    item.append(' ' + finding.advice);
    return item;
  }));
}

// The file by its name, and the whole path where somebody points at it.
function show_recording(recording) {
  const state = recording ? recording.state : 'off';
  const file = recording && recording.file ? recording.file : '';
  const name = file.slice(file.lastIndexOf('/') + 1);
  const words = {off: 'off', waiting: 'waits for the first tag', failing: 'fails'};
  const size = file ? `${name}, ${bytes_text(recording.bytes)}, ${duration_text(recording.seconds)}` : '';
  put('recording', state === 'writing' ? size : words[state] || String(state), file || undefined);
  at('recording').title = file;
  at('recording').className = {writing: 'rolling', failing: 'alarm'}[state] || '';
}

function take_frame(frame) {
  shown.frame = frame;
  if (!shown.paused) show_frame(frame);
  sing(frame);
}

function show_frame(frame) {
  const std = frame.std || {};
  const sync = frame.sync || {};
  put('distance', fixed(frame.distance_m, decimals(std.distance_m, 4)), frame.distance_m);
  put('distance-std', small(std.distance_m, 'm'), std.distance_m);
  put('velocity', fixed(frame.velocity_mps, decimals(std.velocity_mps, 3)), frame.velocity_mps);
  put('velocity-std', small(std.velocity_mps, 'm/s'), std.velocity_mps);
  put('significance', is_number(frame.significance) ? frame.significance.toFixed(1) : '–', frame.significance);
  put('odds', is_number(frame.range_odds_nats) ? `range odds ${frame.range_odds_nats.toFixed(1)} nats` : '');
  put('frame-status', String(frame.status).replaceAll('_', ' '), frame.status);
  at('frame-status').className = 'pill ' + (frame.status === 'ok' ? 'good' : frame.valid ? 'wait' : 'bad');
  const found = words_of(frame.findings);
  put('frame-note', `${found ? found + ', ' : ''}${rate(frame.photons)} photons`, frame.photons);
  put('effort', frame.effort || '–');
  put('clock', clock(frame.timestamp * 1e3));
  document.body.dataset.sequence = frame.sequence;
  show_alignment(frame, sync);
  show_targets(frame.targets);
}

function show_alignment(frame, sync) {
  const seen_s = frame.duration_ms / 1e3 * (frame.seen_fraction === undefined ? 1 : frame.seen_fraction);
  const counts = is_number(frame.photons) && seen_s > 0 ? frame.photons / seen_s : undefined;
  const signal = frame.valid && sync.period_ps > 0 ? frame.signal_per_period / (sync.period_ps * 1e-12) : undefined;
  show_beside_best('count-rate', counts, shown.best.count_rate);
  show_beside_best('signal-rate', signal, shown.best.signal_rate);
  show_beside_best('sbr', frame.valid ? frame.sbr : undefined, shown.best.sbr);
}

function show_beside_best(id, value, best) {
  put(id, rate(value), is_number(value) ? value : undefined);
  put(id + '-best', rate(best), is_number(best) ? best : undefined);
  const share = is_number(value) && best > 0 ? Math.min(value / best, 1) : 0;
  at(id + '-bar').style.transform = `scaleX(${share})`;
}

// "acceleration -12.3 ± 0.8 m/s²", several separated by commas.
const to_digits = (value, digits) => (is_number(value) ? String(Number(value.toPrecision(digits))) : '–');
const words_of = (findings) => (findings || []).map(({name, value, std, unit}) =>
  `${String(name).replaceAll('_', ' ')} ${to_digits(value, 3)} ± ${to_digits(std, 2)}` +
  (unit ? ' ' + unit.replace(/s2$/, 's²').replace(/s3$/, 's³') : '')).join(', ');

// The columns of the table of targets: a heading with its unit, and the text of a target's cell.
const with_deviation = (value, deviation, otherwise) =>
  fixed(value, decimals(deviation, otherwise)) + (is_number(deviation) ? ` ± ${Number(deviation.toPrecision(2))}` : '');
const TARGET_COLUMNS = [
  ['target', (target, i) => String(i + 1)],
  ['status', (target) => String(target.status).replaceAll('_', ' ')],
  ['distance, m', (target, i, std) => with_deviation(target.distance_m, std.distance_m, 4)],
  ['velocity, m/s', (target, i, std) => with_deviation(target.velocity_mps, std.velocity_mps, 3)],
  ['signal, counts/pulse', (target, i, std) => is_number(target.signal_per_pulse)
    ? String(Number(target.signal_per_pulse.toPrecision(3))) + (is_number(std.signal_per_pulse) ? ` ± ${Number(std.signal_per_pulse.toPrecision(2))}` : '')
    : '–'],
  ['significance, nats', (target) => fixed(target.significance, 1)],
  ['range odds, nats', (target) => fixed(target.range_odds_nats, 1)],
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

// ---- histories

// Rows come with the bins that changed: new ones, and the last one again while it fills.
function take_bins(bins) {
  shown.best = bins.best;
  shown.width_s = bins.width_s;
  shown.window_s = bins.window_s;
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
  if (!shown.paused) for (const chart of charts) chart.stale = true;
}

const time_of = (row) => row[0] * shown.width_s * 1e3;

// Longer than this between two rows is a gap, which no line bridges.
function gap_ms() {
  const frame_ms = shown.frame ? shown.frame.duration_ms : 50;
  return Math.max(2.5 * shown.width_s * 1e3, 2.5 * frame_ms);
}

const nothing = [null, null, null];
function reach(cell, factor) {
  if (cell === 0 || cell === undefined) return nothing;
  if (cell.length === 1) return [cell[0] * factor, cell[0] * factor, cell[0] * factor];
  return [cell[0] * factor, cell[1] * factor, cell[2] * factor];
}

function points_of(chart) {
  const columns = chart.series.map((name) => FIRST_SERIES + SERIES.indexOf(name));
  const factor = chart.factor || 1;
  const points = [];
  const gap = gap_ms();
  let before = null;
  for (const row of shown.rows) {
    const time = time_of(row);
    if (before !== null && time - before > gap) points.push([before + 1, ...columns.map(() => nothing)]);
    points.push([time, ...columns.map((column) => reach(row[column], factor))]);
    before = time;
  }
  if (points.length === 0) points.push([Date.now(), ...columns.map(() => nothing)]);
  return points;
}

// ---- charts

const style_value = (name) => getComputedStyle(document.documentElement).getPropertyValue('--' + name).trim();
const charts = CHARTS.map((chart) => ({...chart, stale: true, visible: true, graph: null, readout: null}));
let palette = {};

function read_palette() {
  palette = {};
  for (const name of [...SERIES, ...STATUSES, 'reference', 'line', 'muted']) palette[name] = style_value(name);
}

const colours_of = (chart) => chart.series.map((name) => palette[COLOURS[name] || name]);

// Bars of the colour of a status behind frames that are not valid, as high as the chart where no
// frame of the bin is, and a strip at the bottom where only some are not.
function draw_invalid(canvas, area, graph) {
  const [from, to] = graph.xAxisRange();
  const least_ms = shown.frame ? shown.frame.duration_ms : 50;
  for (const row of shown_rows()) {
    const [, frames, valid, status] = row;
    if (status === 1 || time_of(row) < from - least_ms || time_of(row) > to) continue;
    const left = Math.max(graph.toDomXCoord(time_of(row)), area.x);
    const right = Math.min(graph.toDomXCoord(time_of(row) + Math.max(shown.width_s * 1e3, least_ms)), area.x + area.w);
    const whole = valid === 0;
    canvas.globalAlpha = whole ? 0.32 : 0.9;
    canvas.fillStyle = palette[STATUSES[status]] || palette.muted;
    const height = whole ? area.h : Math.max(3, area.h * 0.04 * (frames > valid ? 1.5 : 1));
    canvas.fillRect(left, area.y + area.h - height, Math.max(right - left, 1), height);
  }
  canvas.globalAlpha = 1;
}

let held_rows = [];
const shown_rows = () => (shown.paused ? held_rows : shown.rows);

function axis_text(value, granularity, options, graph) {
  const [low, high] = graph.yAxisRange();
  const span = Math.abs(high - low);
  if (Math.max(Math.abs(low), Math.abs(high)) < 0.01) return value === 0 ? '0' : value.toExponential(1);
  if (Math.max(Math.abs(low), Math.abs(high)) >= 1e5) return value.toExponential(2);
  return value.toFixed(Math.min(Math.max(1 - Math.floor(Math.log10(span || 1)), 0), 7));
}

function number_at(chart, value) {
  if (!is_number(value)) return '–';
  return chart.significant ? String(Number(value.toPrecision(chart.digits + 1))) : value.toFixed(chart.digits);
}

// The values of one row of a chart: mean and reach, with their units.
function show_readout(chart, row) {
  const points = chart.points;
  const point = row === undefined ? points[points.length - 1] : points[row];
  if (!point) return;
  const parts = chart.series.map((name, index) => {
    const [low, mean, high] = point[index + 1];
    if (mean === null && name.startsWith('reference')) return '';
    const half = is_number(low) && high > low ? ` ± ${Number(((high - low) / 2).toPrecision(2))}` : '';
    const label = name.startsWith('reference') ? 'encoder ' : '';
    return `${label}${number_at(chart, mean)}${half} ${chart.unit}`;
  }).filter((part) => part !== '');
  const when = row === undefined ? '' : clock(point[0]) + '  ';
  chart.readout.textContent = when + parts.join('   ');
}

function select_row(from, row) {
  for (const chart of charts) {
    if (chart !== from && chart.graph) chart.graph.setSelection(row);
    if (row < chart.points.length) show_readout(chart, row);
  }
}

function unselect() {
  for (const chart of charts) {
    if (chart.graph) chart.graph.clearSelection();
    show_readout(chart);
  }
}

function set_zoom(range) {
  shown.zoom = range;
  at('whole').disabled = range === null;
  for (const chart of charts) chart.stale = true;
}

// Dragging, two fingers or a double click has moved this chart: all others follow.
function follow(chart) {
  if (!chart.graph) return;
  const range = chart.graph.xAxisRange();
  if (!chart.graph.isZoomed('x')) set_zoom(null);
  else if (range.join() !== chart.window.join()) set_zoom(range);
}

function make_chart(chart) {
  const box = document.createElement('article');
  box.className = chart.main ? 'chart main' : 'chart';
  const head = box.appendChild(document.createElement('header'));
  head.appendChild(document.createElement('h2')).textContent = chart.title;
  chart.readout = head.appendChild(document.createElement('span'));
  chart.readout.className = 'readout';
  const plot = box.appendChild(document.createElement('div'));
  plot.className = 'plot';
  plot.setAttribute('role', 'img');
  plot.setAttribute('aria-label', `${chart.title} over time${chart.unit ? ', in ' + chart.unit : ''}`);
  at('charts').appendChild(box);
  chart.points = points_of(chart);
  chart.window = date_window();
  chart.graph = new Dygraph(plot, chart.points, options_of(chart));
  new IntersectionObserver((entries) => {
    chart.visible = entries[entries.length - 1].isIntersecting;
    if (chart.visible) chart.stale = true;
  }).observe(plot);
}

function options_of(chart) {
  return {
    labels: ['time', ...chart.series], customBars: true, legend: 'never', fillAlpha: 0.3,
    strokeWidth: chart.main ? 1.6 : 1.1, drawGapEdgePoints: true, pointSize: 1.5, highlightCircleSize: 3.5,
    colors: colours_of(chart), gridLineColor: palette.line, axisLineColor: palette.line,
    valueRange: chart.floor ? [0, null] : null, yRangePad: 8, labelsKMB: false,
    dateWindow: chart.window,
    axes: {y: {axisLabelFormatter: axis_text, axisLabelWidth: 64, pixelsPerLabel: 26},
      x: {axisLabelWidth: 70, pixelsPerLabel: 80, ticker: Dygraph.dateTicker,
        axisLabelFormatter: Dygraph.dateAxisLabelFormatter}},
    underlayCallback: draw_invalid,
    drawCallback: () => follow(chart),
    highlightCallback: (event, x, points, row) => select_row(chart, row),
    unhighlightCallback: unselect,
  };
}

function date_window() {
  if (shown.zoom) return shown.zoom;
  const rows = shown_rows();
  const end = rows.length > 0 ? time_of(rows[rows.length - 1]) + shown.width_s * 1e3 : Date.now();
  return [end - shown.window_s * 1e3, end];
}

function draw(chart) {
  chart.stale = false;
  chart.drawn_ms = performance.now();
  if (!shown.paused) chart.points = points_of(chart);
  chart.window = date_window();
  chart.graph.updateOptions({file: chart.points, dateWindow: chart.window, colors: colours_of(chart),
    gridLineColor: palette.line, axisLineColor: palette.line});
  if (!chart.graph.getHighlightSeries || chart.graph.getSelection() < 0) show_readout(chart);
}

// In each picture of the screen the two charts that waited longest: all nine within 100 ms.
function draw_some() {
  const waiting = charts.filter((chart) => chart.graph && chart.stale && chart.visible)
    .sort((one, other) => (one.drawn_ms || 0) - (other.drawn_ms || 0));
  for (const chart of waiting.slice(0, 2)) draw(chart);
  if (waiting.length > 0) document.body.dataset.drawn = ++shown.drawn;
}

function run() {
  if (!document.hidden) draw_some();
  requestAnimationFrame(run);
}

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
  const hertz = Math.min(Math.max(55 * 2 ** Math.log10(signal), 55), 3520);
  tone.oscillator.frequency.setTargetAtTime(hertz, now, 0.03);
}

// ---- what people press

function set_seconds(seconds) {
  shown.seconds = seconds;
  for (const button of at('windows').children) {
    button.setAttribute('aria-pressed', String(Number(button.dataset.seconds) === seconds));
  }
  if (shown.paused) toggle_pause();
  set_zoom(null);
  listen();
}

function toggle_pause() {
  if (!shown.paused) held_rows = shown.rows.slice();
  shown.paused = !shown.paused;
  at('pause').setAttribute('aria-pressed', String(shown.paused));
  put('pause', shown.paused ? 'Go on' : 'Pause');
  if (!shown.paused && shown.frame) show_frame(shown.frame);
  for (const chart of charts) chart.stale = true;
}

// What the charts show, as they show it: the rows within the zoom.
function table() {
  const [from, to] = date_window();
  const head = ['time_utc', 'frames', 'valid_frames', 'status'];
  for (const name of SERIES) head.push(name, name + '_low', name + '_high');
  const lines = [head.join(',')];
  for (const row of shown_rows()) {
    const time = time_of(row);
    if (time < from || time > to) continue;
    const cells = [new Date(time).toISOString(), row[1], row[2], STATUSES[row[3]]];
    for (let i = FIRST_SERIES; i < row.length; ++i) {
      const [low, mean, high] = reach(row[i], 1);
      cells.push(...[mean, low, high].map((value) => (value === null ? '' : value)));
    }
    lines.push(cells.join(','));
  }
  return lines.join('\n') + '\n';
}

function save_table() {
  const link = document.createElement('a');
  link.href = URL.createObjectURL(new Blob([table()], {type: 'text/csv'}));
  link.download = `splid-${new Date().toISOString().slice(0, 19).replaceAll(':', '')}.csv`;
  link.click();
  setTimeout(() => URL.revokeObjectURL(link.href), 1000);
}

function set_theme(name) {
  document.documentElement.dataset.theme = name;
  read_palette();
  for (const chart of charts) chart.stale = true;
  draw_photons();
}

function toggle_aligning() {
  const on = document.body.classList.toggle('aligning');
  at('bigger').setAttribute('aria-pressed', String(on));
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
  set_theme(dark.matches ? 'dark' : 'light');
  // Its legend writes styles into the page, which the content security policy forbids; each chart has
  // a line of its own for that.
  Dygraph.PLUGINS = Dygraph.PLUGINS.filter((plugin) => plugin !== Dygraph.Plugins.Legend);
  charts.forEach(make_chart);
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
  document.addEventListener('keydown', on_key);
  set_seconds(60);
  run();
}

start();
