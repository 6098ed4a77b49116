"""What a check says: a line for each manoeuvre, one table, worst first, and the figures of `--json`."""

import math
import time
from collections.abc import Callable, Mapping, Sequence
from itertools import chain
from typing import Any

from engine_mount.experiments.check.judgement import Judged, Verdict, passed, verdicts_of, worst_first
from engine_mount.experiments.check.session import CheckOrder
from engine_mount.experiments.check.trial import Result
from engine_mount.recordings.screen import Screen, Table

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


def table_of(results: Mapping[str, Result], verdicts: Verdicts) -> Table:
    """Return the table of all verdicts; a limit of all manoeuvres that held in all of them is told once."""
    rows = told_once(verdicts)
    marked = frozenset(place for place, row in enumerate(rows) if row.has_failed)
    return Table('', 'lllrrr', texts_of(rows, results, verdicts), HEADS, sentence_of(verdicts), marked)


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
        elif verdict.common:
            common.setdefault(key, []).append(verdict)
        else:
            held.append(verdict)
    exceeded = {(verdict.limit.measure, verdict.limit.bound) for verdict in failed if verdict.common}
    for key, group in common.items():
        if key not in exceeded:
            held.append(worst_first(group)[0])
    return worst_first([*broken.values(), *failed, *held])


def cells(verdict: Verdict, shared: str = '') -> tuple[str, ...]:
    """Return the texts of a row; of a common limit that held with the text `shared`, if given."""
    if verdict.judged is Judged.NOT_JUDGED:
        return Judged.FAILED.value, verdict.manoeuvre, 'broke down', '', '', ''
    limit = verdict.limit
    is_shared = shared and verdict.common and verdict.judged is not Judged.FAILED
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


def figures_of(order: CheckOrder, results: Mapping[str, Result], verdicts: Verdicts) -> dict[str, Any]:
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


def _as_json(verdict: Verdict) -> dict[str, Any]:
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
