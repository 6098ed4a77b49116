"""Was anything lost? Each topic of a recording against its own stamps, each sample against its answer."""

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from rich.table import Table

from mount_bags.reading import Recording
from mount_bags.series import SeriesError, Times, registered_topic
from mount_bags.stamps import stamp_statistics
from mount_ros.topics import AIR_GAP, CURRENT_SETPOINT, DISPLACEMENT

_NO_TIMES: Times = np.empty(0, np.int64)
_TROUBLES = {'duplicated': 'twice', 'out_of_order': 'order', 'unanswered': 'unanswered'}
_PAUSE = 0.5  # s, chosen: a control that says nothing for so long was not active


@dataclass(frozen=True)
class TopicAudit:
    """What is there of a topic and what is not; None where the topic has no rate or no stamps.

    `present` counts messages, `duplicated` those of them that repeat a sample, so that
    expected = present - duplicated + lost. `unanswered` is only told of `displacement`: samples
    without a setpoint while control was active.
    """

    expected: int | None
    present: int
    lost: int | None
    duplicated: int | None
    out_of_order: int | None
    longest_gap_s: float
    unanswered: int | None = None
    remark: str = ''

    @property
    def sound(self) -> bool:
        """Whether nothing is known to be lost, repeated, out of order or unanswered."""
        return not (self.lost or self.duplicated or self.out_of_order or self.unanswered)


@dataclass(frozen=True)
class SetpointCoverage:
    """Samples of the displacement while control was active, and those that no setpoint answers."""

    asked: int
    unanswered: int
    spans: int  # how often control was active


def audit(recording: Recording) -> dict[str, TopicAudit]:
    """Return the audit of every topic in `recording` by its full name."""
    return {name: _audit_topic(recording, name) for name in recording}


def setpoint_coverage(
    displacements: Times, setpoints: Times, handovers: Times = _NO_TIMES
) -> SetpointCoverage:
    """Return how the setpoints answer the displacements; all are stamps in ns.

    A setpoint has the stamp of the sample that it answers. Setpoints are taken as wanted from one to the
    next unless they are more than 0.5 s apart, or the first is the last of an initialisation: `handovers`
    are the stamps of the air gaps, after which the controller has yet to be activated.
    """
    answers = np.unique(setpoints)
    samples = np.unique(displacements)
    if answers.size == 0:
        return SetpointCoverage(0, 0, 0)
    is_pause = (np.diff(answers) > _PAUSE * 1e9) | np.isin(answers[:-1], handovers)
    pauses = np.flatnonzero(is_pause)
    begins = answers[np.concatenate([[0], pauses + 1])]
    ends = answers[np.concatenate([pauses, [answers.size - 1]])]
    span = np.searchsorted(begins, samples, side='right') - 1
    asked = samples[(span >= 0) & (samples <= ends[np.maximum(span, 0)])]
    unanswered = int(np.count_nonzero(~np.isin(asked, answers)))
    return SetpointCoverage(int(asked.size), unanswered, int(begins.size))


def as_json(audits: Mapping[str, TopicAudit]) -> dict[str, dict[str, Any]]:
    """Return the figures as JSON knows them: unknown is null."""
    return {
        name: {
            'expected': entry.expected,
            'present': entry.present,
            'lost': entry.lost,
            'duplicated': entry.duplicated,
            'longest_gap_s': None if math.isnan(entry.longest_gap_s) else entry.longest_gap_s,
            'out_of_order': entry.out_of_order,
            'unanswered': entry.unanswered,
        }
        for name, entry in audits.items()
    }


def as_table(audits: Mapping[str, TopicAudit]) -> Table:
    """Return the figures as a table for people; columns of troubles that nobody has are left out."""
    table = Table(title='Was anything lost?', title_justify='left')
    table.add_column('topic', no_wrap=True)
    for title in ('expected', 'present', 'lost', 'longest gap'):
        table.add_column(title, justify='right', no_wrap=True)
    troubles = [name for name in _TROUBLES if any(getattr(entry, name) for entry in audits.values())]
    for name in troubles:
        table.add_column(_TROUBLES[name], justify='right')
    for name, entry in audits.items():
        gap = '' if math.isnan(entry.longest_gap_s) else f'{1e3 * entry.longest_gap_s:.1f} ms'
        table.add_row(
            name,
            *map(_cell, (entry.expected, entry.present, entry.lost)),
            gap,
            *(_cell(getattr(entry, trouble)) for trouble in troubles),
            style=None if entry.sound else 'yellow',
        )
    return table


def _audit_topic(recording: Recording, name: str) -> TopicAudit:
    series = recording[name]
    topic = registered_topic(name)
    if topic is None or topic.rate == 0.0 or not len(series):
        remark = '' if len(series) else 'no message'
        return TopicAudit(None, len(series), None, None, None, math.nan, remark=remark)
    try:
        stamps = series.stamps
        if topic is CURRENT_SETPOINT:
            stamps = _without_handovers(stamps, _handovers(recording, name), topic.rate)
        statistics = stamp_statistics(stamps, topic.rate)
    except SeriesError as error:
        return TopicAudit(None, len(series), None, None, None, math.nan, remark=str(error))
    return TopicAudit(
        expected=statistics.expected,
        present=statistics.present,
        lost=statistics.lost,
        duplicated=statistics.duplicated,
        out_of_order=statistics.out_of_order,
        longest_gap_s=statistics.longest_gap,
        unanswered=_unanswered(recording, name) if topic is DISPLACEMENT else None,
    )


def _unanswered(recording: Recording, name: str) -> int | None:
    namespace = name.removesuffix(DISPLACEMENT.name)
    setpoints = f'{namespace}{CURRENT_SETPOINT.name}'
    if setpoints not in recording or not len(recording[setpoints]):
        return None
    try:
        handovers = _handovers(recording, setpoints)
        return setpoint_coverage(recording[name].stamps, recording[setpoints].stamps, handovers).unanswered
    except SeriesError:
        return None


def _handovers(recording: Recording, setpoints: str) -> Times:
    """Return the stamps (ns) of the air gaps that belong to the topic `setpoints`."""
    air_gaps = f'{setpoints.removesuffix(CURRENT_SETPOINT.name)}{AIR_GAP.name}'
    return recording[air_gaps].stamps if air_gaps in recording else _NO_TIMES


def _without_handovers(stamps: Times, handovers: Times, rate: float) -> Times:
    """Return the stamps with the pause after each handover taken out."""
    period = round(1e9 / rate)
    shifted = stamps.copy()
    for handover in handovers:
        after = stamps[stamps > handover]
        if after.size and handover in stamps:
            shifted[stamps > handover] -= after.min() - handover - period
    return shifted


def _cell(count: int | None) -> str:
    return '' if count is None else str(count)
