'use strict';
// Three pictures of one frame's photons, as the topic `fold` has them (docs/reference/messages.md):
// the pulse, the whole pattern period, and the likelihood about the estimate. They are asked for
// only while they are shown.

const MM_PER_NS = 149.896229;  // half the speed of light

// pointed: the picture that the cursor is on, and where, in pixels of its canvas.
const photons = {on: false, fold: null, pictures: {}, pointed: null};

// A figure whose axes are x and y: {from, to, title}.
function open_picture(id, x, y) {
  const {pen, area} = open_canvas(at(id), {left: 56, top: 18, right: 10, bottom: 34});
  const scale = scales(area, [x.from, x.to], [y.from, y.to]);
  return photons.pictures[id] = {pen, area, x, y, ...scale};
}

function draw_axes({pen, area, x, y, at_x, at_y}) {
  pen.strokeStyle = palette.line;
  pen.fillStyle = palette.muted;
  pen.lineWidth = 1;
  pen.strokeRect(area.x, area.y, area.w, area.h);
  pen.textAlign = 'center';
  pen.textBaseline = 'top';
  for (const [value, text] of ticks_of(x.from, x.to, 5)) pen.fillText(text, at_x(value), area.y + area.h + 4);
  pen.fillText(x.title, area.x + area.w / 2, area.y + area.h + 18);
  pen.textAlign = 'right';
  pen.textBaseline = 'middle';
  for (const [value, text] of ticks_of(y.from, y.to, 5)) pen.fillText(text, area.x - 5, at_y(value));
  pen.textAlign = 'left';
  pen.fillText(y.title, 2, 8);
}

function draw_bars(picture, counts, from, width, colour) {
  const {pen, at_x, at_y} = picture;
  pen.fillStyle = colour;
  counts.forEach((count, i) => {
    if (count === 0) return;
    const left = at_x(from + i * width), top = at_y(count);
    pen.fillRect(left, top, Math.max(at_x(from + (i + 1) * width) - left, 1), at_y(0) - top);
  });
}

function draw_stack(stack) {
  const end = stack.first_ns + stack.bin_ns * stack.counts.length;
  const most = Math.max(...stack.counts, ...stack.expected, 1);
  const picture = open_picture('stack', {from: stack.first_ns, to: end, title: 'ns from the pulse'},
    {from: 0, to: most * 1.05, title: 'counts'});
  draw_bars(picture, stack.counts, stack.first_ns, stack.bin_ns, palette.signal);
  const {pen, at_x, at_y} = picture;
  pen.strokeStyle = palette.reference;
  pen.lineWidth = 2;
  pen.beginPath();
  stack.expected.forEach((count, i) => pen.lineTo(at_x(stack.first_ns + (i + 0.5) * stack.bin_ns), at_y(count)));
  pen.stroke();
  draw_axes(picture);
}

function draw_period(period) {
  const picture = open_picture('period', {from: 0, to: period.bin_ns * period.counts.length, title: 'ns from the start of the pattern'},
    {from: 0, to: Math.max(...period.counts, 1) * 1.05, title: 'counts'});
  draw_bars(picture, period.counts, 0, period.bin_ns, palette.distance);
  draw_axes(picture);
}

// From dark blue over green to yellow, of even steps in brightness.
const RAMP = [[24, 18, 82], [45, 72, 138], [32, 128, 140], [78, 190, 98], [253, 231, 37]];
function ramp(share) {
  const at_ramp = Math.min(Math.max(share, 0), 1) * (RAMP.length - 1);
  const below = Math.min(Math.floor(at_ramp), RAMP.length - 2);
  return RAMP[below].map((value, i) => value + (RAMP[below + 1][i] - value) * (at_ramp - below));
}

// Cells in colours of the ramp, row by row from the upper left; null: none.
function draw_cells(pen, area, columns, rows, shares) {
  const pixels = new ImageData(columns, rows);
  shares.forEach((share, i) => { if (share !== null) pixels.data.set([...ramp(share), 255], 4 * i); });
  const small = document.createElement('canvas');
  small.width = columns;
  small.height = rows;
  small.getContext('2d').putImageData(pixels, 0, 0);
  pen.imageSmoothingEnabled = false;
  pen.drawImage(small, area.x, area.y, area.w, area.h);
}

function draw_plane(plane) {
  const cells = Math.round(Math.sqrt(plane.gain_nats.length));
  const mm = plane.delay_step_ns * MM_PER_NS * cells / 2, mps = plane.velocity_step_mps * cells / 2;
  const picture = open_picture('plane', {from: -mm, to: mm, title: 'mm of distance from the estimate'}, {from: -mps, to: mps, title: 'm/s'});
  const {pen, area, at_x, at_y} = picture;
  const best = Math.max(...plane.gain_nats, 1);
  // Velocity rises upwards.
  const shares = plane.gain_nats.map((gain, i) => plane.gain_nats[(cells - 1 - Math.floor(i / cells)) * cells + i % cells] / best);
  draw_cells(pen, area, cells, cells, shares);
  draw_deviations(pen, at_x, at_y);
  draw_axes(picture);
}

// One and three standard deviations of the last frame.
function draw_deviations(pen, at_x, at_y) {
  const std = shown.frame && shown.frame.pixel === photons.fold.pixel && shown.frame.std;
  if (!std || !is_number(std.distance_m) || !is_number(std.velocity_mps)) return;
  pen.strokeStyle = '#ffffff';
  pen.lineWidth = 1.5;
  for (const times of [1, 3]) {
    pen.beginPath();
    pen.ellipse(at_x(0), at_y(0), Math.abs(at_x(times * std.distance_m * 1e3) - at_x(0)),
      Math.abs(at_y(times * std.velocity_mps) - at_y(0)), 0, 0, 2 * Math.PI);
    pen.stroke();
  }
}

const DRAW = {stack: draw_stack, period: draw_period, plane: draw_plane};

function draw_photons() {
  if (!photons.on) return;
  for (const [name, draw_one] of Object.entries(DRAW)) {
    const data = photons.fold && photons.fold[name];
    at(name + '-figure').classList.toggle('empty', !data);
    if (data) draw_one(data);
    show_photon_readout(name);
  }
  if (!photons.fold) return;
  const {sequence, status, photons: all, folded, pixel} = photons.fold;
  const share = folded < all ? `, ${whole(folded)} of them drawn` : '';
  put('fold-note', `Frame ${sequence}${pixel ? ', pixel ' + pixel : ''}: ${in_words(status)}, ${whole(all)} photons${share}`, sequence);
}

function sum_of(list) { return list.reduce((sum, value) => sum + value, 0); }

function summary_of(name, data) {
  if (name === 'stack') return `${whole(sum_of(data.counts))} counts, ${whole(Math.round(sum_of(data.expected)))} expected`;
  if (name === 'period') return data.moved_back ? 'as the photons left' : 'as the photons came';
  return `best ${nats(Math.max(...data.gain_nats))} nats over no target`;
}

// What is under the cursor, with its units.
function value_at(name, x, y) {
  const data = photons.fold[name];
  const cell = (value, first, step, count) => Math.min(Math.max(Math.floor((value - first) / step), 0), count - 1);
  if (name === 'stack') {
    const i = cell(x, data.first_ns, data.bin_ns, data.counts.length);
    return `${(data.first_ns + (i + 0.5) * data.bin_ns).toFixed(3)} ns: ${data.counts[i]} counts, ${data.expected[i]} expected`;
  }
  if (name === 'period') {
    const i = cell(x, 0, data.bin_ns, data.counts.length);
    return `${((i + 0.5) * data.bin_ns).toFixed(1)} ns: ${data.counts[i]} counts`;
  }
  const cells = Math.round(Math.sqrt(data.gain_nats.length));
  const column = cell(x / MM_PER_NS, -data.delay_step_ns * cells / 2, data.delay_step_ns, cells);
  const row = cell(y, -data.velocity_step_mps * cells / 2, data.velocity_step_mps, cells);
  return `${x.toFixed(1)} mm, ${y.toFixed(2)} m/s: ${data.gain_nats[row * cells + column]} nats`;
}

// '' where the cursor is elsewhere.
function value_under_cursor(name) {
  if (!photons.pointed || photons.pointed.name !== name) return '';
  const {area, x, y} = photons.pictures[name];
  const right = (photons.pointed.x - area.x) / area.w, up = 1 - (photons.pointed.y - area.y) / area.h;
  if (right < 0 || right > 1 || up < 0 || up > 1) return '';
  return value_at(name, x.from + right * (x.to - x.from), y.from + up * (y.to - y.from));
}

function show_photon_readout(name) {
  const data = photons.fold && photons.fold[name];
  put(name + '-readout', data ? value_under_cursor(name) || summary_of(name, data) : 'not in this frame');
}

function point_at(name, event) {
  photons.pointed = event ? {name, x: event.offsetX, y: event.offsetY} : null;
  show_photon_readout(name);
}

function take_fold(fold) {
  if (shown.paused) return;
  photons.fold = fold;
  draw_photons();
}

function open_photons() {
  photons.on = !photons.on;
  photons.fold = null;
  at('photons').setAttribute('aria-pressed', String(photons.on));
  at('pictures').hidden = !photons.on;
  put('fold-note', 'Waiting for a frame');
}

function toggle_photons() {
  open_photons();
  keep_in_address();
  listen();
  draw_photons();
}

function start_photons() {
  at('photons').addEventListener('click', toggle_photons);
  for (const name of Object.keys(DRAW)) {
    at(name).addEventListener('pointermove', (event) => point_at(name, event));
    at(name).addEventListener('pointerleave', () => point_at(name, null));
  }
  window.addEventListener('resize', draw_photons);
}
