// ---- mouse, touch and keys

function xAt(chart, event) {
  const box = chart.panels[0].canvas.getBoundingClientRect(), [from, to] = chart.shown;
  const share = (event.clientX - box.left - LEFT) / (box.width - LEFT - RIGHT);
  return from + Math.min(1, Math.max(0, share)) * (to - from);
}

function listen(chart) {
  const { place } = chart, fingers = new Map();
  let before = null;
  place.addEventListener('pointerdown', (event) => {
    if (event.target.tagName !== 'CANVAS' || event.button > 0) return;
    event.target.setPointerCapture(event.pointerId);
    fingers.set(event.pointerId, event.clientX);
    before = { shown: chart.shown, x: event.clientX, at: xAt(chart, event), moves: event.pointerType !== 'mouse' || event.shiftKey };
    if (fingers.size === 2) before.fingers = [...fingers.values()];
  });
  place.addEventListener('pointermove', (event) => {
    if (event.target.tagName !== 'CANVAS') return;
    if (fingers.has(event.pointerId)) fingers.set(event.pointerId, event.clientX);
    if (fingers.size === 2 && before.fingers) return pinch(chart, before, [...fingers.values()]);
    if (fingers.size !== 1) return read(chart, xAt(chart, event));
    if (before.moves) {
      const wide = chart.panels[0].area.right - LEFT, by = ((before.x - event.clientX) / wide) * (before.shown[1] - before.shown[0]);
      return show(chart, before.shown[0] + by, before.shown[1] + by);
    }
    chart.dragged = [before.at, xAt(chart, event)].sort((a, b) => a - b);
    return read(chart, xAt(chart, event));
  });
  const lift = (event) => {
    if (!fingers.delete(event.pointerId)) return;
    const dragged = chart.dragged;
    chart.dragged = null;
    const far = Math.abs(event.clientX - before.x) > 5;
    if (dragged && far && event.type === 'pointerup') show(chart, dragged[0], dragged[1]);
    else if (!far && event.type === 'pointerup') read(chart, xAt(chart, event));
  };
  place.addEventListener('pointerup', lift);
  place.addEventListener('pointercancel', lift);
  place.addEventListener('pointerleave', (event) => { if (event.pointerType === 'mouse' && !fingers.size) read(chart, null); });
  place.addEventListener('dblclick', (event) => { if (event.target.tagName === 'CANVAS') show(chart, ...chart.whole); });
  place.addEventListener('wheel', (event) => {
    if (!event.ctrlKey && !event.shiftKey) return; // the page scrolls
    event.preventDefault();
    zoom(chart, Math.exp(0.003 * (event.deltaY || event.deltaX)), xAt(chart, event));
  }, { passive: false });
  place.addEventListener('keydown', (event) => press(chart, event));
}

function pinch(chart, before, fingers) {
  const apart = (places) => Math.max(20, Math.abs(places[0] - places[1]));
  const factor = apart(before.fingers) / apart(fingers), [from, to] = before.shown;
  show(chart, before.at - (before.at - from) * factor, before.at + (to - before.at) * factor);
}

function press(chart, event) {
  if (event.target !== chart.place || event.ctrlKey || event.metaKey || event.altKey) return;
  const [from, to] = chart.shown, spike = chart.spike === null ? (from + to) / 2 : chart.spike;
  const acts = {
    ArrowLeft: () => (event.shiftKey ? read(chart, Math.max(from, spike - (to - from) / 200)) : pan(chart, -0.2)),
    ArrowRight: () => (event.shiftKey ? read(chart, Math.min(to, spike + (to - from) / 200)) : pan(chart, 0.2)),
    '+': () => zoom(chart, 0.5), '=': () => zoom(chart, 0.5), '-': () => zoom(chart, 2),
    0: () => show(chart, ...chart.whole), Escape: () => read(chart, null),
  };
  if (!acts[event.key]) return;
  event.preventDefault();
  acts[event.key]();
}

// A number that links to its trace shows the stretch that it is from, and marks the moment.
document.addEventListener('click', (event) => {
  const link = event.target.closest('a[data-at]');
  const chart = link && charts.find((each) => `#${each.place.dataset.chart}` === link.dataset.chart);
  if (!chart) return;
  event.preventDefault();
  const at = Number(link.dataset.at), around = Number(link.dataset.around);
  show(chart, at - around, at + around);
  read(chart, at);
  chart.place.scrollIntoView({ block: 'center' });
  chart.place.focus({ preventScroll: true });
});

// ---- begin: one chart after the other, so that the page answers meanwhile

const waiting = [...document.querySelectorAll('.figure')];
function buildNext() {
  const next = waiting.shift();
  if (next === undefined) { root.dataset.ready = 'yes'; return; }
  try {
    build(next);
    root.dataset.drawn = Number(root.dataset.drawn) + 1;
  } catch (error) {
    root.dataset.error = String(error);
    next.textContent = `This chart could not be drawn: ${error}`;
  }
  setTimeout(buildNext, 0);
}
buildNext();

const redraw = () => charts.forEach(draw);
dark.addEventListener('change', redraw);
window.addEventListener('resize', redraw);
window.addEventListener('beforeprint', () => {
  printing = true;
  for (const each of document.querySelectorAll('details')) each.open = true;
  charts.forEach(paintChart);
});
window.addEventListener('afterprint', () => { printing = false; redraw(); });
