// Draws what the stream brings: each interval carries the least and the highest value of each line.

const seen = { intervals: [], frozen: null, window: {}, data: '', chart: null };
const element = (name) => document.getElementById(name);
const say = (name, text) => { element(name).textContent = text; };

function connect() {
  const scheme = location.protocol === 'https:' ? 'wss' : 'ws';
  const stream = new WebSocket(`${scheme}://${location.host}/stream${location.search}`);
  stream.onopen = () => say('connection', '');
  stream.onclose = () => { say('connection', 'the view has ended or is out of reach; trying again ...'); setTimeout(connect, 1000); };
  stream.onmessage = (event) => take(JSON.parse(event.data));
}

function take(data) {
  if (data.title !== undefined) {
    say('title', data.title);
    document.title = data.title;
    seen.window = data.window;
    seen.intervals = [];
  }
  if (data.chart) takeChart(data.chart);
  if (data.state) takeState(data.state);
  seen.intervals.push(...data.intervals);
  const kept = seen.window.seconds * seen.window.per_second;
  if (seen.intervals.length > 1.2 * kept) seen.intervals.splice(0, seen.intervals.length - kept);
  show();
}

function takeChart(data) {
  const text = JSON.stringify(data);
  if (text === seen.data) return;
  seen.data = text;
  charts.length = 0;
  seen.chart = Object.assign(build(element('panels'), data), { live: true });
}

function takeState({ nodes, values, events, end }) {
  say('connection', end);
  for (const name of ['nodes', 'values', 'events']) element(name).replaceChildren();
  for (const { name, level, state, sentence } of nodes) {
    const item = add(element('nodes'), 'li', '');
    add(item, 'b', level, `${name} `);
    item.append(state ? `${state}: ${sentence}` : sentence);
  }
  for (const { name, value } of values) {
    const row = add(element('values'), 'tr', '');
    for (const text of [name, value]) add(row, 'td', '', text);
  }
  for (const { time, kind, text } of events) add(element('events'), 'li', '', `${time.toFixed(2)} s  ${kind}: ${text}`);
}

function show() {
  if (!seen.chart || document.hidden) return;
  const known = seen.frozen || seen.intervals, end = known.length ? known[known.length - 1][1] : 0;
  const begin = Math.max(end - Number(element('span').value), known.length ? known[0][1] : 0);
  const visible = known.filter(([, time]) => time >= begin);
  for (const { spec, lines } of seen.chart.panels) lines.forEach((line, place) => fill(line, spec.curves[place].key, visible));
  seen.chart.shown = [begin, Math.max(end, begin + 1)];
  draw(seen.chart);
}

function fill(line, key, intervals) {
  Object.assign(line, { x: [], y: [], rising: true, latest: undefined });
  let before = NaN;
  for (const [number, time, values] of intervals) {
    const pair = values[key];
    // Where intervals are missing no line is drawn: a viewer that was held up has seen nothing there.
    if (!pair || number !== before + 1) { line.x.push(time); line.y.push(NaN); }
    if (pair) { line.x.push(time, time); line.y.push(...pair); [, line.latest] = pair; }
    before = number;
  }
}

element('pause').onclick = () => {
  seen.frozen = seen.frozen ? null : seen.intervals.slice();
  element('pause').setAttribute('aria-pressed', String(seen.frozen !== null));
  say('pause', seen.frozen ? 'go on' : 'pause');
  show();
};
element('span').onchange = show;
document.onvisibilitychange = show;
document.onkeydown = (event) => {
  if (event.key === ' ' && event.target === document.body) { event.preventDefault(); element('pause').click(); }
};
connect();
