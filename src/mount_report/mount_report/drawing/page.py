"""A report as one HTML page that needs nothing else: no network, no other file."""

import html
import json
from collections.abc import Sequence

from mount_report.drawing.interactive import POINTS, plotly_figure, plotly_script
from mount_report.sections.section import Section, Table

# The page may not load anything from anywhere, whatever a recording's texts say.
_POLICY = "default-src 'none'; script-src 'unsafe-inline'; style-src 'unsafe-inline'; img-src data: blob:"

_STYLE = """
body { font: 15px/1.45 sans-serif; color: #222; max-width: 1000px; margin: 1.5em auto; padding: 0 1em; }
h1 { font-size: 1.5em; margin-bottom: 0; } h2 { font-size: 1.2em; margin: 1.8em 0 .4em; }
nav a { margin-right: 1em; } p { margin: .3em 0; } .figure { margin: .6em 0; overflow-x: auto; }
.tables { overflow-x: auto; } table { border-collapse: collapse; margin: .6em 0; font-size: .87em; }
caption { text-align: left; font-weight: bold; padding: .2em 0; }
th, td { text-align: left; padding: .15em .9em .15em 0; border-bottom: 1px solid #ddd; vertical-align: top;
         overflow-wrap: break-word; font-variant-numeric: tabular-nums; }
tr.marked td { background: #fff3cd; } noscript { color: #b03030; }
@page { size: A4; margin: 12mm; }
@media print {
  body { margin: 0; padding: 0; max-width: none; } nav, .modebar-container { display: none !important; }
  .figure { zoom: 0.69; }
  .figure, tr { break-inside: avoid; } h2 { break-after: avoid; } .figure, .tables { overflow: visible; }
}
"""

# Draws one chart after the other, so that the page answers meanwhile. What goes wrong stands in the page.
_SCRIPT = """
'use strict';
const root = document.documentElement;
root.dataset.drawn = 0;
window.addEventListener('error', event => { root.dataset.error = event.message; });
const waiting = Array.from(document.querySelectorAll('script[type="application/json"]'));
function drawNext() {
  const next = waiting.shift();
  if (next === undefined) { root.dataset.ready = 'yes'; return; }
  const figure = JSON.parse(next.textContent);
  Plotly.newPlot(next.previousElementSibling, figure.data, figure.layout, {displaylogo: false})
    .then(() => { root.dataset.drawn = Number(root.dataset.drawn) + 1; })
    .catch(error => { root.dataset.error = String(error); })
    .finally(() => setTimeout(drawNext, 0));
}
drawNext();
window.addEventListener('beforeprint', () => {
  for (const each of document.querySelectorAll('details')) each.open = true;
});
"""


def page(
    title: str,
    sections: Sequence[Section],
    points: int = POINTS,
) -> str:
    """Return the HTML of a report; its curves have at most `points` points."""
    body = [_section(section, points) for section in sections]
    links = ''.join(f'<a href="#{section.name}">{html.escape(section.title)}</a>' for section in sections)
    drawing = any(section.chart for section in sections)
    scripts = f'<script>{plotly_script()}</script>\n' if drawing else ''
    return (
        '<!DOCTYPE html>\n<html lang="en">\n<head>\n<meta charset="utf-8">\n'
        f'<meta http-equiv="Content-Security-Policy" content="{_POLICY}">\n'
        '<meta name="viewport" content="width=device-width, initial-scale=1">\n'
        f'<title>{html.escape(title)}</title>\n<style>{_STYLE}</style>\n</head>\n<body>\n'
        f'<h1>{html.escape(title)}</h1>\n<nav>{links}</nav>\n'
        '<noscript><p>The charts are drawn by a script, which this browser does not run.</p></noscript>\n'
        f'{"".join(body)}\n{scripts}<script>{_SCRIPT}</script>\n</body>\n</html>\n'
    )


def _section(section: Section, points: int) -> str:
    parts = [f'<section id="{section.name}">\n<h2>{html.escape(section.title)}</h2>\n']
    parts += [f'<p>{html.escape(sentence)}</p>\n' for sentence in section.words]
    if section.chart is not None:
        figure = json.dumps(plotly_figure(section.chart, points), allow_nan=False, separators=(',', ':'))
        safe = figure.replace('<', '\\u003c')  # no text of a recording ends the script
        parts.append(f'<div class="figure"></div><script type="application/json">{safe}</script>\n')
        if section.chart.remark:
            parts.append(f'<p>{html.escape(section.chart.remark)}</p>\n')
    parts += [_table(table) for table in section.tables]
    return ''.join([*parts, '</section>\n'])


def _table(table: Table) -> str:
    rows = [
        f'<tr{" class=marked" if place in table.marked else ""}>'
        + ''.join(f'<td>{html.escape(cell)}</td>' for cell in row)
        + '</tr>\n'
        for place, row in enumerate(table.rows)
    ]
    head = ''.join(f'<th>{html.escape(name)}</th>' for name in table.head)
    caption = f'<caption>{html.escape(table.title)}</caption>' if table.title and not table.folded else ''
    text = f'<div class="tables"><table>{caption}<tr>{head}</tr>\n{"".join(rows)}</table></div>\n'
    if not table.folded:
        return text
    return f'<details><summary>{html.escape(table.title or "as a table")}</summary>\n{text}</details>\n'
