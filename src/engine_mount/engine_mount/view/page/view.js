'use strict';
// Draws what the stream tells: each interval carries the least and the highest value of each line.

const HEIGHTS = { displacement: 230, damping: 80, current: 130, 'friction force': 130, latency: 90 };
const seen = { intervals: [], panels: [], window: { seconds: 60 }, dirty: false, paused: false, frozen: [] };
const element = (name) => document.getElementById(name);
const dark = window.matchMedia('(prefers-color-scheme: dark)');

function connect() {
  const scheme = location.protocol === 'https:' ? 'wss' : 'ws';
  const stream = new WebSocket(`${scheme}://${location.host}/stream${location.search}`);
  stream.onopen = () => say('connection', '');
  stream.onclose = () => { say('connection', 'the view has ended or is out of reach; trying again ...'); setTimeout(connect, 1000); };
  stream.onmessage = (event) => take(JSON.parse(event.data));
}

function take(told) {
  if (told.title !== undefined) {
    say('title', told.title);
    document.title = told.title;
    seen.window = told.window;
    seen.intervals = [];
  }
  if (told.panels) takePanels(told.panels);
  if (told.state) takeState(told.state);
  seen.intervals.push(...told.intervals);
  const kept = seen.window.seconds * seen.window.per_second;
  if (seen.intervals.length > 1.2 * kept) seen.intervals.splice(0, seen.intervals.length - kept);
  seen.dirty = true;
}

function say(name, text) { element(name).textContent = text; }

function takePanels(panels) {
  const before = JSON.stringify(seen.panels.map((panel) => panel.told));
  if (before === JSON.stringify(panels)) return;
  const place = element('panels');
  place.replaceChildren();
  seen.panels = panels.map((told) => {
    const box = document.createElement('div');
    box.className = 'panel';
    const legend = document.createElement('div');
    legend.className = 'legend';
    const title = document.createElement('b');
    title.textContent = `${told.title}${told.unit === '1' ? '' : ` (${told.unit})`}`;
    legend.append(title);
    const numbers = {};
    for (const line of told.lines) {
      const entry = document.createElement('span');
      const number = document.createElement('i');
      entry.append(`${line.label} `, number);
      entry.dataset.colour = line.colour;
      legend.append(entry);
      numbers[line.key] = number;
    }
    const canvas = document.createElement('canvas');
    canvas.setAttribute('role', 'img');
    canvas.setAttribute('aria-label', `${told.title} over time`);
    box.append(legend, canvas);
    place.append(box);
    return { told, canvas, numbers, legend, height: HEIGHTS[told.title] || 110 };
  });
}

function takeState(state) {
  element('nodes').replaceChildren(...state.nodes.map((node) => {
    const item = document.createElement('li');
    const name = document.createElement('b');
    name.className = node.level;
    name.textContent = `${node.name} `;
    item.append(name, `${node.state ? `${node.state}: ` : ''}${node.sentence}`);
    return item;
  }));
  element('values').replaceChildren(...state.values.map(({ name, value }) => {
    const row = document.createElement('tr');
    for (const text of [name, value]) row.insertCell().textContent = text;
    return row;
  }));
  element('events').replaceChildren(...state.events.map((event) => {
    const item = document.createElement('li');
    item.textContent = `${event.time.toFixed(2)} s  ${event.kind}: ${event.text}`;
    return item;
  }));
}

function lighter(colour) {
  if (!dark.matches) return colour || '#333333';
  const part = (place) => parseInt((colour || '#cccccc').slice(place, place + 2), 16);
  return `rgb(${[1, 3, 5].map((place) => Math.round(part(place) + 0.45 * (255 - part(place)))).join(',')})`;
}

function niceStep(span, count) {
  const rough = span / count, power = 10 ** Math.floor(Math.log10(rough));
  return power * [1, 2, 5, 10].find((factor) => factor * power >= rough);
}

function draw() {
  requestAnimationFrame(draw);
  if (!seen.dirty || document.hidden) return;
  seen.dirty = false;
  const shown = seen.paused ? seen.frozen : seen.intervals;
  const end = shown.length ? shown[shown.length - 1][1] : 0;
  const span = Number(element('span').value);
  const begin = end - span;
  const first = shown.findIndex((interval) => interval[1] >= begin);
  const visible = first < 0 ? [] : shown.slice(Math.max(0, first - 1));
  for (const panel of seen.panels) drawPanel(panel, visible, begin, end);
}

function extentOf(panel, visible) {
  let low = Infinity, high = -Infinity;
  for (const [, , values] of visible) for (const { key } of panel.told.lines) {
    const pair = values[key];
    if (pair) { low = Math.min(low, pair[0]); high = Math.max(high, pair[1]); }
  }
  if (panel.told.title === 'damping') return [-0.05, 1.05];
  if (panel.told.title !== 'displacement' && panel.told.title !== 'friction force') low = Math.min(low, 0);
  if (!(low < high)) { low = Math.min(low, 0); high = Math.max(high, 0); if (!isFinite(low + high)) { low = 0; high = 1; } }
  const room = 0.06 * (high - low) || 0.1;
  return [low - room, high + room];
}

function drawPanel(panel, visible, begin, end) {
  const { canvas, told, height } = panel;
  const ratio = window.devicePixelRatio || 1, width = canvas.clientWidth;
  if (canvas.width !== Math.round(width * ratio) || canvas.height !== Math.round(height * ratio)) {
    canvas.width = Math.round(width * ratio);
    canvas.height = Math.round(height * ratio);
    canvas.style.height = `${height}px`;
  }
  const paint = canvas.getContext('2d'), style = getComputedStyle(document.documentElement);
  const left = 46, bottom = height - 18, top = 4, right = width - 6;
  const [low, high] = extentOf(panel, visible);
  const x = (time) => left + (right - left) * (time - begin) / (end - begin || 1);
  const y = (value) => bottom - (bottom - top) * (value - low) / (high - low);
  paint.setTransform(ratio, 0, 0, ratio, 0, 0);
  paint.clearRect(0, 0, width, height);
  paint.font = '11px system-ui, sans-serif';
  paint.strokeStyle = style.getPropertyValue('--line');
  paint.fillStyle = style.getPropertyValue('--quiet');
  paint.lineWidth = 1;
  const stepY = niceStep(high - low, height / 45);
  paint.textAlign = 'right';
  for (let value = Math.ceil(low / stepY) * stepY; value <= high; value += stepY) {
    horizontal(paint, left, right, y(value));
    paint.fillText(Number(value.toPrecision(6)), left - 5, y(value) + 4);
  }
  const stepX = niceStep(end - begin, width / 110);
  paint.textAlign = 'center';
  for (let time = Math.ceil(begin / stepX) * stepX; time <= end; time += stepX)
    if (time >= 0 && x(time) < right - 10) paint.fillText(`${Number(time.toPrecision(8))} s`, x(time), height - 5);
  for (const level of told.levels || []) {
    paint.setLineDash([5, 4]);
    paint.strokeStyle = style.getPropertyValue('--warning');
    for (const value of [level.value, -level.value]) if (value > low && value < high) horizontal(paint, left, right, y(value));
    paint.setLineDash([]);
    paint.textAlign = 'left';
    paint.fillStyle = style.getPropertyValue('--warning');
    if (level.value < high) paint.fillText(level.label, left + 4, y(level.value) - 3);
  }
  paint.save();
  paint.beginPath();
  paint.rect(left, 0, right - left, bottom + 1);
  paint.clip();
  // What is measured is drawn last, above all that stands beside it.
  for (const line of [...told.lines].reverse()) drawLine(paint, visible, line, x, y);
  paint.restore();
  for (const entry of panel.legend.querySelectorAll('span')) entry.style.color = lighter(entry.dataset.colour);
  const last = visible.length ? visible[visible.length - 1][2] : {};
  for (const [key, number] of Object.entries(panel.numbers)) if (last[key]) number.textContent = Number(last[key][1].toPrecision(3));
}

function horizontal(paint, left, right, y) {
  paint.beginPath();
  paint.moveTo(left, Math.round(y) + 0.5);
  paint.lineTo(right, Math.round(y) + 0.5);
  paint.stroke();
}

function drawLine(paint, visible, line, x, y) {
  paint.strokeStyle = paint.fillStyle = lighter(line.colour);
  paint.globalAlpha = line.key.startsWith('beside.') ? 0.75 : 1;
  paint.lineWidth = line.key.startsWith('beside.') ? 1 : 1.5;
  paint.beginPath();
  // Where much is missing at once no line is drawn: a viewer that was held up has seen nothing there.
  const usual = visible.length > 1 ? (visible[visible.length - 1][1] - visible[0][1]) / (visible.length - 1) : 0;
  let drawn = -Infinity;  // time of the last value, s
  for (const [, time, values] of visible) {
    const pair = values[line.key];
    if (!pair) { drawn = -Infinity; continue; }
    const place = x(time);
    if (time - drawn < 5 * usual) paint.lineTo(place, y(pair[0])); else paint.moveTo(place, y(pair[0]));
    paint.lineTo(place, y(pair[1]));
    drawn = time;
  }
  paint.stroke();
  paint.globalAlpha = 1;
}

element('pause').onclick = () => {
  seen.paused = !seen.paused;
  seen.frozen = seen.intervals.slice();
  element('pause').setAttribute('aria-pressed', seen.paused);
  element('pause').textContent = seen.paused ? 'go on' : 'pause';
  seen.dirty = true;
};
element('mark').onclick = async () => {
  try {
    const answer = await fetch(`mark${location.search}`, { method: 'POST' });
    say('answer', (await answer.json()).answer);
  } catch (error) {
    say('answer', 'no mark was set: the view is out of reach');
  }
  setTimeout(() => say('answer', ''), 5000);
};
element('span').onchange = () => { seen.dirty = true; };
dark.onchange = () => { seen.dirty = true; };
window.onresize = () => { seen.dirty = true; };
document.onkeydown = (event) => { if (event.key === 'm') element('mark').click(); if (event.key === ' ' && event.target === document.body) { event.preventDefault(); element('pause').click(); } };
connect();
draw();
