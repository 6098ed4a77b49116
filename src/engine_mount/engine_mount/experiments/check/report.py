"""The page of a check: verdicts, and a small picture of each manoeuvre."""

import math
import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from enum import Enum
from itertools import chain
from pathlib import Path

import numpy as np

from engine_mount.experiments.check.run import GRAPH, MODES, CheckOrder, Result, Shown
from engine_mount.experiments.check.suite import CLOCK, MEASURES, RACK, Limit, Manoeuvre
from engine_mount.experiments.harness.experiment import Values
from engine_mount.recordings.screen import Screen
from engine_mount.recordings.screen import Table as ScreenTable
from engine_mount.reports.drawing.chart import Array, Chart, Curve, Panel, Span
from engine_mount.reports.drawing.page import page
from engine_mount.reports.drawing.style import COLOUR_OF
from engine_mount.reports.sections.section import BAD, GOOD, Cell, Finding, Link, Section, Table
from mount_models.sampling import SAMPLE_TIME


class Judged(Enum):
    """What became of a limit."""

    FAILED = 'fail'
    PASSED = 'ok'
    LEFT_OUT = 'none'
    NOT_JUDGED = 'not judged'  # the manoeuvre broke down


@dataclass(frozen=True)
class Verdict:
    """One figure against one limit; `margin` is the share that is left of it, NaN of a limit of 0."""

    manoeuvre: str
    limit: Limit
    value: float
    judged: Judged
    margin: float

    @property
    def has_failed(self) -> bool:
        """Whether the manoeuvre does not pass for it."""
        return self.judged in (Judged.FAILED, Judged.NOT_JUDGED)


def verdicts_of(manoeuvre: Manoeuvre, result: Result, through: str) -> list[Verdict]:
    """Return the verdicts on one manoeuvre in the order of its limits."""
    return [_verdict(manoeuvre.name, limit, result, through) for limit in manoeuvre.limits]


def worst_first(verdicts: Sequence[Verdict]) -> list[Verdict]:
    """Return the verdicts with those that failed first, then by the margin that is left."""
    order = {Judged.NOT_JUDGED: 0, Judged.FAILED: 1, Judged.PASSED: 2, Judged.LEFT_OUT: 3}

    def key(verdict: Verdict) -> tuple[int, float]:
        unknown = -math.inf if verdict.judged is Judged.FAILED else math.inf
        return order[verdict.judged], unknown if math.isnan(verdict.margin) else verdict.margin

    return sorted(verdicts, key=key)


def passed(verdicts: Sequence[Verdict]) -> bool:
    """Return whether no limit is exceeded, and none could not be judged."""
    return not any(verdict.has_failed for verdict in verdicts)


def all_verdicts(
    suite: Sequence[Manoeuvre], results: Mapping[str, Result], through: str
) -> dict[str, list[Verdict]]:
    """Return {manoeuvre: its verdicts}."""
    return {each.name: verdicts_of(each, results[each.name], through) for each in suite}


def _verdict(manoeuvre: str, limit: Limit, result: Result, through: str) -> Verdict:
    if CLOCK in MEASURES[limit.measure].seats and through != GRAPH:
        return Verdict(manoeuvre, limit, math.nan, Judged.LEFT_OUT, math.nan)
    if result.broke_down:
        return Verdict(manoeuvre, limit, math.nan, Judged.NOT_JUDGED, math.nan)
    value = result.figures.get(limit.measure, math.nan)
    left = limit.value - value if limit.bound == 'at_most' else value - limit.value
    judged = Judged.PASSED if left >= 0.0 else Judged.FAILED  # a value that is not known fails
    margin = left / abs(limit.value) if limit.value else math.nan
    return Verdict(manoeuvre, limit, value, judged, margin)


HEADS = ('', 'manoeuvre', 'quantity', 'value', 'limit', 'left')
_SIGNS = {'at_most': '≤', 'at_least': '≥'}

Verdicts = Mapping[str, Sequence[Verdict]]


class Told:
    """Tells each manoeuvre when it is done: the limit of which least is left, the time to go, its remarks."""

    def __init__(self, order: CheckOrder, screen: Screen, clock: Callable[[], float] = time.monotonic):
        self._suite = {each.name: each for each in order.manoeuvres}
        self._through = order.through
        self._screen = screen
        self._clock = clock
        self._begin = clock()
        self._is_first = True

    def __call__(self, name: str, result: Result, share: float) -> None:
        if self._is_first:
            self._screen.say(_line(*HEADS, 'to go'))
            self._is_first = False
        verdicts = worst_first(verdicts_of(self._suite[name], result, self._through))
        row = cells(verdicts[0]) if verdicts else ('', name, 'no limit', '', '', '')
        to_go = round((1.0 - share) / share * (self._clock() - self._begin))
        self._screen.say(_line(*row, f'{to_go // 60}:{to_go % 60:02}'))
        for remark in filter(None, (result.broke_down, *result.remarks)):
            self._screen.note(remark, name)


def _line(*texts: str) -> str:
    """Return a line of at most 80 columns; the longest quantity has 32 characters."""
    return '{:<5}{:<11}{:<33}{:>7} {:>7} {:>7} {:>6}'.format(*texts)


def table_of(results: Mapping[str, Result], verdicts: Verdicts) -> ScreenTable:
    """Return the table of all verdicts; a limit of all manoeuvres that held in all of them is told once."""
    rows = told_once(verdicts)
    marked = frozenset(place for place, row in enumerate(rows) if row.has_failed)
    return ScreenTable('', 'lllrrr', texts_of(rows, results, verdicts), HEADS, sentence_of(verdicts), marked)


def texts_of(
    rows: Sequence[Verdict], results: Mapping[str, Result], verdicts: Verdicts
) -> list[tuple[str, ...]]:
    """Return the texts of rows of `told_once`; of what broke down why, and how much is not judged."""
    judged, of = sum(not result.broke_down for result in results.values()), len(results)
    shared = '' if judged < 2 else f'all {of}' if judged == of else f'{judged} of {of}'
    texts = []
    for row in rows:
        result, word, name, told, *others = results[row.manoeuvre], *cells(row, shared)
        if row.judged is Judged.NOT_JUDGED:
            told += f': {result.broke_down}; {not_judged(verdicts[row.manoeuvre])}'
        texts.append((word, name, told, *others))
    return texts


def not_judged(verdicts: Sequence[Verdict]) -> str:
    """Return how many limits of a manoeuvre that broke down are not judged."""
    return f'not judged: {sum(each.judged is Judged.NOT_JUDGED for each in verdicts)} limits'


def sentence_of(verdicts: Verdicts) -> str:
    """Return how many manoeuvres passed."""
    failed = [name for name, each in verdicts.items() if not passed(each)]
    count = sum(each.judged in (Judged.PASSED, Judged.FAILED) for each in chain(*verdicts.values()))
    told = f'{len(verdicts) - len(failed)} of {len(verdicts)} manoeuvres within their {count} limits'
    return f'{told}; not {", ".join(failed)}.' if failed else f'{told}.'


def told_once(verdicts: Verdicts) -> list[Verdict]:
    """Return the verdicts worst first, each common limit that held everywhere once, where least is left.

    Of a manoeuvre that broke down there is one, whichever, for all of its limits.
    """
    broken: dict[str, Verdict] = {}
    failed: list[Verdict] = []
    held: list[Verdict] = []
    common: dict[tuple[str, str], list[Verdict]] = {}
    for verdict in chain(*verdicts.values()):
        key = (verdict.limit.measure, verdict.limit.bound)
        if verdict.judged is Judged.NOT_JUDGED:
            broken[verdict.manoeuvre] = verdict
        elif verdict.judged is Judged.FAILED:
            failed.append(verdict)
        elif verdict.limit.common:
            common.setdefault(key, []).append(verdict)
        else:
            held.append(verdict)
    exceeded = {(verdict.limit.measure, verdict.limit.bound) for verdict in failed if verdict.limit.common}
    for key, group in common.items():
        if key not in exceeded:
            held.append(worst_first(group)[0])
    return worst_first([*broken.values(), *failed, *held])


def cells(verdict: Verdict, shared: str = '') -> tuple[str, ...]:
    """Return the texts of a row; of a common limit that held with the text `shared`, if given."""
    if verdict.judged is Judged.NOT_JUDGED:
        return Judged.FAILED.value, verdict.manoeuvre, 'broke down', '', '', ''
    limit = verdict.limit
    is_shared = shared and verdict.limit.common and verdict.judged is not Judged.FAILED
    return (
        verdict.judged.value,
        shared if is_shared else verdict.manoeuvre,
        limit.measure,
        number(verdict.value),
        f'{_SIGNS[limit.bound]}\N{NO-BREAK SPACE}{limit.value:g}',
        '' if math.isnan(verdict.margin) else f'{100.0 * verdict.margin:.0f}\N{NO-BREAK SPACE}%',
    )


def number(value: float) -> str:
    """Return a figure with three digits, – where it is not known."""
    return '–' if math.isnan(value) else f'{value:.0f}' if abs(value) >= 1000.0 else f'{value:.3g}'


def figures_of(order: CheckOrder, results: Mapping[str, Result], verdicts: Verdicts) -> Values:
    """Return what `--json` writes: the same order gives the same, whatever the number of jobs."""
    return {
        'passed': all(map(passed, verdicts.values())),
        'through': order.through,
        'set': {node: dict(values) for node, values in order.settings.items()},
        'manoeuvres': {
            each.name: {
                'about': each.about,
                'passed': passed(verdicts[each.name]),
                'broke_down': results[each.name].broke_down,
                'remarks': list(results[each.name].remarks),
                'figures': {name: _known(value) for name, value in results[each.name].figures.items()},
                'verdicts': [_as_json(verdict) for verdict in verdicts[each.name]],
            }
            for each in order.manoeuvres
        },
    }


def _as_json(verdict: Verdict) -> Values:
    limit = verdict.limit
    return {
        'quantity': limit.measure,
        'value': _known(verdict.value),
        limit.bound: limit.value,
        'verdict': verdict.judged.value,
        'left': _known(verdict.margin),
        'source': limit.source,
        'reason': limit.reason,
    }


def _known(value: float) -> float | None:
    return float(value) if math.isfinite(value) else None


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
    worst = worst_first([each for each in verdicts if not each.limit.common] or verdicts)
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
