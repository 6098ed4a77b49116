"""A report as one HTML page that needs nothing else: no network, no other file."""

import html
import json
from collections.abc import Sequence
from importlib.resources import files
from itertools import groupby
from string import Template

from engine_mount.reports.drawing.detail import NUMBERS, browser_chart, budget_of
from engine_mount.reports.sections.section import Cell, Finding, Link, Section, Table

_ASSETS = files('engine_mount.reports.drawing') / 'browser'


def page(title: str, sections: Sequence[Section], numbers: int = NUMBERS) -> str:
    """Return the HTML of a report; its long curves have at most `numbers` numbers together."""
    charts = [section.chart for section in sections if section.chart]
    budget = budget_of(charts, numbers)
    body = ''
    for half, group in groupby(sections, key=lambda section: section.half):
        inside = ''.join(_section(section, budget) for section in group)
        body += _tag('div', inside, class_='halves') if half else inside
    links = [_text('a', each.title, href=f'#{each.name}') for each in sections if each.is_listed]
    script = _tag('script', asset('chart.js') + asset('report.js')) if charts else ''
    return Template(asset('page.html')).substitute(
        title=html.escape(title), style=asset('page.css'), links=''.join(links), body=body, script=script
    )


def asset(name: str) -> str:
    """Return the text of a file that a page is made of."""
    return (_ASSETS / name).read_text(encoding='utf-8')


def _tag(name: str, inside: str, **attributes: object) -> str:
    """Return an element around HTML; the values of its attributes are text."""
    told = (
        f' {key.rstrip("_").replace("_", "-")}="{html.escape(str(value))}"'
        for key, value in attributes.items()
    )
    return f'<{name}{"".join(told)}>{inside}</{name}>\n'


def _text(name: str, text: str, **attributes: object) -> str:
    return _tag(name, html.escape(text), **attributes).rstrip('\n')


def _section(section: Section, budget: int) -> str:
    parts = [_text('h2', section.title)]
    if section.findings:
        parts.append(_tag('ul', ''.join(map(_finding, section.findings)), class_='verdict'))
    parts += [_text('p', sentence) for sentence in section.words]
    if section.commands:
        parts.append(_text('pre', '\n'.join(section.commands)))
    if section.chart is not None:
        figure = json.dumps(browser_chart(section.chart, budget), allow_nan=False, separators=(',', ':'))
        safe = figure.replace('<', '\\u003c')  # no text of a recording ends the script
        parts.append(_tag('div', '', class_='figure', data_chart=section.name).rstrip('\n'))
        parts.append(_tag('script', safe, type='application/json'))
        parts += [_text('p', section.chart.remark)] if section.chart.remark else []
    parts += map(_table, section.tables)
    return _tag('section', ''.join(parts), id=section.name)


def _finding(finding: Finding) -> str:
    judged = finding.judgement.replace('look', 'have a look')
    head = _tag('b', f'{html.escape(finding.what)} {_text("i", f"({judged})")}')
    return _tag('li', head + ' '.join(map(_cell, finding.text)), class_=finding.judgement)


def _cell(cell: Cell) -> str:
    if not isinstance(cell, Link):
        return html.escape(cell)
    place = {} if cell.at is None else {'data_at': f'{cell.at:.4f}', 'data_around': f'{cell.around:.4f}'}
    return _text('a', cell.text, href=f'#{cell.section}', **place)


def _table(table: Table) -> str:
    rows = [_tag('tr', ''.join(_text('th', name) for name in table.head))]
    for place, row in enumerate(table.rows):
        marked = {'class_': 'marked'} if place in table.marked else {}
        rows.append(_tag('tr', ''.join(_tag('td', _cell(cell)).rstrip('\n') for cell in row), **marked))
    caption = _text('caption', table.title) if table.title and not table.folded else ''
    drawn = _tag('div', _tag('table', caption + ''.join(rows)), class_='tables')
    return _tag('details', _text('summary', table.title or 'as a table') + drawn) if table.folded else drawn
