"""The page about the result of a fleet: what was asked, how figures are spread, the worst, what has none."""

import json
from collections import defaultdict
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

from engine_mount.reports.fleet.distributions import pairs_of, spread
from engine_mount.reports.fleet.looks import Look, look_section, quantity, worst_section
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

Rows = Sequence[Mapping[str, Any]]

_ANOTHER_POLICY = 'another policy'  # in the column `outcome`: the change does not concern these
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
_ANSWERS = {
    'peak_displacement_m': 'largest displacement',
    'rms_displacement_m': 'rms displacement',
    'mean_current_a': 'mean current',
    'pad_energy_j': 'wear',
}
"""{figure: its word}; their sums over all rows are the answer above the page. Wear: the work in the pads."""
_OF_MOTION = ('displacement', 'mount_force')  # in names of figures: what is looked for in a closed loop
_LISTED = 20  # recordings that are named beside their reason, chosen


def fleet_report(result: 'pyarrow.Table', looks: Sequence[Look], by: str, name: str) -> Report:
    """Return the page about `result`, the table of `engine-mount fleet replay`.

    `looks` are the worst recordings by the column `by`, the worst first; `name` is that of the fleet.
    """
    rows = result.to_pylist()
    questions = [_ASKED[asked] for asked in dict.fromkeys(row['asked'] for row in rows)]
    question = questions[0][0] if len(questions) == 1 else 'several questions'
    others = [row for row in rows if row.get('outcome') == _ANOTHER_POLICY]
    failed = [row for row in rows if row['reason'] and row.get('outcome') != _ANOTHER_POLICY]
    done = [row for row in rows if not row['reason']]
    known = {pair.name: pair for pair in pairs_of(result)}
    answers = [
        f'{word} {100.0 * (pair.after.sum() / pair.before.sum() - 1.0):+.0f} %'
        for name, word in _ANSWERS.items()
        if (pair := known.get(name)) and pair.before.any()
    ]
    pairs = sorted(
        (pair for pair in known.values() if pair.moved),
        key=lambda pair: not any(word in pair.name for word in _OF_MOTION),
    )
    sections = [
        _overview(rows, done, failed, [words for _, words in questions]),
        worst_section(looks, by, result.schema),
        *map(spread, pairs),
        *(look_section(number, look) for number, look in enumerate(looks, 1)),
    ]
    if others:
        words = 'The change does not concern these: their policy does not have a parameter that was changed.'
        sections.append(Section('another_policy', 'Another policy', [words], tables=[_reasons(others)]))
    tables = [_reasons(failed)] if failed else []
    sections.append(Section('failures', 'Failed', [] if failed else ['Nothing failed.'], tables=tables))
    return Report(f'Fleet {name}: {", ".join(answers) or question}', sections)


def _overview(rows: Rows, done: Rows, failed: Rows, words: Sequence[str]) -> Section:
    changes = json.loads(next((row['changes'] for row in rows if row.get('changes')), '{}'))
    parameters = [
        (f'{node}.{name}', json.dumps(value))
        for node, values in changes.items()
        for name, value in values.items()
    ]
    is_simulated = {row['asked'] for row in rows} == {DISPLACEMENT}
    findings = [
        _recordings(rows, done, failed, 'simulated' if is_simulated else 'replayed'),
        *([] if is_simulated else [_trusted(rows)]),
    ]
    tables = [Table(('parameter', 'changed to'), parameters)] if parameters else []
    return Section('overview', 'Overview', words, findings=findings, tables=tables)


def _recordings(rows: Rows, done: Rows, failed: Rows, verb: str) -> Finding:
    every, without = ({row['recording'] for row in each} for each in (rows, failed))
    replayed = {row['recording'] for row in done} - without
    seconds = sum(row['duration_s'] or 0.0 for row in rows)
    length = f'{seconds / 3600.0:.1f} h' if seconds >= 3600.0 else f'{seconds:.0f} s'
    text: list[Cell] = [f'{len(every)} recordings: {len(replayed)} {verb} ({length}),']
    if others := len(every - without - replayed):
        text += [Link(f'{others} with another policy', 'another_policy'), 'and']
    text.append(Link(f'{len(without)} failed', 'failures') if failed else 'none failed')
    return Finding('Recordings', LOOK if failed or not replayed else GOOD, text)


def _trusted(rows: Rows) -> Finding:
    """Judge whether the replay without the change gives what was recorded."""
    known = [row for row in rows if row.get('as_recorded') is not None]
    others = [row for row in known if not row['as_recorded']]
    judgement, text = GOOD, f'gives the recorded setpoints of all {len(known)} rows'
    if not known:
        judgement, text = UNKNOWN, 'nothing was recorded to compare it with'
    elif others:
        largest = max(row['as_recorded_largest_a'] or 0.0 for row in others)
        judgement, text = (
            BAD,
            f'does not give the recorded setpoints of {len(others)} of {len(known)} rows, by up to '
            f'{quantity(largest, "A")}: they were recorded with other parameters, another version, or losses',
        )
    return Finding('Replay without the change', judgement, [text])


def _reasons(rows: Rows) -> Table:
    """Return why rows have no figures, each reason once with its recordings."""
    reasons = defaultdict(list)
    for row in rows:
        reasons[row['reason'].replace(row['recording'], '...')].append(row)
    found = []
    for reason, each in sorted(reasons.items(), key=lambda item: -len(item[1])):
        names = [_name(row) for row in each]
        more = [f'and {len(names) - _LISTED} more'] if len(names) > _LISTED else []
        text = each[0]['reason'] if len(each) == 1 else reason
        found.append((str(len(each)), text, '\n'.join([*names[:_LISTED], *more])))
    return Table(('rows', 'reason', 'recordings'), found)


def _name(row: Mapping[str, Any]) -> str:
    return ' '.join(filter(None, (row['recording'], row['mount'])))
