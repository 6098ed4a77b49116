'use strict';
// Charts on canvases, for the report and the live view. A curve has numbers x and y; where it has the lowest and the
// highest value of a stretch, x stands twice. What goes wrong stands in the page: data-error of the root.

const root = document.documentElement, dark = matchMedia('(prefers-color-scheme: dark)');
window.addEventListener('error', (event) => { root.dataset.error = event.message; });

const LEFT = 58, RIGHT = 8, TOP = 6, BOTTOM = 36; // pixels round the drawing area, BOTTOM of the last panel
const NARROW = 620, HEIGHT = 190, LOW_HEIGHT = 150; // pixels: a panel of share 1, and where the page is narrow
const UNKNOWN = -32768, DASHES = { solid: [], dashed: [6, 4], dotted: [2, 3] };
const charts = [];

function add(parent, kind, name, text = '') {
  const made = document.createElement(kind);
  made.className = name;
  made.textContent = text;
  parent.append(made);
  return made;
}

// ---- numbers

function decoded(text, Numbers) { return new Numbers(Uint8Array.from(atob(text), (letter) => letter.charCodeAt(0)).buffer); }

function withNumbers(curve) {
  if (curve.points) return { ...curve, x: decoded(curve.points.x, Float64Array), y: decoded(curve.points.y, Float32Array) };
  const { begin, step, low, size, pairs, values } = curve.even, raw = decoded(values, Int16Array);
  const x = Float64Array.from(raw, (_, place) => begin + step * (pairs ? Math.floor(place / 2) + 0.5 : place));
  const y = Float32Array.from(raw, (value) => (value === UNKNOWN ? NaN : low + size * (value + 32767)));
  return { ...curve, x, y };
}

function placeOf(x, value) { // the first place whose x is at least `value`
  let low = 0, high = x.length;
  while (low < high) { const middle = (low + high) >> 1; if (x[middle] < value) low = middle + 1; else high = middle; }
  return low;
}

function valuesAt({ x, y, rising }, at) { // those nearest to x, the lowest first
  if (!rising || !(at >= x[0] && at <= x[x.length - 1])) return [];
  const after = placeOf(x, at), nearest = after > 0 && at - x[after - 1] < x[after] - at ? after - 1 : after;
  return [nearest - 1, nearest, nearest + 1].filter((place) => x[place] === x[nearest]).map((place) => y[place]);
}

function niceStep(span, count) {
  const rough = span / Math.max(1, count), power = 10 ** Math.floor(Math.log10(rough));
  return power * [1, 2, 5, 10].find((factor) => factor * power >= rough * 0.999);
}

function ticksOf(low, high, count, log) { // at least three; of logarithms those of 1, 2, 5, or of decades
  const factors = high - low > 2.5 ? [1] : [1, 2, 5], logs = [];
  for (let decade = Math.floor(low); log && decade <= high; decade += 1) logs.push(...factors.map((factor) => decade + Math.log10(factor)));
  const inside = logs.filter((place) => place >= low && place <= high);
  if (inside.length > 1) return inside;
  const few = niceStep(high - low, count), step = Math.floor(high / few) - Math.ceil(low / few) < 2 ? niceStep(few / 2.5, 1) : few;
  const first = Math.ceil(low / step);
  return Array.from({ length: Math.floor(high / step) - first + 1 }, (_, place) => (first + place) * step);
}

function written(value, span, log) { // digits that tell apart a two-thousandth of what is shown
  if (!isFinite(value)) return '–';
  if (log) return value.toPrecision(3);
  return value.toFixed(Math.min(6, Math.max(0, Math.ceil(-Math.log10(span / 2000)))));
}

function unitOf(label) { return (label.match(/\(([^()]*)\)\s*$/) || ['', ''])[1]; }

// ---- a chart and what is shown of it

function build(place, spec) {
  const chart = { spec, place, spike: null };
  place.replaceChildren();
  chart.reading = add(place, 'p', 'reading');
  chart.panels = spec.panels.map((panel) => builtPanel(chart, panel));
  if (spec.shade) {
    chart.shade = withNumbers(spec.shade);
    add(place, 'p', 'key', `▒ ${spec.shade.name}`);
  }
  chart.whole = wholeOf(chart);
  chart.shown = spec.view || chart.whole;
  charts.push(chart);
  return chart;
}

function builtPanel(chart, spec) {
  const legend = add(chart.place, 'div', 'legend');
  add(legend, 'b', '', spec.label);
  const lines = spec.curves.map(withNumbers);
  for (const line of lines) {
    line.chip = add(legend, 'button', 'chip');
    line.chip.type = 'button';
    line.chip.title = 'show or hide';
    line.chip.setAttribute('aria-pressed', 'true');
    add(line.chip, 'i', line.dash === 'point' ? 'point' : `stroke ${line.dash}`);
    line.chip.append(line.name);
    line.number = add(line.chip, 'output', '');
    line.chip.onclick = () => {
      line.hidden = !line.hidden;
      line.chip.setAttribute('aria-pressed', String(!line.hidden));
      draw(chart);
    };
  }
  const levels = spec.levels.map((level) => ({ ...level, chip: add(legend, 'span', '') }));
  for (const { name, dash, chip } of levels) { add(chip, 'i', `stroke ${dash}`); chip.append(name); }
  const canvas = add(chart.place, 'canvas', '');
  canvas.setAttribute('role', 'img');
  canvas.setAttribute('aria-label', `${spec.label} over ${chart.spec.x_label}`);
  return { spec, canvas, lines, levels, unit: unitOf(spec.label) };
}

function wholeOf({ spec, panels }) {
  if (spec.limits) return spec.limits;
  let low = Infinity, high = -Infinity;
  for (const { lines } of panels) for (const { x } of lines) for (const value of x) { low = Math.min(low, value); high = Math.max(high, value); }
  if (!(low < high)) return isFinite(low) ? [low - 0.5, low + 0.5] : [0, 1];
  return [low, high];
}

// ---- drawing

function colourOf(name) { // lighter on dark paper; grey stays behind, where it can still be read
  if (!dark.matches) return name;
  const part = (place) => parseInt(name.slice(place, place + 2), 16), lighter = part(1) === part(3) ? 0.27 : 0.42;
  return `rgb(${[1, 3, 5].map((place) => Math.round(part(place) + lighter * (255 - part(place)))).join(',')})`;
}

function draw(chart) {
  if (chart.waiting) return;
  chart.waiting = true;
  (document.hidden ? (now) => now() : requestAnimationFrame)(() => { chart.waiting = false; paintChart(chart); });
}

function paintChart(chart) {
  const style = getComputedStyle(root), ink = (name) => style.getPropertyValue(name);
  const width = Math.max(200, chart.place.clientWidth), { x_label } = chart.spec;
  for (const panel of chart.panels) paintPanel(chart, panel, width, ink);
  const rising = chart.panels.some(({ lines }) => lines.some((line) => line.rising));
  chart.reading.textContent = chart.spike === null || !rising ? '' : `${x_label.replace(/ \([^()]*\)$/, '')} ${written(chart.spike, chart.shown[1] - chart.shown[0])} ${unitOf(x_label)}`;
}

function verticalOf({ spec, lines }, from, to) {
  let low = Infinity, high = -Infinity;
  const take = (value) => { if (value < low) low = value; if (value > high) high = value; };
  for (const { x, y, hidden } of lines)
    if (!hidden) for (let place = 0; place < x.length; place += 1) if (x[place] >= from && x[place] <= to) take(y[place]);
  for (const { value } of spec.levels) { take(value); take(-value); }
  spec.least.forEach(take);
  if (spec.log) {
    if (!(high > 0)) return [-1, 1];
    low = Math.log10(Math.max(low > 0 ? low : high * 1e-4, high * 1e-6)); high = Math.log10(high);
  }
  if (!isFinite(low + high)) return [0, 1];
  if (!(low < high)) { low -= Math.abs(low) * 0.5 || 0.5; high += Math.abs(high) * 0.5 || 0.5; }
  const room = 0.05 * (high - low);
  return [low - room, high + room];
}

function paintPanel(chart, panel, width, ink) {
  const { spec, canvas, lines, levels } = panel, last = panel === chart.panels[chart.panels.length - 1];
  const ratio = devicePixelRatio || 1, below = last ? BOTTOM : 6;
  const height = Math.round((width < NARROW ? LOW_HEIGHT : HEIGHT) * spec.share) + below;
  canvas.width = Math.round(width * ratio); canvas.height = Math.round(height * ratio);
  canvas.style.height = `${height}px`;
  const paint = canvas.getContext('2d');
  paint.setTransform(ratio, 0, 0, ratio, 0, 0);
  paint.font = '12px system-ui, sans-serif';
  const [from, to] = chart.shown, [low, high] = verticalOf(panel, from, to);
  const right = width - RIGHT, bottom = height - (last ? BOTTOM : 4);
  const x = (value) => LEFT + ((right - LEFT) * (value - from)) / (to - from);
  const down = (value) => bottom - ((bottom - TOP) * (value - low)) / (high - low), y = (value) => down(spec.log ? Math.log10(value) : value);
  const area = { x, y, down, right, bottom, low, high, last, ink };
  paintFrame(paint, chart, spec, area);
  paint.save();
  paint.beginPath(); paint.rect(LEFT, 0, right - LEFT, bottom + 1); paint.clip();
  for (const line of lines) if (!line.hidden) (line.dash === 'point' ? paintDots : paintCurve)(paint, line, area, chart.shown);
  paintLevels(paint, levels, area);
  if (chart.spike !== null) {
    const at = Math.round(x(chart.spike)) + 0.5;
    paint.strokeStyle = ink('--ink'); stroke(paint, at, 0, at, bottom);
  }
  if (chart.dragged) {
    const [begin, end] = chart.dragged.map(x);
    paint.globalAlpha = 0.2; paint.fillStyle = ink('--ink'); paint.fillRect(begin, 0, end - begin, bottom); paint.globalAlpha = 1;
  }
  paint.restore();
  for (const { chip, colour } of [...lines, ...levels]) chip.style.color = colourOf(colour);
  for (const line of lines) {
    const found = chart.live ? [line.latest] : chart.spike === null ? [] : valuesAt(line, chart.spike);
    const texts = new Set(found.map((value) => written(value, high - low, spec.log)));
    line.number.textContent = texts.size ? ` ${[...texts].join(' … ')} ${panel.unit}` : '';
  }
}

function paintFrame(paint, chart, spec, { x, down, right, bottom, low, high, last, ink }) {
  const [from, to] = chart.shown, width = right + RIGHT;
  for (let across = LEFT; chart.shade && across < right; across += 1) {
    const share = valuesAt(chart.shade, from + ((across - LEFT) * (to - from)) / (right - LEFT)).pop();
    paint.fillStyle = colourOf(chart.shade.colour);
    paint.globalAlpha = chart.spec.shading * (share || 0);
    paint.fillRect(across, TOP, 1, bottom - TOP);
  }
  paint.globalAlpha = 1;
  paint.strokeStyle = ink('--line'); paint.fillStyle = ink('--quiet'); paint.lineWidth = 1;
  paint.textAlign = 'right'; paint.textBaseline = 'middle';
  for (const value of ticksOf(low, high, Math.max(3, (bottom - TOP) / 42), spec.log)) {
    const y = Math.round(down(value)) + 0.5;
    stroke(paint, LEFT, y, right, y);
    paint.fillText(Number(spec.log ? (10 ** value).toPrecision(2) : value.toPrecision(6)), LEFT - 6, y);
  }
  paint.textBaseline = 'top';
  for (const tick of ticksOf(from, to, width / 90)) {
    const at = Math.round(x(tick)) + 0.5, edge = at > right - 8; // of the page, where the number is whole too
    if (at < LEFT || at > right + 1) continue;
    stroke(paint, at, TOP, at, bottom);
    paint.textAlign = edge ? 'right' : 'center';
    if (last) paint.fillText(Number(tick.toPrecision(8)), edge ? width : at, bottom + 4);
  }
  paint.textAlign = 'center';
  if (last) paint.fillText(chart.spec.x_label, (LEFT + right) / 2, bottom + 20);
}

function stroke(paint, x0, y0, x1, y1) { paint.beginPath(); paint.moveTo(x0, y0); paint.lineTo(x1, y1); paint.stroke(); }

function paintLevels(paint, levels, { y, right }) {
  for (const { value, dash, colour } of levels) {
    paint.strokeStyle = colourOf(colour); paint.lineWidth = 1;
    paint.setLineDash(DASHES[dash]);
    for (const each of [value, -value]) stroke(paint, LEFT, y(each), right, y(each));
    paint.setLineDash([]);
  }
}

function paintCurve(paint, curve, area, [from, to]) {
  paint.strokeStyle = colourOf(curve.colour);
  paint.lineWidth = 1.6; paint.lineJoin = 'round';
  paint.setLineDash(DASHES[curve.dash]);
  paint.beginPath();
  const { x, y, rising } = curve, begin = rising ? Math.max(0, placeOf(x, from) - 2) : 0;
  const end = rising ? Math.min(x.length, placeOf(x, to) + 2) : x.length;
  let drawn = false, column = NaN, highest = 0, lowest = 0;
  for (let place = begin; place < end; place += 1) {
    if (isNaN(y[place])) { drawn = false; continue; }
    const across = area.x(x[place]), down = area.y(y[place]);
    if (!drawn) paint.moveTo(across, down);
    else if (rising && Math.floor(across) === column && down >= highest && down <= lowest) continue; // covered in this column of pixels
    else paint.lineTo(across, down);
    if (Math.floor(across) !== column || !drawn) { column = Math.floor(across); highest = lowest = down; }
    highest = Math.min(highest, down); lowest = Math.max(lowest, down);
    drawn = true;
  }
  paint.stroke();
  paint.setLineDash([]);
}

function paintDots(paint, dots, { x, y, bottom }) {
  paint.fillStyle = paint.strokeStyle = colourOf(dots.colour);
  dots.x.forEach((value, place) => {
    const across = x(value), down = y(dots.y[place]);
    paint.globalAlpha = 0.35; stroke(paint, across, down, across, bottom); paint.globalAlpha = 1;
    paint.beginPath(); paint.arc(across, down, 4, 0, 2 * Math.PI); paint.fill();
  });
}

const redraw = () => charts.forEach(draw);
dark.addEventListener('change', redraw);
window.addEventListener('resize', redraw);
