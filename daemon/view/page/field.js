'use strict';
// Several pixels: pictures of the last scene's distance, velocity and signal, as the lidar sees them.
// A click or an arrow key chooses the pixel whose values and charts the page shows.

const FIELD = [
  {id: 'field-distance', name: 'distance_m', unit: 'm', places: 4},
  {id: 'field-velocity', name: 'velocity_mps', unit: 'm/s', places: 3},
  {id: 'field-signal', name: 'signal_per_pulse', unit: 'counts/pulse'},
];
// layout: names and cells, null where the daemon has one pixel. pixel: the name of the chosen one.
// pointed: the index of the pixel under the cursor. scales: of each picture [low, high].
const field = {layout: null, cells: [], picture: null, is_new: false, pixel: '', pointed: -1, scales: {}, boxes: {}};

const chosen = () => (field.layout ? field.layout.pixel.indexOf(field.pixel) : -1);

// ---- what the server sends

// It comes again with each stream.
function take_layout(layout) {
  if (JSON.stringify(layout) === JSON.stringify(field.layout)) return;
  field.layout = layout;
  field.picture = null;
  field.pointed = -1;
  field.scales = {};
  at('field').hidden = layout === null;
  if (!layout) return;
  field.cells = Array(layout.columns * layout.rows).fill(-1);
  layout.cell.forEach((cell, i) => { field.cells[cell] = i; });
  put('field-order', layout.is_grid ? '' : 'They stand in the order of the configuration, since their directions form no grid.');
}

function take_picture(picture) {
  if (!field.layout || !picture || shown.paused) return;
  field.picture = picture;
  field.is_new = true;
  if (chosen() < 0) choose_pixel(brightest());
}

function brightest() {
  const signal = field.picture.signal_per_pulse;
  return signal.reduce((best, value, i) => (value > (signal[best] || 0) ? i : best), 0);
}

// ---- the choice

let change_of_pixel = 0;
function choose_pixel(i) {
  const name = field.layout.pixel[i];
  if (name === undefined || name === field.pixel) return;
  field.pixel = name;
  Object.assign(shown, {frame: null, valid: null, frame_is_new: false, picture: {}});
  delete document.body.dataset.sequence;
  if (stream) stream.close();  // else what comes of the pixel before stands under the new name
  if (shown.paused) toggle_pause();
  keep_in_address();
  draw_field();
  show_values();
  // An arrow that is held down passes many pixels.
  clearTimeout(change_of_pixel);
  change_of_pixel = setTimeout(listen, 100);
}

// The next pixel in a direction; empty cells are passed over.
function step(right, down) {
  const {columns, rows, cell} = field.layout;
  const from = Math.max(chosen(), 0);
  let [x, y] = [cell[from] % columns, Math.floor(cell[from] / columns)];
  for (;;) {
    x += right;
    y += down;
    if (x < 0 || x >= columns || y < 0 || y >= rows) return;
    if (field.cells[y * columns + x] >= 0) return choose_pixel(field.cells[y * columns + x]);
  }
}

const ARROWS = {ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, -1], ArrowDown: [0, 1]};
function on_arrow(event) {
  if (!ARROWS[event.key] || !field.layout || event.ctrlKey || event.metaKey || event.altKey) return;
  step(...ARROWS[event.key]);
  event.preventDefault();
}

function pixel_under(id, event) {
  const box = field.boxes[id];
  if (!box || !field.layout) return -1;
  const {columns, rows} = field.layout;
  const x = Math.floor((event.offsetX - box.x) / box.w), y = Math.floor((event.offsetY - box.y) / box.h);
  return x < 0 || x >= columns || y < 0 || y >= rows ? -1 : field.cells[y * columns + x];
}

function point(i) {
  if (field.pointed === i) return;
  field.pointed = i;
  show_pixel();
}

// ---- drawing

// The scale of a picture stays while its values fill half of it, so that colours hold still.
function scale_of(name, values) {
  const numbers = values.filter(is_number);
  if (numbers.length === 0) return null;
  let low = Infinity, high = -Infinity;
  for (const value of numbers) {
    low = Math.min(low, value);
    high = Math.max(high, value);
  }
  const old = field.scales[name];
  if (old && old[0] <= low && high <= old[1] && high - low >= 0.5 * (old[1] - old[0])) return old;
  const margin = Math.max((high - low) * 0.1, Math.abs(high) * 1e-6, 1e-9);
  return field.scales[name] = [low - margin, high + margin];
}

// Square cells; those of a single row or column fill the picture.
function box_of(area) {
  const {columns, rows} = field.layout;
  let w = area.w / columns, h = area.h / rows;
  if (columns > 1 && rows > 1) w = h = Math.min(w, h);
  return {x: area.x + (area.w - w * columns) / 2, y: area.y + (area.h - h * rows) / 2, w, h};
}

function corner_of(i, box) {
  const {columns, cell} = field.layout;
  return [box.x + cell[i] % columns * box.w, box.y + Math.floor(cell[i] / columns) * box.h];
}

// A cross in the colour of the status, on no colour of the scale.
function draw_crosses(pen, box, values) {
  pen.lineWidth = clamp(Math.min(box.w, box.h) / 9, 1, 2.5);
  field.picture.status.forEach((status, i) => {
    if (is_number(values[i])) return;
    const [x, y] = corner_of(i, box);
    pen.strokeStyle = palette[STATUSES[status]] || palette.muted;
    pen.beginPath();
    pen.moveTo(x + box.w * 0.25, y + box.h * 0.25);
    pen.lineTo(x + box.w * 0.75, y + box.h * 0.75);
    pen.moveTo(x + box.w * 0.75, y + box.h * 0.25);
    pen.lineTo(x + box.w * 0.25, y + box.h * 0.75);
    pen.stroke();
  });
}

function draw_scale(pen, area, [low, high], unit) {
  const bar = {x: area.x + area.w + 10, w: 12};
  const colours = pen.createLinearGradient(0, area.y + area.h, 0, area.y);
  RAMP.forEach((colour, i) => colours.addColorStop(i / (RAMP.length - 1), `rgb(${colour})`));
  pen.fillStyle = colours;
  pen.fillRect(bar.x, area.y, bar.w, area.h);
  pen.fillStyle = palette.muted;
  pen.textAlign = 'left';
  pen.textBaseline = 'middle';
  const power = power_of(Math.max(Math.abs(low), Math.abs(high)), unit);
  for (const [value, text] of ticks_of(low, high, clamp(area.h / 30, 2, 6), 1e3 ** power)) {
    pen.fillText(text, bar.x + bar.w + 4, area.y + area.h - (value - low) / (high - low) * area.h);
  }
  pen.textBaseline = 'top';
  pen.textAlign = 'right';
  pen.fillText(with_prefix(power, unit), area.x + area.w + 70, 0);
}

function draw_choice(pen, box) {
  const i = chosen();
  if (i < 0) return;
  const [x, y] = corner_of(i, box);
  for (const [colour, width] of [['#ffffff', 4], ['#000000', 2]]) {
    pen.strokeStyle = colour;
    pen.lineWidth = width;
    pen.strokeRect(x, y, box.w, box.h);
  }
}

function draw_one({id, name, unit}) {
  const {pen, area} = open_canvas(at(id), {left: 4, top: 18, right: 72, bottom: 6});
  const {columns, rows} = field.layout;
  const values = field.picture[name], scale = scale_of(name, values);
  const box = field.boxes[id] = box_of(area);
  pen.strokeStyle = palette.line;
  pen.lineWidth = 1;
  pen.strokeRect(box.x, box.y, box.w * columns, box.h * rows);
  const share = (value) => (value - scale[0]) / (scale[1] - scale[0]);
  draw_cells(pen, {x: box.x, y: box.y, w: box.w * columns, h: box.h * rows}, columns, rows,
    field.cells.map((i) => (i >= 0 && is_number(values[i]) ? share(values[i]) : null)));
  draw_crosses(pen, box, values);
  if (scale) draw_scale(pen, area, scale, unit);
  draw_choice(pen, box);
}

function draw_field() {
  field.is_new = false;
  if (!field.layout || !field.picture || document.body.classList.contains('aligning')) return;
  FIELD.forEach(draw_one);
  const counts = {};
  for (const status of field.picture.status) counts[STATUSES[status]] = (counts[STATUSES[status]] || 0) + 1;
  const words = Object.entries(counts).sort(([, one], [, other]) => other - one).map(([status, count]) => `${whole(count)} ${in_words(status)}`).join(', ');
  put('field-note', `${whole(field.layout.pixel.length)} pixels: ${words}.`, field.picture.sequence);
  show_pixel();
}

// The values of the pixel under the cursor, or else of the chosen one.
function show_pixel() {
  const i = field.pointed >= 0 ? field.pointed : chosen();
  put('field-pixel', field.pixel, field.pixel);
  for (const {id, name, unit, places} of FIELD) {
    const value = i < 0 || !field.picture ? undefined : field.picture[name][i];
    const text = is_number(value) ? in_one(value, undefined, unit, places) : i < 0 || !field.picture ? '' : in_words(STATUSES[field.picture.status[i]]);
    put(id + '-readout', i < 0 ? '' : `${field.layout.pixel[i]}: ${text}`);
  }
}

function start_field() {
  for (const {id} of FIELD) {
    at(id).addEventListener('click', (event) => {
      const i = pixel_under(id, event);
      if (i >= 0) choose_pixel(i);
    });
    at(id).addEventListener('pointermove', (event) => point(pixel_under(id, event)));
    at(id).addEventListener('pointerleave', () => point(-1));
  }
  at('field-pictures').addEventListener('keydown', on_arrow);
  new ResizeObserver(draw_field).observe(at('field-pictures'));
}
