'use strict';
// Draws the charts of a report on canvases: each curve as the lowest and the highest value of each pixel.
// What goes wrong stands in the page: data-error of the root; data-drawn counts charts, data-ready ends it.

const root = document.documentElement;
root.dataset.drawn = 0;
window.addEventListener('error', (event) => { root.dataset.error = event.message; });

const LEFT = 58, RIGHT = 8, TOP = 6, BOTTOM = 22; // pixels round the drawing area
const NARROW = 620, HEIGHT = 190, LOW_HEIGHT = 150; // pixels: a panel of share 1, and where the page is narrow
const PYRAMID = 4; // values of one level that make one of the next
const NOTHING = -32768; // stands for an unknown value
const charts = [];
const dark = matchMedia('(prefers-color-scheme: dark)');
let printing = false;

// ---- numbers

function bytesOf(text) {
  const raw = atob(text), bytes = new Uint8Array(raw.length);
  for (let place = 0; place < raw.length; place += 1) bytes[place] = raw.charCodeAt(place);
  return bytes.buffer;
}

function decoded(curve) {
  if (curve.points) {
    const { x, y } = curve.points;
    return { ...curve, x: new Float64Array(bytesOf(x)), y: new Float32Array(bytesOf(y)) };
  }
  const { begin, step, low, size, pairs, values } = curve.even;
  const raw = new Int16Array(bytesOf(values)), count = pairs ? raw.length / 2 : raw.length;
  const value = (place) => (raw[place] === NOTHING ? NaN : low + size * (raw[place] + 32767));
  const lows = new Float32Array(count), highs = pairs ? new Float32Array(count) : lows;
  for (let place = 0; place < count; place += 1) {
    lows[place] = value(pairs ? 2 * place : place);
    if (pairs) highs[place] = value(2 * place + 1);
  }
  return { ...curve, begin, step, pairs, levels: [{ lows, highs, step }] };
}

function levelFor(curve, step) { // the coarsest level of detail that is at most `step` wide
  const levels = curve.levels;
  while (levels[levels.length - 1].step * PYRAMID <= step) levels.push(coarser(levels[levels.length - 1]));
  let found = levels[0];
  for (const level of levels) if (level.step <= step) found = level;
  return found;
}

function coarser({ lows, highs, step }) {
  const count = Math.ceil(lows.length / PYRAMID), low = new Float32Array(count), high = new Float32Array(count);
  for (let place = 0; place < count; place += 1) {
    let least = NaN, most = NaN;
    const end = Math.min(lows.length, (place + 1) * PYRAMID);
    for (let k = place * PYRAMID; k < end; k += 1) {
      if (!(lows[k] >= least)) least = isNaN(lows[k]) ? least : lows[k];
      if (!(highs[k] <= most)) most = isNaN(highs[k]) ? most : highs[k];
    }
    low[place] = least; high[place] = most;
  }
  return { lows: low, highs: high, step: step * PYRAMID };
}

function extent(curve, from, to) { // lowest and highest value between two x
  let low = Infinity, high = -Infinity;
  const take = (least, most) => { if (least < low) low = least; if (most > high) high = most; };
  if (curve.levels) {
    const { lows, highs, step } = levelFor(curve, (to - from) / 400);
    const first = Math.max(0, Math.floor((from - curve.begin) / step));
    const last = Math.min(lows.length - 1, Math.ceil((to - curve.begin) / step));
    for (let place = first; place <= last; place += 1) take(lows[place], highs[place]);
  } else {
    for (let place = 0; place < curve.x.length; place += 1)
      if (curve.x[place] >= from && curve.x[place] <= to) take(curve.y[place], curve.y[place]);
  }
  return [low, high];
}

function valueAt(curve, x) { // the lowest and the highest value known there
  if (curve.levels) {
    const { lows, highs } = curve.levels[0];
    const place = curve.pairs ? Math.floor((x - curve.begin) / curve.step) : Math.round((x - curve.begin) / curve.step);
    return place >= 0 && place < lows.length ? [lows[place], highs[place]] : null;
  }
  if (!curve.rising) return null;
  let low = 0, high = curve.x.length - 1;
  if (high < 0 || x < curve.x[0] || x > curve.x[high]) return null;
  while (high - low > 1) { const middle = (low + high) >> 1; if (curve.x[middle] <= x) low = middle; else high = middle; }
  const nearer = !curve.steps && curve.x[high] - x < x - curve.x[low] ? high : low;
  return [curve.y[nearer], curve.y[nearer]];
}

function niceStep(span, count) {
  const rough = span / Math.max(1, count), power = 10 ** Math.floor(Math.log10(rough));
  return power * [1, 2, 5, 10].find((factor) => factor * power >= rough * 0.999);
}

function written(value, span, log) { // digits that tell apart a two-thousandth of what is shown
  if (value === null || !isFinite(value)) return '–';
  if (log) return value.toPrecision(3);
  return value.toFixed(Math.min(6, Math.max(0, Math.ceil(-Math.log10(span / 2000)))));
}

// ---- a chart and what is shown of it

function wholeOf(told) {
  if (told.limits) return told.limits;
  let low = Infinity, high = -Infinity;
  for (const panel of told.panels) for (const curve of [...panel.curves, ...panel.dots]) {
    const ends = curve.levels ? [curve.begin, curve.begin + curve.step * curve.levels[0].lows.length] : curve.x;
    for (const x of ends) { if (x < low) low = x; if (x > high) high = x; }
  }
  if (!(low < high)) return [low - 0.5, low + 0.5];
  const room = told.edge ? 0.02 * (high - low) : 0;
  return [low - room, high + room];
}

function build(place) {
  const told = JSON.parse(place.nextElementSibling.textContent);
  for (const panel of told.panels) {
    panel.curves = panel.curves.map(decoded);
    panel.dots = panel.dots.map(decoded);
  }
  const chart = { told, place, spike: null, panels: [], whole: null };
  chart.whole = wholeOf(told);
  chart.shown = told.view || chart.whole;
  place.tabIndex = 0;
  place.setAttribute('role', 'group');
  place.setAttribute('aria-label', `${told.title}: arrow keys move, plus and minus zoom, 0 shows all`);
  chart.reading = add(place, 'p', 'reading');
  for (const panel of told.panels) chart.panels.push(builtPanel(chart, panel));
  if (told.spans.length) add(place, 'p', 'key', `▒ ${told.span_name}`);
  listen(chart);
  charts.push(chart);
  draw(chart);
}

function add(parent, kind, name, text = '') {
  const made = document.createElement(kind);
  made.className = name;
  made.textContent = text;
  parent.append(made);
  return made;
}

function builtPanel(chart, told) {
  const legend = add(chart.place, 'div', 'legend');
  add(legend, 'b', '', told.label);
  const unit = (told.label.match(/\(([^()]*)\)\s*$/) || ['', ''])[1];
  for (const line of [...told.curves, ...told.dots]) {
    line.chip = add(legend, 'button', 'chip');
    line.chip.type = 'button';
    line.chip.title = 'show or hide';
    line.chip.setAttribute('aria-pressed', 'true');
    const sign = told.dots.includes(line) ? 'point' : line.dash === 'solid' ? 'stroke' : `stroke ${line.dash}`;
    add(line.chip, 'i', sign);
    line.chip.append(line.name);
    line.number = add(line.chip, 'output', '');
    line.chip.onclick = () => {
      line.hidden = !line.hidden;
      line.chip.setAttribute('aria-pressed', String(!line.hidden));
      draw(chart);
    };
  }
  const canvas = add(chart.place, 'canvas', '');
  canvas.setAttribute('role', 'img');
  canvas.setAttribute('aria-label', `${told.label} over ${chart.told.x_label}`);
  return { told, canvas, unit };
}

function show(chart, from, to) { // at most all of it, at least a ten-thousandth
  const [low, high] = chart.whole, span = Math.min(high - low, Math.max(to - from, (high - low) / 1e4));
  const begin = Math.min(Math.max(low, (from + to - span) / 2), high - span);
  chart.shown = [begin, begin + span];
  draw(chart);
}

function zoom(chart, factor, about = (chart.shown[0] + chart.shown[1]) / 2) {
  const [from, to] = chart.shown;
  show(chart, about - (about - from) * factor, about + (to - about) * factor);
}

function pan(chart, share) {
  const [from, to] = chart.shown, by = share * (to - from);
  show(chart, from + by, to + by);
}

function read(chart, x) { // one line through all panels over the same axis
  for (const other of charts) {
    if (other.told.x_label !== chart.told.x_label || (other !== chart && !other.told.shared)) continue;
    if (x !== null || other.spike !== null) { other.spike = x; draw(other); }
  }
}
