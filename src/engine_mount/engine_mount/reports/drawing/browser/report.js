// Mouse, touch and keys of a report; data-drawn of the root counts its charts, data-ready ends that.

const AROUND = 0.5; // s, chosen: shown to either side of what a number links to

function show(chart, from, to) { // at most all of it, at least a ten-thousandth
  const [low, high] = chart.whole, span = Math.min(high - low, Math.max(to - from, (high - low) / 1e4));
  const begin = Math.min(Math.max(low, (from + to - span) / 2), high - span);
  chart.shown = [begin, begin + span];
  draw(chart);
}

function read(chart, x) { // one line through all panels over the same axis
  for (const other of charts) {
    if (other !== chart && !(other.spec.x_label === chart.spec.x_label && chart.spec.x_label.startsWith('time'))) continue;
    if (x !== null || other.spike !== null) { other.spike = x; draw(other); }
  }
}

function listen(chart) {
  const { place } = chart;
  const at = (event) => {
    const box = chart.panels[0].canvas.getBoundingClientRect(), [from, to] = chart.shown;
    return Math.min(to, Math.max(from, from + ((to - from) * (event.clientX - box.left - LEFT)) / (box.width - LEFT - RIGHT)));
  };
  const onCanvas = (kind, act) => place.addEventListener(kind, (event) => { if (event.target.tagName === 'CANVAS') act(event); });
  let begun = null;
  onCanvas('pointerdown', (event) => {
    if (event.button > 0) return;
    event.target.setPointerCapture(event.pointerId);
    begun = { at: at(event), x: event.clientX };
  });
  onCanvas('pointermove', (event) => {
    if (begun) chart.dragged = [begun.at, at(event)].sort((a, b) => a - b);
    read(chart, at(event));
  });
  const lift = (event) => {
    const { dragged } = chart, far = begun && Math.abs(event.clientX - begun.x) > 5;
    chart.dragged = begun = null;
    if (event.type !== 'pointerup') return;
    if (dragged && far) show(chart, ...dragged);
    else if (!far) read(chart, at(event));
  };
  for (const kind of ['pointerup', 'pointercancel']) onCanvas(kind, lift);
  place.addEventListener('pointerleave', (event) => { if (event.pointerType === 'mouse' && !begun) read(chart, null); });
  onCanvas('dblclick', () => show(chart, ...chart.whole));
  place.addEventListener('keydown', (event) => press(chart, event));
}

function press(chart, event) {
  if (event.target !== chart.place || event.ctrlKey || event.metaKey || event.altKey) return;
  const [from, to] = chart.shown, spike = chart.spike === null ? (from + to) / 2 : chart.spike;
  const move = (first, second) => show(chart, from + first * (to - from), to + second * (to - from));
  const step = (way) => (event.shiftKey ? read(chart, Math.min(to, Math.max(from, spike + (way * (to - from)) / 200))) : move(0.2 * way, 0.2 * way));
  const acts = {
    ArrowLeft: () => step(-1), ArrowRight: () => step(1), '+': () => move(0.25, -0.25), '-': () => move(-0.5, 0.5),
    0: () => show(chart, ...chart.whole), Escape: () => read(chart, null),
  };
  if (!acts[event.key]) return;
  event.preventDefault();
  acts[event.key]();
}

// A number that links to its trace shows the stretch that it is from, and marks the moment.
document.addEventListener('click', (event) => {
  const link = event.target.closest('a[data-at]');
  const chart = link && charts.find((each) => `#${each.place.dataset.chart}` === link.hash);
  if (!chart) return;
  event.preventDefault();
  const at = Number(link.dataset.at);
  show(chart, at - AROUND, at + AROUND);
  read(chart, at);
  chart.place.scrollIntoView({ block: 'center' });
  chart.place.focus({ preventScroll: true });
});
window.addEventListener('beforeprint', () => { for (const each of document.querySelectorAll('details')) each.open = true; });

// One chart after the other, so that the page answers meanwhile.
const waiting = [...document.querySelectorAll('.figure')];
root.dataset.drawn = 0;
(function buildNext() {
  const place = waiting.shift();
  if (place === undefined) { root.dataset.ready = 'yes'; return; }
  try {
    const chart = build(place, JSON.parse(place.nextElementSibling.textContent));
    place.tabIndex = 0;
    place.setAttribute('role', 'group');
    place.setAttribute('aria-label', `${chart.spec.title}: arrow keys move, plus and minus zoom, 0 shows all`);
    listen(chart);
    draw(chart);
    root.dataset.drawn = Number(root.dataset.drawn) + 1;
  } catch (error) {
    root.dataset.error = String(error);
    place.textContent = `This chart could not be drawn: ${error}`;
  }
  setTimeout(buildNext, 0);
}());
