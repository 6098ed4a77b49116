"""A report as one HTML page that needs nothing else: no network, no other file."""

import json
from collections.abc import Sequence
from html import escape
from importlib.resources import files
from itertools import groupby
from string import Template

from engine_mount.reports.drawing.detail import browser_chart, budget_of
from engine_mount.reports.sections.section import Cell, Finding, Link, Section, Table

_ASSETS = files('engine_mount.reports.drawing') / 'browser'


def page(title: str, sections: Sequence[Section]) -> str:
    """Return the HTML of a report."""
    charts = [section.chart for section in sections if section.chart]
    budget = budget_of(charts)
    body = ''
    for half, group in groupby(sections, key=lambda section: section.half):
        inside = ''.join(_section(section, budget) for section in group)
        body += f'<div class="halves">{inside}</div>\n' if half else inside
    links = [f'<a href="#{each.name}">{escape(each.title)}</a>' for each in sections if each.is_listed]
    script = f'<script>{asset("chart.js")}{asset("report.js")}</script>\n' if charts else ''
    return Template(asset('page.html')).substitute(
        title=escape(title), style=asset('page.css'), links=''.join(links), body=body, script=script
    )


def asset(name: str) -> str:
    """Return the text of a file that a page is made of."""
    return (_ASSETS / name).read_text(encoding='utf-8')


def _section(section: Section, budget: int) -> str:
    parts = [f'<section id="{section.name}">\n<h2>{escape(section.title)}</h2>\n']
    if section.findings:
        parts.append(f'<ul class="verdict">{"".join(map(_finding, section.findings))}</ul>\n')
    parts += [f'<p>{escape(sentence)}</p>\n' for sentence in section.words]
    if section.commands:
        parts.append(f'<pre>{escape(chr(10).join(section.commands))}</pre>\n')
    if section.chart is not None:
        figure = json.dumps(browser_chart(section.chart, budget), allow_nan=False, separators=(',', ':'))
        safe = figure.replace('<', '\\u003c')  # no text of a recording ends the script
        parts.append(f'<div class="figure" data-chart="{section.name}"></div>')
        parts.append(f'<script type="application/json">{safe}</script>\n')
    return ''.join([*parts, *map(_table, section.tables), '</section>\n'])


def _finding(finding: Finding) -> str:
    text, judged = ' '.join(map(_cell, finding.text)), finding.judgement
    return f'<li class="{judged}"><b>{escape(finding.what)} <i>({judged})</i></b>{text}</li>'


def _cell(cell: Cell) -> str:
    if not isinstance(cell, Link):
        return escape(cell)
    at = '' if cell.at is None else f' data-at="{cell.at:.4f}"'
    return f'<a href="#{cell.section}"{at}>{escape(cell.text)}</a>'


def _table(table: Table) -> str:
    head = ''.join(f'<th>{escape(name)}</th>' for name in table.head)
    rows = [f'<tr>{head}</tr>\n']
    for place, row in enumerate(table.rows):
        named = zip(table.head, row, strict=True)
        cells = ''.join(f'<td data-head="{escape(head)}">{_cell(cell)}</td>' for head, cell in named)
        rows.append(f'<tr{" class=marked" if place in table.marked else ""}>{cells}</tr>\n')
    title = escape(table.title)
    caption = f'<caption>{title}</caption>' if title and not table.folded else ''
    drawn = f'<div class="tables"><table>{caption}{"".join(rows)}</table></div>\n'
    if not table.folded:
        return drawn
    return f'<details><summary>{title or "as a table"}</summary>\n{drawn}</details>\n'
