"""What came of a check, for people and as JSON."""

import math
from collections.abc import Mapping, Sequence
from itertools import chain

from engine_mount.experiments.check.run import Trial
from engine_mount.experiments.check.suite import (
    FAILED,
    NOT_JUDGED,
    Result,
    Verdict,
    passed,
    verdicts_of,
    worst_first,
)
from engine_mount.experiments.harness.experiment import Settings, Values
from engine_mount.recordings.difference import known
from engine_mount.recordings.screen import Screen, Table

_HEADS = ('', 'manoeuvre', 'quantity', 'value', 'limit', 'left')
_SIGNS = {'at_most': '≤', 'at_least': '≥'}

Results = Mapping[str, Result]
Verdicts = Mapping[str, Sequence[Verdict]]


def all_verdicts(trials: Sequence[Trial], results: Results) -> dict[str, list[Verdict]]:
    """Return {manoeuvre: its verdicts}."""
    return {
        trial.manoeuvre.name: verdicts_of(trial.manoeuvre, results[trial.manoeuvre.name]) for trial in trials
    }


def show_result(trial: Trial, result: Result, screen: Screen) -> None:
    """Show a manoeuvre that is done: the limit of which least is left, and its remarks."""
    name, verdicts = trial.manoeuvre.name, worst_first(verdicts_of(trial.manoeuvre, result))
    row = _cells(verdicts[0]) if verdicts else ('', name, 'no limit', '', '', '')
    # at most 80 columns; the longest quantity has 32 characters
    screen.say('{:<5}{:<11}{:<33}{:>7} {:>7} {:>7}'.format(*row).rstrip())
    for remark in filter(None, (result.broke_down, *result.remarks)):
        screen.note(remark, name)


def table_of(results: Results, verdicts: Verdicts) -> Table:
    """Return the table of all verdicts, the worst first.

    A limit of all manoeuvres that held in all of them stands once, where least is left. A manoeuvre that
    broke down has one row, with the reason and how much is not judged.
    """
    every = list(chain(*verdicts.values()))
    exceeded = {_bound(each) for each in every if each.judged == FAILED}
    groups: dict[object, list[Verdict]] = {}
    for each in every:
        if each.judged == NOT_JUDGED:
            groups.setdefault(each.manoeuvre, []).append(each)
        elif each.judged == FAILED or not each.limit.common:
            groups[id(each)] = [each]
        elif _bound(each) not in exceeded:
            groups.setdefault(_bound(each), []).append(each)
    rows = worst_first([worst_first(group)[0] for group in groups.values()])
    judged, texts = sum(not result.broke_down for result in results.values()), []
    for row in rows:
        word, name, *others = _cells(row)
        if row.judged == NOT_JUDGED:
            lacking = f'not judged: {len(groups[name])} limits'
            others[0] = f'broke down: {results[name].broke_down}; {lacking}'
        elif row.limit.common and row.judged != FAILED and judged > 1:
            name = f'all {judged}' if judged == len(results) else f'{judged} of {len(results)}'
        texts.append((word, name, *others))
    marked = frozenset(place for place, row in enumerate(rows) if not passed([row]))
    failed = [name for name, each in verdicts.items() if not passed(each)]
    count = sum(each.judged != NOT_JUDGED for each in every)
    within = f'{len(verdicts) - len(failed)} of {len(verdicts)} manoeuvres within their {count} limits'
    sentence = f'{within}; not {", ".join(failed)}.' if failed else f'{within}.'
    return Table('', 'lllrrr', texts, _HEADS, sentence, marked)


def _bound(verdict: Verdict) -> tuple[str, str, bool]:
    return verdict.limit.measure, verdict.limit.bound, verdict.limit.common


def _cells(verdict: Verdict) -> tuple[str, ...]:
    """Return the texts of a row."""
    if verdict.judged == NOT_JUDGED:
        return FAILED, verdict.manoeuvre, 'broke down', '', '', ''
    limit = verdict.limit
    return (
        verdict.judged,
        verdict.manoeuvre,
        limit.measure,
        _number(verdict.value),
        f'{_SIGNS[limit.bound]}\N{NO-BREAK SPACE}{limit.value:g}',
        '' if math.isnan(verdict.margin) else f'{100.0 * verdict.margin:.0f}\N{NO-BREAK SPACE}%',
    )


def _number(value: float) -> str:
    """Return a figure with three digits, – where it is not known."""
    return '–' if math.isnan(value) else f'{value:.0f}' if abs(value) >= 1000.0 else f'{value:.3g}'


def figures_of(trials: Sequence[Trial], settings: Settings, results: Results, verdicts: Verdicts) -> Values:
    """Return what `--json` writes: the same order gives the same, whatever the number of jobs."""

    def as_json(verdict: Verdict) -> Values:
        limit = verdict.limit
        return {
            'quantity': limit.measure,
            'value': known(verdict.value),
            limit.bound: limit.value,
            'verdict': verdict.judged,
            'left': known(verdict.margin),
            'source': limit.source,
            'reason': limit.reason,
        }

    return {
        'passed': all(map(passed, verdicts.values())),
        'set': settings,
        'manoeuvres': {
            name: {
                'about': trial.manoeuvre.about,
                'passed': passed(verdicts[name]),
                'broke_down': result.broke_down,
                'remarks': list(result.remarks),
                'figures': {measure: known(value) for measure, value in result.figures.items()},
                'verdicts': list(map(as_json, verdicts[name])),
            }
            for trial, (name, result) in zip(trials, results.items(), strict=True)
        },
    }
