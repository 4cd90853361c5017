'use strict';
// Numbers for people, in one format: a value and its deviation in the same unit, to two digits of the
// deviation or else to four of the value. Counts and rates have an SI prefix at their unit; whole
// numbers that are exact have groups of three digits.

const is_number = (value) => typeof value === 'number' && Number.isFinite(value);

const PREFIXES = {'-4': 'p', '-3': 'n', '-2': 'µ', '-1': 'm', '0': '', '1': 'k', '2': 'M', '3': 'G'};
const PREFIXED = new Set(['counts/pulse', 'counts/s', 'B']);

const clamp = (value, low, high) => Math.min(Math.max(value, low), high);

// The power of a thousand that numbers up to `largest` are written in.
function power_of(largest, unit) {
  if (!PREFIXED.has(unit) || !(largest > 0)) return 0;
  return clamp(Math.floor(Math.log10(largest) / 3), -4, 3);
}
const with_prefix = (power, unit) => PREFIXES[power] + unit;

// {text, spread, unit}: "1.350", "± 0.012", "mcounts/pulse". places: decimals where no deviation is known.
function written(value, std, unit, places) {
  if (!is_number(value)) return {text: '–', spread: '', unit};
  const largest = Math.abs(value) > 0 ? Math.abs(value) : is_number(std) ? std : 0;
  const power = power_of(largest, unit), scale = 1e3 ** power;
  const known = is_number(std) && std > 0;
  const digit = (number) => Math.floor(Math.log10(number / scale));
  const decimals = clamp(known ? 1 - digit(std) : places !== undefined ? places : largest > 0 ? 3 - digit(largest) : 0, 0, 9);
  return {text: (value / scale).toFixed(decimals), spread: known ? `± ${(std / scale).toFixed(decimals)}` : '',
    unit: with_prefix(power, unit)};
}

// "1.350 ± 0.012 mcounts/pulse"
function in_one(value, std, unit, places) {
  const {text, spread, unit: prefixed} = written(value, std, unit, places);
  return [text, spread, text === '–' ? '' : prefixed].filter((part) => part !== '').join(' ');
}

const nats = (value) => (is_number(value) ? value.toLocaleString('en', {minimumFractionDigits: 1, maximumFractionDigits: 1}) : '–');
const whole = (number) => (is_number(Number(number)) ? Number(number).toLocaleString('en') : '–');

// "12 s", "3 min", "5 h"
function time_words(seconds) {
  if (seconds < 120) return `${Math.floor(seconds)} s`;
  return seconds < 7200 ? `${Math.floor(seconds / 60)} min` : `${Math.floor(seconds / 3600)} h`;
}

// "1:02:03"
function duration_text(seconds) {
  const whole_s = Math.floor(seconds);
  const two = (number) => String(number).padStart(2, '0');
  return `${Math.floor(whole_s / 3600)}:${two(Math.floor(whole_s / 60) % 60)}:${two(whole_s % 60)}`;
}

function clock(milliseconds) {
  const date = new Date(milliseconds);
  return date.toLocaleTimeString('en-GB') + '.' + String(date.getMilliseconds()).padStart(3, '0');
}

// ---- axes

// 1, 2 or 5 times a power of ten: at most `count` ticks.
function tick_step(span, count) {
  const rough = span / count;
  const power = 10 ** Math.floor(Math.log10(rough));
  return power * [1, 2, 5, 10].find((factor) => factor * power >= rough);
}

// [value, text] of each tick from `from` to `to`, in units of `scale`.
function ticks_of(from, to, count, scale = 1) {
  const step = tick_step((to - from) / scale, count);
  const digits = clamp(-Math.floor(Math.log10(step) + 1e-9), 0, 9);
  const list = [];
  for (let k = Math.ceil(from / scale / step); k * step <= to / scale; ++k) list.push([k * step * scale, (k * step).toFixed(digits)]);
  return list;
}

// Steps that a clock has.
const CLOCK_STEPS_S = [0.01, 0.02, 0.05, 0.1, 0.2, 0.5, 1, 2, 5, 10, 15, 30, 60, 120, 300, 600, 900, 1800, 3600, 7200];
function clock_ticks(from_ms, to_ms, count) {
  const rough = (to_ms - from_ms) / 1e3 / count;
  const step_ms = 1e3 * (CLOCK_STEPS_S.find((step) => step >= rough) || 14400);
  const list = [];
  for (let k = Math.ceil(from_ms / step_ms); k * step_ms <= to_ms; ++k) {
    const text = clock(Math.round(k * step_ms));
    list.push([k * step_ms, step_ms >= 6e4 ? text.slice(0, 5) : step_ms >= 1e3 ? text.slice(0, 8) : text.slice(3, step_ms >= 100 ? 10 : 11)]);
  }
  return list;
}
