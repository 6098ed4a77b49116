// ---- drawing

function colourOf(name) { // lighter on dark paper; grey stays behind, where it can still be read
  if (!dark.matches || printing) return name;
  const part = (place) => parseInt(name.slice(place, place + 2), 16), lighter = part(1) === part(3) ? 0.27 : 0.42;
  return `rgb(${[1, 3, 5].map((place) => Math.round(part(place) + lighter * (255 - part(place)))).join(',')})`;
}

function draw(chart) {
  if (chart.waiting) return;
  chart.waiting = true;
  (document.hidden || printing ? (now) => now() : requestAnimationFrame)(() => { chart.waiting = false; paintChart(chart); });
}

function paintChart(chart) {
  const style = getComputedStyle(root), ink = (name) => (printing ? { '--ink': '#222', '--quiet': '#666', '--line': '#ddd', '--paper': '#fff' }[name] : style.getPropertyValue(name));
  const width = Math.max(200, chart.place.clientWidth);
  for (const panel of chart.panels) paintPanel(chart, panel, width, ink);
  const unit = (chart.told.x_label.match(/\(([^()]*)\)\s*$/) || ['', ''])[1];
  const span = chart.shown[1] - chart.shown[0];
  const rising = chart.panels.some(({ told }) => told.curves.some((curve) => curve.levels || curve.rising) || told.dots.length);
  chart.reading.textContent = chart.spike === null || !rising ? '' : `${chart.told.x_label.replace(/ \([^()]*\)$/, '')} ${written(chart.spike, span)} ${unit}`;
}

function verticalOf(panel, from, to) {
  const { told } = panel;
  let low = Infinity, high = -Infinity;
  for (const line of [...told.curves, ...told.dots]) {
    if (line.hidden) continue;
    const [least, most] = extent(line, from, to);
    low = Math.min(low, least); high = Math.max(high, most);
  }
  for (const level of told.levels) { high = Math.max(high, level.value); low = Math.min(low, level.both ? -level.value : level.value); }
  if (told.log) {
    if (!(high > 0)) return [-1, 1];
    low = Math.log10(Math.max(low > 0 ? low : high * 1e-4, high * 1e-6)); high = Math.log10(high);
  }
  if (!isFinite(low + high)) return [0, 1];
  if (!(low < high)) { low -= Math.abs(low) * 0.5 || 0.5; high += Math.abs(high) * 0.5 || 0.5; }
  const room = 0.05 * (high - low);
  return [low - room, high + room];
}

function paintPanel(chart, panel, width, ink) {
  const { told, canvas } = panel, last = panel === chart.panels[chart.panels.length - 1];
  const ratio = printing ? 2 : devicePixelRatio || 1;
  const height = Math.round((width < NARROW ? LOW_HEIGHT : HEIGHT) * told.share) + (last ? BOTTOM + 14 : 6);
  canvas.width = Math.round(width * ratio); canvas.height = Math.round(height * ratio);
  canvas.style.height = `${height}px`;
  const paint = canvas.getContext('2d');
  paint.setTransform(ratio, 0, 0, ratio, 0, 0);
  paint.font = '12px system-ui, sans-serif';
  const [from, to] = chart.shown, right = width - RIGHT, bottom = height - (last ? BOTTOM + 14 : 4);
  const [low, high] = verticalOf(panel, from, to);
  const area = { left: LEFT, right, bottom, top: TOP };
  area.x = (x) => LEFT + ((right - LEFT) * (x - from)) / (to - from);
  area.y = (y) => bottom - ((bottom - TOP) * ((told.log ? Math.log10(y) : y) - low)) / (high - low);
  panel.area = area;
  paintFrame(paint, chart, panel, area, [low, high], last, width, ink);
  paint.save();
  paint.beginPath(); paint.rect(LEFT, 0, right - LEFT, bottom + 1); paint.clip();
  for (const curve of told.curves) if (!curve.hidden) paintCurve(paint, curve, chart, area);
  for (const dots of told.dots) if (!dots.hidden) paintDots(paint, dots, area);
  paintLevels(paint, told, area, ink);
  if (chart.spike !== null && chart.spike >= from && chart.spike <= to) paintSpike(paint, area, chart.spike, ink);
  if (chart.dragged) {
    const [begin, end] = chart.dragged.map(area.x);
    paint.globalAlpha = 0.2; paint.fillStyle = ink('--ink'); paint.fillRect(begin, 0, end - begin, bottom); paint.globalAlpha = 1;
  }
  paint.restore();
  writeNumbers(chart, panel, high - low);
}

function paintFrame(paint, chart, panel, area, [low, high], last, width, ink) {
  const { told } = panel, [from, to] = chart.shown, { left, right, top, bottom } = area;
  paint.fillStyle = colourOf(chart.told.span_colour);
  paint.globalAlpha = 0.15;
  for (const [begin, end] of chart.told.spans) {
    const first = Math.max(left, area.x(begin)), wide = Math.min(right, area.x(end)) - first;
    if (wide > 0) paint.fillRect(first, top, wide, bottom - top);
  }
  paint.globalAlpha = 1;
  paint.strokeStyle = ink('--line'); paint.fillStyle = ink('--quiet'); paint.lineWidth = 1;
  paint.textAlign = 'right'; paint.textBaseline = 'middle';
  const step = told.log && high - low > 1 ? Math.ceil((high - low) / 6) : niceStep(high - low, Math.max(3, (bottom - top) / 42));
  for (let place = Math.ceil(low / step); place * step <= high; place += 1) {
    const y = Math.round(bottom - ((bottom - top) * (place * step - low)) / (high - low)) + 0.5;
    line(paint, left, y, right, y);
    paint.fillText(told.log ? Number((10 ** (place * step)).toPrecision(2)) : Number((place * step).toPrecision(6)), left - 6, y);
  }
  const stepX = niceStep(to - from, width / 90);
  const ticks = chart.told.ticks.length && chart.told.ticks.length < width / 40 ? chart.told.ticks : [];
  if (!ticks.length) for (let place = Math.ceil(from / stepX); place * stepX <= to; place += 1) ticks.push(place * stepX);
  paint.textAlign = 'center'; paint.textBaseline = 'top';
  for (const tick of ticks) {
    const x = Math.round(area.x(tick)) + 0.5;
    if (x < left || x > right + 1) continue;
    line(paint, x, top, x, bottom);
    paint.textAlign = x > right - 8 ? 'right' : 'center'; // whole at the edge of the page too
    if (last) paint.fillText(Number(tick.toPrecision(8)), x > right - 8 ? right + RIGHT : x, bottom + 4);
  }
  paint.textAlign = 'center';
  if (last) paint.fillText(chart.told.x_label, (left + right) / 2, bottom + 20);
}

function line(paint, x0, y0, x1, y1) { paint.beginPath(); paint.moveTo(x0, y0); paint.lineTo(x1, y1); paint.stroke(); }

function paintLevels(paint, told, area, ink) {
  paint.textAlign = 'left'; paint.textBaseline = 'bottom';
  for (const level of told.levels) {
    paint.strokeStyle = paint.fillStyle = colourOf(level.colour);
    paint.setLineDash(level.dash === 'dot' ? [2, 3] : [7, 4]);
    for (const value of level.both ? [level.value, -level.value] : [level.value]) line(paint, area.left, area.y(value), area.right, area.y(value));
    paint.setLineDash([]);
    paint.strokeStyle = ink('--paper'); paint.lineWidth = 3; paint.globalAlpha = 0.8;
    paint.strokeText(level.name, area.left + 4, area.y(level.value) - 1);
    paint.lineWidth = 1; paint.globalAlpha = 1;
    paint.fillText(level.name, area.left + 4, area.y(level.value) - 1);
  }
}

function paintCurve(paint, curve, chart, area) {
  const [from, to] = chart.shown;
  paint.strokeStyle = colourOf(curve.colour);
  paint.lineWidth = curve.width; paint.lineJoin = 'round';
  paint.setLineDash(curve.dash === 'dash' ? [6, 4] : curve.dash === 'dot' ? [2, 3] : []);
  paint.beginPath();
  if (curve.levels) traceLevels(paint, curve, from, to, area); else tracePoints(paint, curve, area);
  paint.stroke();
  paint.setLineDash([]);
}

function traceLevels(paint, curve, from, to, area) {
  const { lows, highs, step } = levelFor(curve, (to - from) / (area.right - area.left));
  const plain = lows === highs, middle = plain ? 0 : 0.5 * step;
  const first = Math.max(0, Math.floor((from - curve.begin) / step) - 1);
  const last = Math.min(lows.length - 1, Math.ceil((to - curve.begin) / step) + 1);
  let drawn = false, before = 0;
  for (let place = first; place <= last; place += 1) {
    const least = lows[place], most = highs[place];
    if (isNaN(least)) { drawn = false; continue; }
    const x = area.x(curve.begin + place * step + middle), low = area.y(least);
    if (!drawn) paint.moveTo(x, low);
    else { if (curve.steps && plain) paint.lineTo(x, before); paint.lineTo(x, low); }
    if (!plain && most > least) paint.lineTo(x, area.y(most));
    before = low; drawn = true;
  }
}

function tracePoints(paint, curve, area) {
  let drawn = false, before = 0;
  for (let place = 0; place < curve.x.length; place += 1) {
    if (isNaN(curve.y[place])) { drawn = false; continue; }
    const x = area.x(curve.x[place]), y = area.y(curve.y[place]);
    if (!drawn) paint.moveTo(x, y);
    else { if (curve.steps) paint.lineTo(x, before); paint.lineTo(x, y); }
    before = y; drawn = true;
  }
}

function paintDots(paint, dots, area) {
  paint.fillStyle = paint.strokeStyle = colourOf(dots.colour);
  for (let place = 0; place < dots.x.length; place += 1) {
    const x = area.x(dots.x[place]), y = area.y(dots.y[place]);
    paint.globalAlpha = 0.35; line(paint, x, y, x, area.bottom); paint.globalAlpha = 1;
    paint.beginPath(); paint.arc(x, y, 4, 0, 2 * Math.PI); paint.fill();
  }
}

function paintSpike(paint, area, spike, ink) {
  const x = Math.round(area.x(spike)) + 0.5;
  paint.strokeStyle = ink('--ink'); paint.lineWidth = 1;
  line(paint, x, 0, x, area.bottom);
}

function writeNumbers(chart, panel, span) {
  for (const line of [...panel.told.curves, ...panel.told.dots]) {
    line.chip.style.color = colourOf(line.colour);
    const found = chart.spike === null ? null : valueAt(line, chart.spike);
    const text = (value) => written(value, span, panel.told.log);
    line.number.textContent = found === null ? '' : ` ${text(found[0])}${text(found[1]) === text(found[0]) ? '' : ` … ${text(found[1])}`} ${panel.unit}`;
  }
}
