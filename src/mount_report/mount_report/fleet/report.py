"""The page about the result of a fleet: what was asked, how figures are spread, the worst, what failed."""

import json
from collections.abc import Sequence
from typing import TYPE_CHECKING

from mount_report.fleet.distributions import pairs_of, spread
from mount_report.fleet.looks import Look, look_section
from mount_report.report import Report
from mount_report.sections.section import BAD, GOOD, LOOK, UNKNOWN, Finding, Link, Section, Table

if TYPE_CHECKING:
    import pyarrow

_ASKED = {
    'setpoints': (
        'Which setpoints the changed controller would have given to the recorded displacements. The '
        'displacement itself answers the controller that was at work when it was recorded; what the change '
        'would have done to the motion is another question: engine-mount fleet replay --closed-loop.'
    ),
    'displacement': (
        'How engine and mount would have moved: both are simulated anew over the recorded acceleration of '
        'the chassis, once with the controller as recorded and once with the change. What the real mount did '
        'is not in these figures.'
    ),
}
_LISTED = 20  # recordings that are named beside their reason, chosen


def fleet_report(result: 'pyarrow.Table', looks: Sequence[Look], by: str, title: str) -> Report:
    """Return the page about `result`, the table of `engine-mount fleet replay`.

    `looks` are the worst recordings by the column `by`, the worst first.
    """
    pairs = [pair for pair in pairs_of(result) if pair.moved]
    sections = [
        _overview(result),
        _worst(looks, by),
        *(spread(pair) for pair in pairs),
        *(look_section(number, look, by) for number, look in enumerate(looks, 1)),
        _failures(result),
    ]
    return Report(title, sections)


def _overview(result: 'pyarrow.Table') -> Section:
    rows = result.to_pylist()
    asked = {row['asked'] for row in rows}
    words = [_ASKED[each] for each in sorted(asked) if each in _ASKED]
    changes = json.loads(next((row['changes'] for row in rows if row.get('changes')), '{}'))
    table = Table(
        ('parameter', 'value'),
        [
            (f'{node}.{name}', json.dumps(value))
            for node, values in changes.items()
            for name, value in values.items()
        ],
        title='Changed',
    )
    findings = [_recordings(rows), _differing(rows), _trusted(rows)]
    return Section('overview', 'Overview', words, findings=findings, tables=[table] if table.rows else [])


def _recordings(rows: Sequence[dict]) -> Finding:
    names = {row['recording'] for row in rows}
    failed = {row['recording'] for row in rows if row['reason']}
    seconds = sum(row['duration_s'] or 0.0 for row in rows)
    length = f'{seconds / 3600.0:.1f} h' if seconds >= 3600.0 else f'{seconds:.0f} s'
    text = [f'{len(names)} recordings, {length} of them replayed;']
    if not failed:
        return Finding('Recordings', GOOD, [*text, 'none failed'])
    return Finding('Recordings', LOOK, [*text, Link(f'{len(failed)} failed', 'failures')])


def _differing(rows: Sequence[dict]) -> Finding:
    done = [row for row in rows if not row['reason']]
    differing = sum(bool(row['setpoints_differing']) for row in done)
    switched = sum(
        bool(row['switchings_appeared'] or row['switchings_vanished'] or row['switchings_moved'])
        for row in done
    )
    text = [f'{differing} of {len(done)} have other setpoints, {switched} are damped at other times;']
    return Finding('Difference', LOOK if differing else GOOD, [*text, Link('the worst', 'worst')])


def _trusted(rows: Sequence[dict]) -> Finding:
    """Judge whether the replay without the change gives what was recorded."""
    told = [row for row in rows if row.get('as_recorded') is not None]
    others = [row for row in told if not row['as_recorded']]
    what = 'Replay without the change'
    if not told:
        return Finding(what, UNKNOWN, ['nothing was recorded to compare it with'])
    if not others:
        return Finding(what, GOOD, [f'gives the recorded setpoints of all {len(told)}'])
    largest = max(row['as_recorded_largest_a'] or 0.0 for row in others)
    return Finding(
        what,
        BAD,
        [
            f'does not give the recorded setpoints of {len(others)} of {len(told)}, '
            f'by up to {largest:.3g} A: '
            'they were recorded with other parameters, another version, or losses'
        ],
    )


def _worst(looks: Sequence[Look], by: str) -> Section:
    title = 'Worst'
    if not looks:
        return Section('worst', title, [f'No row has a number in the column {by}.'])
    rows = [
        (str(number), Link(look.recording, f'look_{number}'), look.value)
        for number, look in enumerate(looks, 1)
    ]
    return Section('worst', title, tables=[Table(('', 'recording', by), rows)])


def _failures(result: 'pyarrow.Table') -> Section:
    failed = [row for row in result.to_pylist() if row['reason']]
    if not failed:
        return Section('failures', 'Failed', ['Nothing failed.'])
    reasons: dict[str, list[str]] = {}
    for row in failed:
        reasons.setdefault(row['reason'].replace(row['recording'], '...'), []).append(_named(row))
    rows = [
        (reason, str(len(names)), _listed(names))
        for reason, names in sorted(reasons.items(), key=lambda item: -len(item[1]))
    ]
    return Section('failures', 'Failed', tables=[Table(('reason', 'rows', 'recordings'), rows)])


def _named(row: dict) -> str:
    return ' '.join(filter(None, (row['recording'], row['mount'])))


def _listed(names: Sequence[str]) -> str:
    more = [f'and {len(names) - _LISTED} more'] if len(names) > _LISTED else []
    return '\n'.join([*names[:_LISTED], *more])
