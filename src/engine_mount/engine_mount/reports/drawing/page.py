"""A report as one HTML page that needs nothing else: no network, no other file."""

import html
import importlib.resources
import json
from collections.abc import Iterable, Sequence
from itertools import groupby

from engine_mount.reports.drawing.detail import NUMBERS, browser_chart, budget_of
from engine_mount.reports.sections.section import Cell, Finding, Link, Section, Table

# The page may not load anything from anywhere, whatever a recording's texts say.
_POLICY = "default-src 'none'; script-src 'unsafe-inline'; style-src 'unsafe-inline'; img-src data: blob:"

_HINT = (
    'Drag to zoom, double-click for all; with shift, drag moves; ctrl or shift with the wheel zooms. Touch: '
    'drag and pinch. Keys on a chart: arrows, + and -, 0; shift with arrows reads values.'
)
_PARTS = ('charts.js', 'paint.js', 'input.js')


def page(title: str, sections: Sequence[Section], numbers: int = NUMBERS) -> str:
    """Return the HTML of a report; its long curves have at most `numbers` numbers together."""
    charts = [section.chart for section in sections if section.chart]
    budget = budget_of(charts, numbers)
    body = ''.join(
        _side_by_side(group, budget) if half else ''.join(_section(section, budget) for section in group)
        for half, group in groupby(sections, key=lambda section: section.half)
    )
    listed = [section for section in sections if section.is_listed]
    links = ''.join(f'<a href="#{section.name}">{html.escape(section.title)}</a>' for section in listed)
    code = ''.join(_asset(part) for part in _PARTS)
    script = f'<script>{code}</script>\n' if charts else ''
    hint = f'<p class="hint">{_HINT}</p>\n' if charts else ''
    return (
        '<!DOCTYPE html>\n<html lang="en">\n<head>\n<meta charset="utf-8">\n'
        f'<meta http-equiv="Content-Security-Policy" content="{_POLICY}">\n'
        '<meta name="viewport" content="width=device-width, initial-scale=1">\n'
        f'<title>{html.escape(title)}</title>\n<style>{_asset("page.css")}</style>\n</head>\n<body>\n'
        f'<h1>{html.escape(title)}</h1>\n<nav>{links}</nav>\n{hint}'
        '<noscript><p>The charts are drawn by a script, which this browser does not run.</p></noscript>\n'
        f'{body}\n{script}</body>\n</html>\n'
    )


def _asset(name: str) -> str:
    return (importlib.resources.files('engine_mount.reports.drawing') / 'browser' / name).read_text(
        encoding='utf-8'
    )


def _side_by_side(sections: Iterable[Section], budget: int) -> str:
    return f'<div class="halves">{"".join(_section(section, budget) for section in sections)}</div>\n'


def _section(section: Section, budget: int) -> str:
    parts = [f'<section id="{section.name}">\n<h2>{html.escape(section.title)}</h2>\n']
    if section.findings:
        parts.append(f'<ul class="verdict">{"".join(map(_finding, section.findings))}</ul>\n')
    parts += [f'<p>{html.escape(sentence)}</p>\n' for sentence in section.words]
    if section.commands:
        parts.append(f'<pre>{html.escape(chr(10).join(section.commands))}</pre>\n')
    if section.chart is not None:
        figure = json.dumps(browser_chart(section.chart, budget), allow_nan=False, separators=(',', ':'))
        safe = figure.replace('<', '\\u003c')  # no text of a recording ends the script
        parts.append(
            f'<div class="figure" data-chart="{section.name}"></div>'
            f'<script type="application/json">{safe}</script>\n'
        )
        if section.chart.remark:
            parts.append(f'<p>{html.escape(section.chart.remark)}</p>\n')
    parts += [_table(table) for table in section.tables]
    return ''.join([*parts, '</section>\n'])


def _finding(finding: Finding) -> str:
    text = ' '.join(map(_cell, finding.text))
    judged = f'<b>{html.escape(finding.what)} <i>({finding.judgement.replace("look", "have a look")})</i></b>'
    return f'<li class="{finding.judgement}">{judged}{text}</li>'


def _cell(cell: Cell) -> str:
    if not isinstance(cell, Link):
        return html.escape(cell)
    at = '' if cell.at is None else f' data-chart="#{cell.section}" data-at="{cell.at:.4f}"'
    around = '' if cell.at is None else f' data-around="{cell.around:.4f}"'
    return f'<a href="#{cell.section}"{at}{around}>{html.escape(cell.text)}</a>'


def _table(table: Table) -> str:
    rows = [
        f'<tr{" class=marked" if place in table.marked else ""}>'
        + ''.join(f'<td>{_cell(cell)}</td>' for cell in row)
        + '</tr>\n'
        for place, row in enumerate(table.rows)
    ]
    head = ''.join(f'<th>{html.escape(name)}</th>' for name in table.head)
    caption = f'<caption>{html.escape(table.title)}</caption>' if table.title and not table.folded else ''
    text = f'<div class="tables"><table>{caption}<tr>{head}</tr>\n{"".join(rows)}</table></div>\n'
    if not table.folded:
        return text
    return f'<details><summary>{html.escape(table.title or "as a table")}</summary>\n{text}</details>\n'
