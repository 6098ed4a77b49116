"""What came of a check, for people: table, JSON, and a page with a picture of each manoeuvre."""

import math
from collections.abc import Mapping, Sequence
from itertools import chain
from pathlib import Path

import numpy as np

from engine_mount.experiments.check.run import DRIVEN, GRAPH, HYDRO, MODES, UNDAMPED, Trial
from engine_mount.experiments.check.suite import (
    FAILED,
    MEASURES,
    NOT_JUDGED,
    PASSED,
    RACK,
    Manoeuvre,
    Result,
    Verdict,
    passed,
    verdicts_of,
    worst_first,
)
from engine_mount.experiments.harness.experiment import Settings, Values
from engine_mount.recordings.screen import Screen
from engine_mount.recordings.screen import Table as ScreenTable
from engine_mount.reports.drawing.chart import Array, Chart, Curve, Panel, Span
from engine_mount.reports.drawing.page import page
from engine_mount.reports.drawing.style import COLOUR_OF
from engine_mount.reports.sections.section import Cell, Link, Section, Table
from mount_models.sampling import SAMPLE_TIME

HEADS = ('', 'manoeuvre', 'quantity', 'value', 'limit', 'left')
PAGE = 'check.html'
_SIGNS = {'at_most': '≤', 'at_least': '≥'}
_NUMBERS = 150_000  # of all curves together, chosen: a page of half a megabyte
_LOOP = 0.25  # s, chosen: two periods at 8 Hz
_COLOURS = {UNDAMPED: 'undamped', HYDRO: 'hydro', DRIVEN: 'friction'}
"""{mount: whose colour it has}, in the order in which they are drawn."""

Results = Mapping[str, Result]
Verdicts = Mapping[str, Sequence[Verdict]]


def all_verdicts(trials: Sequence[Trial], results: Results) -> dict[str, list[Verdict]]:
    """Return {manoeuvre: its verdicts}."""
    return {
        trial.manoeuvre.name: verdicts_of(
            trial.manoeuvre, results[trial.manoeuvre.name], real_time=trial.through == GRAPH
        )
        for trial in trials
    }


def show_result(trial: Trial, result: Result, screen: Screen) -> None:
    """Show a manoeuvre that is done: the limit of which least is left, and its remarks."""
    name = trial.manoeuvre.name
    verdicts = worst_first(all_verdicts([trial], {name: result})[name])
    row = cells(verdicts[0]) if verdicts else ('', name, 'no limit', '', '', '')
    # at most 80 columns; the longest quantity has 32 characters
    screen.say('{:<5}{:<11}{:<33}{:>7} {:>7} {:>7}'.format(*row).rstrip())
    for remark in filter(None, (result.broke_down, *result.remarks)):
        screen.note(remark, name)


def table_of(results: Results, verdicts: Verdicts) -> ScreenTable:
    """Return the table of all verdicts; a limit of all manoeuvres that held in all of them stands once."""
    rows = summary(verdicts)
    marked = frozenset(place for place, row in enumerate(rows) if row.has_failed)
    texts = [texts_of(row, results, verdicts) for row in rows]
    return ScreenTable('', 'lllrrr', texts, HEADS, sentence_of(verdicts), marked)


def summary(verdicts: Verdicts) -> list[Verdict]:
    """Return the verdicts worst first, each common limit that held everywhere once, where least is left.

    Of a manoeuvre that broke down there is one, whichever, for all of its limits.
    """
    groups: dict[object, list[Verdict]] = {}
    every = list(chain(*verdicts.values()))
    exceeded = {_bound(each) for each in every if each.judged == FAILED}
    for each in every:
        if each.judged == NOT_JUDGED:
            groups.setdefault(each.manoeuvre, []).append(each)
        elif each.judged == FAILED or not each.limit.common:
            groups[id(each)] = [each]
        elif _bound(each) not in exceeded:
            groups.setdefault(_bound(each), []).append(each)
    return worst_first([worst_first(group)[0] for group in groups.values()])


def _bound(verdict: Verdict) -> tuple[str, str, bool]:
    return verdict.limit.measure, verdict.limit.bound, verdict.limit.common


def texts_of(row: Verdict, results: Results, verdicts: Verdicts) -> tuple[str, ...]:
    """Return the texts of a row of `summary`; of what broke down why, and how much is not judged."""
    judged, of = sum(not result.broke_down for result in results.values()), len(results)
    if row.judged == NOT_JUDGED:
        name, reason = row.manoeuvre, results[row.manoeuvre].broke_down
        return FAILED, name, f'broke down: {reason}; {not_judged(verdicts[name])}', '', '', ''
    word, name, *others = cells(row)
    if row.limit.common and row.judged != FAILED and judged > 1:
        name = f'all {of}' if judged == of else f'{judged} of {of}'
    return word, name, *others


def not_judged(verdicts: Sequence[Verdict]) -> str:
    """Return how many limits of a manoeuvre that broke down are not judged."""
    return f'not judged: {sum(each.judged == NOT_JUDGED for each in verdicts)} limits'


def sentence_of(verdicts: Verdicts) -> str:
    """Return how many manoeuvres passed."""
    failed = [name for name, each in verdicts.items() if not passed(each)]
    count = sum(each.judged in (PASSED, FAILED) for each in chain(*verdicts.values()))
    within = f'{len(verdicts) - len(failed)} of {len(verdicts)} manoeuvres within their {count} limits'
    return f'{within}; not {", ".join(failed)}.' if failed else f'{within}.'


def cells(verdict: Verdict) -> tuple[str, ...]:
    """Return the texts of a row."""
    if verdict.judged == NOT_JUDGED:
        return FAILED, verdict.manoeuvre, 'broke down', '', '', ''
    limit = verdict.limit
    return (
        verdict.judged,
        verdict.manoeuvre,
        limit.measure,
        number(verdict.value),
        f'{_SIGNS[limit.bound]}\N{NO-BREAK SPACE}{limit.value:g}',
        '' if math.isnan(verdict.margin) else f'{100.0 * verdict.margin:.0f}\N{NO-BREAK SPACE}%',
    )


def number(value: float) -> str:
    """Return a figure with three digits, – where it is not known."""
    return '–' if math.isnan(value) else f'{value:.0f}' if abs(value) >= 1000.0 else f'{value:.3g}'


def figures_of(trials: Sequence[Trial], settings: Settings, results: Results, verdicts: Verdicts) -> Values:
    """Return what `--json` writes: the same order gives the same, whatever the number of jobs."""

    def as_json(verdict: Verdict) -> Values:
        limit = verdict.limit
        return {
            'quantity': limit.measure,
            'value': _known(verdict.value),
            limit.bound: limit.value,
            'verdict': verdict.judged,
            'left': _known(verdict.margin),
            'source': limit.source,
            'reason': limit.reason,
        }

    return {
        'passed': all(map(passed, verdicts.values())),
        'through': trials[0].through,
        'set': settings,
        'manoeuvres': {
            name: {
                'about': trial.manoeuvre.about,
                'passed': passed(verdicts[name]),
                'broke_down': result.broke_down,
                'remarks': list(result.remarks),
                'figures': {measure: _known(value) for measure, value in result.figures.items()},
                'verdicts': list(map(as_json, verdicts[name])),
            }
            for trial, (name, result) in zip(trials, results.items(), strict=True)
        },
    }


def _known(value: float) -> float | None:
    return float(value) if math.isfinite(value) else None


def write_page(
    trials: Sequence[Trial], settings: Settings, results: Results, verdicts: Verdicts, file: Path
) -> None:
    """Write the page of a check; raises `OSError`."""
    changed = ', '.join(
        f'{node}.{name}={value}' for node, each in settings.items() for name, value in each.items()
    )
    words = [
        sentence_of(verdicts),
        f'Driven through {MODES[trials[0].through]}; '
        + (f'set: {changed}.' if changed else 'all parameters as in the suite.'),
    ]
    rows: list[list[Cell]] = []
    worst = summary(verdicts)
    for row in worst:
        word, name, *others = texts_of(row, results, verdicts)
        rows.append([word, Link(name, name) if name == row.manoeuvre else name, *others])
    marked = frozenset(place for place, row in enumerate(worst) if row.has_failed)
    overview = Section('overview', 'Overview', words, None, [Table(HEADS, rows, '', marked)])
    sections = [
        _section(trial.manoeuvre, results[trial.manoeuvre.name], verdicts[trial.manoeuvre.name])
        for trial in trials
    ]
    file.write_text(page('Manoeuvre suite', [overview, *sections], _NUMBERS), encoding='utf-8')


def _section(manoeuvre: Manoeuvre, result: Result, verdicts: Sequence[Verdict]) -> Section:
    name, about = manoeuvre.name, manoeuvre.about
    if result.broke_down:
        words = [f'{about} It broke down: {result.broke_down}', f'{not_judged(verdicts)}.'.capitalize()]
        return Section(name, name, words)
    ordered = worst_first(verdicts)
    rows = []
    for each in ordered:
        word, _, *others = cells(each)
        rows.append([word, *others, each.limit.source, each.limit.reason])
    marked = frozenset(place for place, each in enumerate(ordered) if each.judged == FAILED)
    figures = [[key, number(value), MEASURES[key].meaning] for key, value in result.figures.items()]
    held = 'Within all limits.' if passed(verdicts) else 'Limits are exceeded.'
    tables = [
        Table(('', *HEADS[2:], 'source', 'reason of the limit'), rows, '', marked),
        Table(('quantity', 'value', 'meaning'), figures, 'all figures', folded=True),
    ]
    return Section(name, name, [f'{about} {held}', *result.remarks], _chart(manoeuvre, result), tables)


def _chart(manoeuvre: Manoeuvre, result: Result) -> Chart | None:
    name, truths = manoeuvre.name, result.truths
    if not truths:
        return None

    def curve(mount: str, x: Array, y: Array) -> Curve:
        return Curve('this mount' if mount == DRIVEN else mount, x, y, COLOUR_OF[_COLOURS[mount]])

    if manoeuvre.seat == RACK:
        last = slice(-round(_LOOP / SAMPLE_TIME) - 1, None)
        loops = [
            curve(mount, 1e3 * truths[mount].displacement[last], truths[mount].mount_force[last])
            for mount in _COLOURS
        ]
        return Chart(name, name, 'displacement (mm)', [Panel('mount force (N)', loops, share=1.2)])
    current = truths[DRIVEN].coil_current
    time = SAMPLE_TIME * np.arange(current.size)
    moved = [curve(mount, time, 1e3 * truths[mount].displacement) for mount in _COLOURS]
    panels = [
        Panel('displacement (mm)', moved, share=0.8),
        Panel('current (A)', [Curve('current', time, current, COLOUR_OF['current'])], share=0.4),
    ]
    spans = [Span(max(begin, 0.0), end) for begin, end in result.damping if end > 0.0]
    limits = (0.0, float(time[-1]))
    return Chart(name, name, 'seconds of excitation (s)', panels, spans, 'damping on', limits)
