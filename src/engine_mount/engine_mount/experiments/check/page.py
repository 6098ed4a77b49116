"""The page of a check: verdicts, and a small picture of each manoeuvre."""

from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np

from engine_mount.experiments.check.judgement import Judged, Verdict, passed, worst_first
from engine_mount.experiments.check.measures import MEASURES, RACK
from engine_mount.experiments.check.session import CheckOrder
from engine_mount.experiments.check.suite import Manoeuvre
from engine_mount.experiments.check.telling import (
    HEADS,
    Verdicts,
    cells,
    not_judged,
    number,
    sentence_of,
    texts_of,
    told_once,
)
from engine_mount.experiments.check.trial import MODES, Result, Shown
from engine_mount.reports.drawing.chart import Array, Chart, Curve, Panel, Span
from engine_mount.reports.drawing.page import page
from engine_mount.reports.drawing.style import COLOUR_OF
from engine_mount.reports.sections.section import BAD, GOOD, Cell, Finding, Link, Section, Table
from mount_models.sampling import SAMPLE_TIME

PAGE = 'check.html'
_NUMBERS = 150_000  # of all curves together, chosen: a page of half a megabyte
_LOOP = 0.25  # s, chosen: two periods at 8 Hz
_COLOURS = {'undamped': 'undamped', 'hydromount': 'hydro', 'driven': 'friction'}
"""{mount: whose colour it has}, in the order in which they are drawn."""


def write_page(order: CheckOrder, results: Mapping[str, Result], verdicts: Verdicts, file: Path) -> None:
    """Write the page of a check; raises `OSError`."""
    sections = [_overview(order, results, verdicts)]
    sections += [_section(each, results[each.name], verdicts[each.name]) for each in order.manoeuvres]
    file.write_text(page('Manoeuvre suite', sections, _NUMBERS), encoding='utf-8')


def _overview(order: CheckOrder, results: Mapping[str, Result], verdicts: Verdicts) -> Section:
    changed = [
        f'{node}.{name}={value}' for node, each in order.settings.items() for name, value in each.items()
    ]
    words = [
        sentence_of(verdicts),
        f'Driven through {MODES[order.through]}; '
        + (f'set: {", ".join(changed)}.' if changed else 'all parameters as in the suite.'),
    ]
    rows = told_once(verdicts)
    told = [_linked(texts, row) for texts, row in zip(texts_of(rows, results, verdicts), rows, strict=True)]
    failed = sum(row.has_failed for row in rows)
    tables = [Table(HEADS, told[:failed], 'Exceeded', frozenset(range(failed)))] if failed else []
    tables.append(Table(HEADS, told, 'all limits, the worst first', frozenset(range(failed)), folded=True))
    findings = [_finding(each, results[each.name], verdicts[each.name]) for each in order.manoeuvres]
    return Section('overview', 'Overview', words, None, tables, findings)


def _linked(row: Sequence[str], verdict: Verdict) -> list[Cell]:
    if row[1] != verdict.manoeuvre:
        return list(row)
    return [row[0], Link(row[1], verdict.manoeuvre), *row[2:]]


def _finding(manoeuvre: Manoeuvre, result: Result, verdicts: Sequence[Verdict]) -> Finding:
    if result.broke_down:
        words: list[Cell] = [f'{result.broke_down};', not_judged(verdicts)]
        return Finding(manoeuvre.name, BAD, [Link('broke down:', manoeuvre.name), *words])
    worst = worst_first([each for each in verdicts if not each.common] or verdicts)
    failed = [each for each in worst_first(verdicts) if each.judged is Judged.FAILED]
    text: list[Cell] = [Link('exceeded:' if failed else 'least left:', manoeuvre.name)]
    for place, each in enumerate(failed or worst[:1]):
        _, _, name, value, limit, left = cells(each)
        share = f', {left} left' if left and not failed else ''
        text.append(f'{"· " if place else ""}{name} {value} ({limit}{share})')
    text += [f'· {remark}' for remark in result.remarks]
    return Finding(manoeuvre.name, BAD if failed else GOOD, text)


def _section(manoeuvre: Manoeuvre, result: Result, verdicts: Sequence[Verdict]) -> Section:
    if result.broke_down:
        words = [
            f'{manoeuvre.about} It broke down: {result.broke_down}',
            f'{not_judged(verdicts)}.'.capitalize(),
        ]
        return Section(manoeuvre.name, manoeuvre.name, words)
    ordered = worst_first(verdicts)
    rows = [_without_name(cells(each)) for each in ordered]
    marked = frozenset(place for place, each in enumerate(ordered) if each.judged is Judged.FAILED)
    reasons = [
        [f'{row[1]} {row[3]}\n{each.limit.source}', each.limit.reason]
        for row, each in zip(rows, ordered, strict=True)
    ]
    figures = [[name, number(value), MEASURES[name].meaning] for name, value in result.figures.items()]
    held = 'Within all limits.' if passed(verdicts) else 'Limits are exceeded.'
    return Section(
        manoeuvre.name,
        manoeuvre.name,
        [f'{manoeuvre.about} {held}', *result.remarks],
        _chart(manoeuvre, result.shown),
        [
            Table(_without_name(HEADS), rows, '', marked),
            Table(['limit', 'where its number comes from'], reasons, 'reasons of the limits', folded=True),
            Table(['quantity', 'value', 'meaning'], figures, 'all figures', folded=True),
        ],
    )


def _without_name(row: Sequence[str]) -> list[str]:
    return [row[0], *row[2:]]


def _chart(manoeuvre: Manoeuvre, shown: Shown) -> Chart | None:
    if not shown.displacement:
        return None
    if manoeuvre.seat == RACK:
        return _loops(manoeuvre.name, shown)
    time = SAMPLE_TIME * np.arange(shown.current.size)
    moved = [_curve(name, time, 1e3 * shown.displacement[name]) for name in _COLOURS]
    current = Curve('current', time, shown.current, COLOUR_OF['current'])
    return Chart(
        manoeuvre.name,
        manoeuvre.name,
        'seconds of excitation (s)',
        [Panel('displacement (mm)', moved, share=0.8), Panel('current (A)', [current], share=0.4)],
        [Span(max(begin, 0.0), end) for begin, end in shown.damping if end > 0.0],
        'damping on',
        (0.0, float(time[-1])),
    )


def _loops(name: str, shown: Shown) -> Chart:
    last = slice(-round(_LOOP / SAMPLE_TIME) - 1, None)
    curves = [
        _curve(mount, 1e3 * shown.displacement[mount][last], shown.force[mount][last]) for mount in _COLOURS
    ]
    return Chart(name, name, 'displacement (mm)', [Panel('mount force (N)', curves, share=1.2)])


def _curve(mount: str, x: Array, y: Array) -> Curve:
    return Curve('this mount' if mount == 'driven' else mount, x, y, COLOUR_OF[_COLOURS[mount]])
