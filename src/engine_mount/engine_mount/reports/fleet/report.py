"""The page about the result of a fleet: what was asked, how figures are spread, the worst, what has none."""

import json
from collections.abc import Sequence
from typing import TYPE_CHECKING

from engine_mount.reports.fleet.distributions import Pair, pairs_of, spread
from engine_mount.reports.fleet.looks import Look, look_section
from engine_mount.reports.fleet.readable import length_of_time, quantity
from engine_mount.reports.fleet.worst_table import worst_section
from engine_mount.reports.report import Report
from engine_mount.reports.sections.section import (
    BAD,
    GOOD,
    LOOK,
    UNKNOWN,
    Cell,
    Finding,
    Link,
    Section,
    Table,
)

if TYPE_CHECKING:
    import pyarrow

SETPOINTS, DISPLACEMENT = 'setpoints', 'displacement'
"""What a result answers, in its column `asked`."""
ANOTHER_POLICY = 'another policy'
"""Recordings that the change does not concern, in the column `outcome`."""

_ASKED = {
    SETPOINTS: (
        'setpoints for the recorded displacement',
        'Asked: which setpoints the changed controller would have given to the recorded displacement. The '
        'displacement itself answers the controller that was at work when it was recorded; what the change '
        'would have done to the motion is another question: engine-mount fleet replay --closed-loop.',
    ),
    DISPLACEMENT: (
        'displacement in a closed loop',
        'Asked: how engine and mount would have moved. Both motions are simulated over the recorded '
        'acceleration of the chassis, once with the controller as recorded and once with the change. What '
        'the real mount did is not in these figures.',
    ),
}
_OF_MOTION = ('displacement', 'mount_force')  # in names of figures: what is looked for in a closed loop
_LISTED = 20  # recordings that are named beside their reason, chosen


def fleet_report(result: 'pyarrow.Table', looks: Sequence[Look], by: str, name: str) -> Report:
    """Return the page about `result`, the table of `engine-mount fleet replay`.

    `looks` are the worst recordings by the column `by`, the worst first; `name` is that of the fleet.
    """
    rows = result.to_pylist()
    asked = {row['asked'] for row in rows}
    question = next((told for each, (told, _) in _ASKED.items() if asked == {each}), 'several questions')
    sections = [
        _overview(rows, asked),
        worst_section(looks, by, result.schema),
        *map(spread, _ordered(pairs_of(result))),
        *(look_section(number, look) for number, look in enumerate(looks, 1)),
        *_with_another_policy(rows),
        _failures(rows),
    ]
    return Report(f'Fleet {name}: {question}', sections)


def _ordered(pairs: Sequence[Pair]) -> list[Pair]:
    """Return the figures that the change moved, the motion first."""
    moved = [pair for pair in pairs if pair.moved]
    return sorted(moved, key=lambda pair: not any(word in pair.name for word in _OF_MOTION))


def _overview(rows: Sequence[dict], asked: set[str]) -> Section:
    words = [_ASKED[each][1] for each in sorted(asked) if each in _ASKED]
    changes = json.loads(next((row['changes'] for row in rows if row.get('changes')), '{}'))
    table = Table(
        ('parameter', 'changed to'),
        [
            (f'{node}.{name}', json.dumps(value))
            for node, values in changes.items()
            for name, value in values.items()
        ],
    )
    checked = _motion(rows) if asked == {DISPLACEMENT} else _trusted(rows)
    done = 'simulated' if asked == {DISPLACEMENT} else 'replayed'
    findings = [_recordings(rows, done), _differing(rows), checked]
    return Section('overview', 'Overview', words, findings=findings, tables=[table] if table.rows else [])


def _recordings(rows: Sequence[dict], done: str) -> Finding:
    names = {row['recording'] for row in rows}
    failed = {row['recording'] for row in rows if _is_failed(row)}
    replayed = {row['recording'] for row in rows if not row['reason']} - failed
    others = names - failed - replayed
    length = length_of_time(sum(row['duration_s'] or 0.0 for row in rows))
    text: list[Cell] = [f'{len(names)} recordings: {len(replayed)} {done} ({length}),']
    if others:
        text += [Link(f'{len(others)} with another policy', 'another_policy'), 'and']
    text.append(Link(f'{len(failed)} failed', 'failures') if failed else 'none failed')
    return Finding('Recordings', LOOK if failed or not replayed else GOOD, text)


def _is_failed(row: dict) -> bool:
    return bool(row['reason']) and row.get('outcome') != ANOTHER_POLICY


def _differing(rows: Sequence[dict]) -> Finding:
    done = [row for row in rows if not row['reason']]
    differing = sum(bool(row['setpoints_differing']) for row in done)
    switched = sum(
        bool(row['switchings_appeared'] or row['switchings_vanished'] or row['switchings_moved'])
        for row in done
    )
    text = [f'{differing} of {len(done)} rows have other setpoints, {switched} are damped at other times;']
    return Finding('Difference', LOOK if differing else GOOD, [*text, Link('the worst', 'worst')])


def _trusted(rows: Sequence[dict]) -> Finding:
    """Judge whether the replay without the change gives what was recorded."""
    told = [row for row in rows if row.get('as_recorded') is not None]
    others = [row for row in told if not row['as_recorded']]
    what = 'Replay without the change'
    if not told:
        return Finding(what, UNKNOWN, ['nothing was recorded to compare it with'])
    if not others:
        return Finding(what, GOOD, [f'gives the recorded setpoints of all {len(told)} rows'])
    largest = max(row['as_recorded_largest_a'] or 0.0 for row in others)
    return Finding(
        what,
        BAD,
        [
            f'does not give the recorded setpoints of {len(others)} of {len(told)} rows, '
            f'by up to {quantity(largest, "A")}: '
            'they were recorded with other parameters, another version, or losses'
        ],
    )


def _motion(rows: Sequence[dict]) -> Finding:
    """Tell in how many drives the change makes the largest displacement larger, and where most."""
    grown = {
        ' '.join(filter(None, (row['recording'], row['mount']))): after - before
        for row in rows
        if (before := row.get('peak_displacement_m')) is not None
        and (after := row.get('peak_displacement_changed_m')) is not None
    }
    what = 'Largest displacement'
    if not grown:
        return Finding(what, UNKNOWN, ['no drive could be simulated'])
    larger, smaller = (sum(sign * by > 0.0 for by in grown.values()) for sign in (1.0, -1.0))
    text = f'larger in {larger}, smaller in {smaller} of {len(grown)} rows'
    if not larger:
        return Finding(what, GOOD, [text])
    most = max(grown, key=lambda name: grown[name])
    return Finding(what, LOOK, [f'{text}; grows most in {most}: {quantity(grown[most], "m", signed=True)}'])


def _with_another_policy(rows: Sequence[dict]) -> list[Section]:
    others = [row for row in rows if row.get('outcome') == ANOTHER_POLICY]
    words = ['The change does not concern these: their policy does not have a parameter that was changed.']
    return [Section('another_policy', 'Another policy', words, tables=[_reasons(others)])] if others else []


def _failures(rows: Sequence[dict]) -> Section:
    failed = [row for row in rows if _is_failed(row)]
    if not failed:
        return Section('failures', 'Failed', ['Nothing failed.'])
    return Section('failures', 'Failed', tables=[_reasons(failed)])


def _reasons(rows: Sequence[dict]) -> Table:
    """Return why rows have no figures, each reason once with its recordings."""
    reasons: dict[str, list[dict]] = {}
    for row in rows:
        reasons.setdefault(row['reason'].replace(row['recording'], '...'), []).append(row)
    told = [
        (str(len(of_it)), of_it[0]['reason'] if len(of_it) == 1 else reason, _listed([*map(_named, of_it)]))
        for reason, of_it in sorted(reasons.items(), key=lambda item: -len(item[1]))
    ]
    return Table(('rows', 'reason', 'recordings'), told)


def _named(row: dict) -> str:
    return ' '.join(filter(None, (row['recording'], row['mount'])))


def _listed(names: Sequence[str]) -> str:
    more = [f'and {len(names) - _LISTED} more'] if len(names) > _LISTED else []
    return '\n'.join([*names[:_LISTED], *more])
