'use strict';
// The charts of the page: means and reaches over time, each on a canvas of its own. They are drawn at
// most ten times a second, and each only where its picture has changed by a pixel.

const CHARTS = [
  {title: 'Distance', unit: 'm', places: 5, main: true, series: ['distance', 'reference_distance']},
  {title: 'Velocity', unit: 'm/s', places: 4, main: true, series: ['velocity', 'reference_velocity']},
  {title: 'Signal', unit: 'counts/pulse', series: ['signal']},
  {title: 'Background', unit: 'counts/s', series: ['background']},
  {title: 'Signal over background', unit: '', series: ['sbr']},
  {title: 'Sync drift', unit: 'ppm', places: 4, series: ['drift']},
  {title: 'Sync jitter', unit: 'ps', places: 2, series: ['jitter']},
  {title: 'Latency', unit: 'ms', places: 2, series: ['latency']},
  {title: 'Ring fill', unit: '%', places: 1, series: ['ring'], factor: 100, floor: true},
];
const COLOURS = {reference_distance: 'reference', reference_velocity: 'reference'};
const MARGIN = {left: 62, top: 18, right: 8, bottom: 18};
const FONT = '11px system-ui, sans-serif';

const charts = CHARTS.map((chart) => ({...chart, stale: true, visible: true, drawn_ms: -1e9, range: null}));
let selected = null;  // the time under the cursor; null: no cursor

// ---- the values of a chart

function reach(cell, factor) {
  if (cell === 0 || cell === undefined) return null;
  const [low, mean, high] = cell.length === 1 ? [cell[0], cell[0], cell[0]] : cell;
  return [low * factor, mean * factor, high * factor];
}
const column_of = (name) => FIRST_SERIES + SERIES.indexOf(name);
const value_in = (chart, name, row) => reach(row[column_of(name)], chart.factor || 1);

// Longer than this between two rows is a gap, which no line bridges.
function gap_ms() {
  return 2.5 * Math.max(shown.width_s * 1e3, shown.frame ? shown.frame.duration_ms : 50);
}

// The first and the last row but one that a chart shows, with one row beyond either end.
function rows_in([from, to]) {
  const rows = shown_rows();
  const first = rows.findIndex((row) => time_of(row) >= from);
  if (first < 0) return [];
  let end = rows.length;
  while (end > first && time_of(rows[end - 1]) > to) --end;
  return rows.slice(Math.max(first - 1, 0), Math.min(end + 1, rows.length));
}

// Lines of [time, low, mean, high], at most one for each pixel: one line of them between two gaps.
function lines_of(chart, name, rows, pixel_ms) {
  const lines = [];
  let line = null, before = -Infinity, count = 0;
  for (const row of rows) {
    const value = value_in(chart, name, row), time = time_of(row);
    if (value === null) { line = null; continue; }
    if (line === null || time - before > gap_ms()) lines.push(line = []);
    const last = line[line.length - 1];
    if (last && time < last[0] + pixel_ms) {
      ++count;
      last[1] = Math.min(last[1], value[0]);
      last[2] += (value[1] - last[2]) / count;
      last[3] = Math.max(last[3], value[2]);
    } else {
      line.push([time, ...value]);
      count = 1;
    }
    before = time;
  }
  return lines;
}

// From the lowest to the highest value, with a margin; null without a value.
function range_of(chart, drawn) {
  let low = Infinity, high = -Infinity;
  for (const lines of drawn) for (const line of lines) for (const [, below, , above] of line) {
    low = Math.min(low, below);
    high = Math.max(high, above);
  }
  if (low > high) return null;
  if (chart.floor) low = Math.min(low, 0);
  const least = Math.max(Math.abs(low), Math.abs(high), chart.floor ? 1 : 1e-9) * 1e-6;
  const margin = Math.max((high - low) * 0.07, least);
  return [chart.floor ? low : low - margin, high + margin];
}

// ---- drawing

// A canvas with an area for data inside of margins, in the pixels of the style sheet.
function open_canvas(canvas, margin) {
  const ratio = window.devicePixelRatio || 1;
  const width = canvas.clientWidth, height = canvas.clientHeight;
  if (canvas.width !== Math.round(width * ratio)) canvas.width = Math.round(width * ratio);
  if (canvas.height !== Math.round(height * ratio)) canvas.height = Math.round(height * ratio);
  const pen = canvas.getContext('2d');
  pen.setTransform(ratio, 0, 0, ratio, 0, 0);
  pen.clearRect(0, 0, width, height);
  pen.font = FONT;
  const area = {x: margin.left, y: margin.top, w: Math.max(width - margin.left - margin.right, 1),
    h: Math.max(height - margin.top - margin.bottom, 1)};
  return {pen, area};
}

function scales(area, [from, to], [low, high]) {
  return {at_x: (time) => area.x + (time - from) / (to - from) * area.w,
    at_y: (value) => area.y + area.h - (value - low) / (high - low) * area.h};
}

// Bars of the colour of a status behind frames that are not valid, as high as the chart where no
// frame of the bin is, and a strip at the bottom where only some are not.
function draw_invalid(pen, area, at_x, rows) {
  const width_ms = Math.max(shown.width_s * 1e3, shown.frame ? shown.frame.duration_ms : 50);
  for (const row of rows) {
    const [, frames, valid, status] = row;
    if (status === 1) continue;
    const left = Math.max(at_x(time_of(row)), area.x);
    const right = Math.min(at_x(time_of(row) + width_ms), area.x + area.w);
    if (right <= area.x || left >= area.x + area.w) continue;
    pen.globalAlpha = valid === 0 ? 0.32 : 0.9;
    pen.fillStyle = palette[STATUSES[status]] || palette.muted;
    const height = valid === 0 ? area.h : Math.max(3, area.h * 0.04 * (frames > valid ? 1.5 : 1));
    pen.fillRect(left, area.y + area.h - height, Math.max(right - left, 1), height);
  }
  pen.globalAlpha = 1;
}

function draw_grid(pen, area, chart, window_ms, {at_x, at_y}) {
  pen.strokeStyle = palette.line;
  pen.fillStyle = palette.muted;
  pen.lineWidth = 1;
  pen.beginPath();
  pen.rect(area.x, area.y, area.w, area.h);
  pen.textAlign = 'center';
  pen.textBaseline = 'top';
  for (const [time, text] of clock_ticks(...window_ms, area.w / 80)) {
    const fits = at_x(time) + pen.measureText(text).width / 2 < area.x + area.w + MARGIN.right;
    if (fits) pen.fillText(text, at_x(time), area.y + area.h + 5);
  }
  pen.textBaseline = 'middle';
  if (chart.range) {
    const power = power_of(Math.max(...chart.range.map(Math.abs)), chart.unit);
    pen.textAlign = 'right';
    for (const [value, text] of ticks_of(...chart.range, clamp(area.h / 26, 2, 8), 1e3 ** power)) {
      const y = Math.round(at_y(value)) + 0.5;
      pen.moveTo(area.x, y);
      pen.lineTo(area.x + area.w, y);
      pen.fillText(text, area.x - 5, y);
    }
    chart.axis_unit = with_prefix(power, chart.unit);
    pen.textAlign = 'left';
    pen.fillText(chart.axis_unit, 2, 8);
  } else {
    chart.axis_unit = '';
    pen.textAlign = 'center';
    pen.fillText('no value', area.x + area.w / 2, area.y + area.h / 2);
  }
  pen.stroke();
}

function draw_lines(pen, lines, colour, width, {at_x, at_y}) {
  pen.strokeStyle = pen.fillStyle = colour;
  pen.lineWidth = width;
  for (const line of lines) {
    pen.globalAlpha = 0.3;
    pen.beginPath();
    for (const [time, , , high] of line) pen.lineTo(at_x(time), at_y(high));
    for (let i = line.length - 1; i >= 0; --i) pen.lineTo(at_x(line[i][0]), at_y(line[i][1]));
    pen.fill();
    pen.globalAlpha = 1;
    pen.beginPath();
    for (const [time, , mean] of line) pen.lineTo(at_x(time), at_y(mean));
    pen.stroke();
    if (line.length === 1) pen.fillRect(at_x(line[0][0]) - 1.5, at_y(line[0][2]) - 1.5, 3, 3);
  }
}

function draw(chart) {
  chart.stale = false;
  chart.drawn_ms = performance.now();
  chart.window = date_window();
  const {pen, area} = open_canvas(chart.canvas, MARGIN);
  chart.area = area;
  const rows = rows_in(chart.window);
  const pixel_ms = (chart.window[1] - chart.window[0]) / area.w;
  const drawn = chart.series.map((name) => lines_of(chart, name, rows, pixel_ms));
  chart.range = range_of(chart, drawn);
  const scale = scales(area, chart.window, chart.range || [0, 1]);
  draw_invalid(pen, area, scale.at_x, rows);
  draw_grid(pen, area, chart, chart.window, scale);
  pen.save();
  pen.beginPath();
  pen.rect(area.x, area.y, area.w, area.h);
  pen.clip();
  drawn.forEach((lines, i) => draw_lines(pen, lines, palette[COLOURS[chart.series[i]] || chart.series[i]], chart.main ? 1.6 : 1.1, scale));
  pen.restore();
  show_readout(chart);
  show_cursor(chart);
}

// A chart that time has not moved by a pixel looks the same, but for its last value.
function is_due(chart) {
  if (!chart.stale || !chart.visible) return false;
  const pixel_ms = chart.area && !chart.anew ? shown.window_s * 1e3 / chart.area.w : 0;
  return performance.now() - chart.drawn_ms >= clamp(pixel_ms, 0, 1000) - 10;
}

// anew: at once, also where no time has passed.
function mark(anew) {
  for (const chart of charts) {
    chart.stale = true;
    chart.anew = chart.anew || anew;
  }
  schedule();
}

// Returns whether any has still to be drawn.
function draw_charts() {
  let drawn = 0;
  for (const chart of charts) {
    if (!is_due(chart)) continue;
    draw(chart);
    chart.anew = false;
    ++drawn;
  }
  if (drawn > 0) {
    shown.drawn += drawn;
    document.body.dataset.drawn = shown.drawn;
  }
  return charts.some((chart) => chart.stale && chart.visible);
}

// ---- what is under the cursor

function selected_row() {
  const rows = shown_rows();
  if (selected === null || rows.length === 0) return rows[rows.length - 1];
  return rows.reduce((best, row) => (Math.abs(time_of(row) - selected) < Math.abs(time_of(best) - selected) ? row : best));
}

// The values of one row of a chart: mean and half of the reach, with their units.
function show_readout(chart) {
  const row = selected_row();
  if (!row) return;
  const parts = chart.series.map((name) => {
    const value = value_in(chart, name, row);
    const is_reference = name.startsWith('reference');
    if (value === null) return is_reference ? '' : '–';
    const half = (value[2] - value[0]) / 2;
    return (is_reference ? 'encoder ' : '') + in_one(value[1], half, chart.unit, chart.places);
  }).filter((part) => part !== '');
  const text = (selected === null ? '' : clock(time_of(row)) + '  ') + parts.join('   ');
  if (chart.readout.textContent !== text) chart.readout.textContent = text;
}

function show_cursor(chart) {
  const row = selected === null ? null : selected_row();
  const left = row && chart.window && (time_of(row) - chart.window[0]) / (chart.window[1] - chart.window[0]);
  const hidden = !row || left < 0 || left > 1;
  chart.cursor.hidden = hidden;
  if (!hidden) chart.cursor.style.left = `${chart.area.x + left * chart.area.w}px`;
}

function select(time) {
  selected = time;
  for (const chart of charts) {
    show_readout(chart);
    show_cursor(chart);
  }
}

// ---- zoom and shift

function set_zoom(range) {
  shown.zoom = range;
  at('whole').disabled = range === null;
  mark(true);
}

function time_at(chart, event) {
  const share = (event.offsetX - chart.area.x) / chart.area.w;
  return chart.window[0] + clamp(share, 0, 1) * (chart.window[1] - chart.window[0]);
}

function show_drag(chart, from, to) {
  const place = (time) => chart.area.x + (time - chart.window[0]) / (chart.window[1] - chart.window[0]) * chart.area.w;
  chart.drag_box.hidden = from === undefined;
  if (from === undefined) return;
  chart.drag_box.style.left = `${Math.min(place(from), place(to))}px`;
  chart.drag_box.style.width = `${Math.abs(place(to) - place(from))}px`;
}

const least_drag_px = 5;
function listen_to(chart) {
  const canvas = chart.canvas;
  let drag = null;
  canvas.addEventListener('pointerdown', (event) => {
    if (event.button !== 0 || !chart.area) return;
    canvas.setPointerCapture(event.pointerId);
    drag = {x: event.offsetX, time: time_at(chart, event), window: chart.window, moves: event.shiftKey};
  });
  canvas.addEventListener('pointermove', (event) => {
    if (!chart.area) return;
    if (drag && drag.moves) {
      const [from, to] = drag.window;
      const by = (drag.x - event.offsetX) / chart.area.w * (to - from);
      set_zoom([from + by, to + by]);
    } else if (drag) {
      show_drag(chart, drag.time, time_at(chart, event));
    }
    select(time_at(chart, event));
  });
  canvas.addEventListener('pointerup', (event) => {
    if (drag && !drag.moves && Math.abs(event.offsetX - drag.x) >= least_drag_px) {
      set_zoom([drag.time, time_at(chart, event)].sort((one, other) => one - other));
    }
    drag = null;
    show_drag(chart);
  });
  canvas.addEventListener('pointercancel', () => { drag = null; show_drag(chart); });
  canvas.addEventListener('pointerleave', () => { if (!drag) select(null); });
  canvas.addEventListener('dblclick', () => set_zoom(null));
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
  chart.canvas = plot.appendChild(document.createElement('canvas'));
  chart.canvas.setAttribute('role', 'img');
  chart.canvas.setAttribute('aria-label', `${chart.title} over time${chart.unit ? ', in ' + chart.unit : ''}`);
  for (const name of ['cursor', 'drag_box']) {
    chart[name] = plot.appendChild(document.createElement('i'));
    chart[name].className = name;
    chart[name].hidden = true;
  }
  at('charts').appendChild(box);
  listen_to(chart);
  const draw_anew = () => { chart.stale = chart.anew = true; schedule(); };
  new ResizeObserver(draw_anew).observe(plot);
  new IntersectionObserver((entries) => {
    chart.visible = entries[entries.length - 1].isIntersecting;
    if (chart.visible) draw_anew();
  }).observe(plot);
}
