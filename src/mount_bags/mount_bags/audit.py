"""Was anything lost? Each topic of a recording against its own stamps, each sample against its answer."""

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from mount_bags.latency import Latency, setpoint_latency
from mount_bags.reading import Recording
from mount_bags.series import Times, registered_topic
from mount_bags.stamps import regular_rate, stamp_jitter, stamp_statistics
from mount_bags.statement import RECORDER_RECORD, read_statement
from mount_bags.topic_times import TopicTimes
from mount_ros.topics import AIR_GAP, CONTROL_TRACE, CURRENT_SETPOINT, DISPLACEMENT, Delivery, Topic

AllTimes = Mapping[str, TopicTimes]

_NO_TIMES: Times = np.empty(0, np.int64)
_PAUSE = 0.5  # s, chosen: a control that says nothing for so long was not active


@dataclass(frozen=True)
class TopicAudit:
    """What is there of a topic and what is not; None and NaN where it cannot be told, as `remark` says.

    `present` counts messages, `duplicated` those of them that repeat a sample, so that
    expected = present - duplicated + lost. `unanswered` of the `asked` samples of `displacement` have no
    setpoint although control was active; `latency` is told of `current_setpoint`.
    """

    expected: int | None
    present: int
    lost: int | None
    duplicated: int | None = None
    out_of_order: int | None = None
    longest_gap_s: float = math.nan
    rate_hz: float = math.nan
    jitter_s: float = math.nan  # rms
    worst_jitter_s: float = math.nan
    asked: int | None = None
    unanswered: int | None = None
    latency: Latency | None = None
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
    """Return the audit of every topic in `recording` by its full name.

    Lost is what the stamps show, or what the recorder, the file's proven summary or `metadata.yaml` counted
    and is not there, whichever is more.
    """
    times, told = recording.times(), _told_by_recorder(recording)
    return {
        name: _with_told(_audit_topic(times, name), recording.missing.get(name, 0), told.get(name))
        for name in recording
    }


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


def _told_by_recorder(recording: Recording) -> dict[str, int]:
    """Return how many messages of each topic the recorder says there ought to be."""
    told: dict[str, int] = {}
    for file in recording.files:
        for name, row in read_statement(file.metadata.get(RECORDER_RECORD, {})).items():
            told[name] = row.get('kept', 0) + max(0, row.get('lost', 0))
    return told


def _with_told(entry: TopicAudit, missing: int, told: int | None) -> TopicAudit:
    """Return the audit with what others counted taken into account."""
    absent = max(missing, (told or 0) - entry.present)
    if absent <= 0:
        counted = told is not None and entry.expected is None
        return replace(entry, expected=entry.present, lost=0) if counted else entry
    lost = max(absent, entry.lost or 0)
    return replace(entry, expected=entry.present - (entry.duplicated or 0) + lost, lost=lost)


def _audit_topic(times: AllTimes, name: str) -> TopicAudit:
    found = times[name]
    present = len(found)
    if not present:
        return TopicAudit(None, 0, None, remark='no message')
    topic = _own_topic(found)
    if topic is not None and topic.rate == 0.0:
        word = 'latched' if topic.delivery is Delivery.LATCHED else 'irregular'
        return TopicAudit(None, present, None, remark=f'{word}: only counted')
    if found.stamps is None:
        return TopicAudit(None, present, None, remark=f'{found.obstacle}: only counted')
    rate = topic.rate if topic is not None else regular_rate(found.stamps)
    if rate is None:
        return TopicAudit(None, present, None, remark='stamps without a regular rate: only counted')
    entry = _from_stamps(times, found.stamps, topic, name, rate)
    if topic is DISPLACEMENT:
        return _with_coverage(entry, times, name)
    if topic is CURRENT_SETPOINT:
        return replace(entry, latency=setpoint_latency(found.stamps, found.receive_times))
    return entry


def _own_topic(found: TopicTimes) -> Topic | None:
    """Return the registered topic of a series, None for a foreign one that only has the same name."""
    topic = registered_topic(found.topic)
    if topic is None or topic.type != found.type:
        return None
    return topic if not found.names or set(topic.names) <= set(found.names) else None


def _from_stamps(times: AllTimes, stamps: Times, topic: Topic | None, name: str, rate: float) -> TopicAudit:
    remark = '' if topic is not None else f'rate of {rate:.4g} Hz taken from the stamps'
    closed = stamps
    if topic is CURRENT_SETPOINT or topic is CONTROL_TRACE:
        closed, pauses = _without_pauses(stamps, times, name.removesuffix(topic.name), rate)
        remark = f'no loss: control was not active {pauses} times' if pauses else ''
    statistics, jitter = stamp_statistics(closed, rate), stamp_jitter(closed, rate)
    return TopicAudit(
        expected=statistics.expected,
        present=statistics.present,
        lost=statistics.lost,
        duplicated=statistics.duplicated,
        out_of_order=statistics.out_of_order,
        longest_gap_s=statistics.longest_gap,
        rate_hz=rate,
        jitter_s=jitter.rms,
        worst_jitter_s=jitter.worst,
        remark=remark,
    )


def _with_coverage(entry: TopicAudit, times: AllTimes, name: str) -> TopicAudit:
    namespace = name.removesuffix(DISPLACEMENT.name)
    answers = _stamps_of(times, f'{namespace}{CURRENT_SETPOINT.name}')
    if not answers.size:
        return entry
    handovers = _stamps_of(times, f'{namespace}{AIR_GAP.name}')
    coverage = setpoint_coverage(_stamps_of(times, name), answers, handovers)
    return replace(entry, asked=coverage.asked, unanswered=coverage.unanswered)


def _stamps_of(times: AllTimes, name: str) -> Times:
    """Return the stamps (ns) of a topic by its full name, none if it is missing or has none."""
    stamps = times[name].stamps if name in times else None
    return _NO_TIMES if stamps is None else stamps


def _without_pauses(stamps: Times, times: AllTimes, namespace: str, rate: float) -> tuple[Times, int]:
    """Return the stamps with the times taken out in which control was not active, and how many there were.

    That is after each handover from the initialisation, and where it is silent for long while the
    displacement goes on.
    """
    handovers = _stamps_of(times, f'{namespace}{AIR_GAP.name}')
    displacements = np.sort(_stamps_of(times, f'{namespace}{DISPLACEMENT.name}'))
    ordered = np.unique(stamps)
    steps = np.diff(ordered)
    period = round(1e9 / rate)
    between = np.diff(np.searchsorted(displacements, ordered))
    silent = (steps > _PAUSE * 1e9) & (between > 0.5 * steps / period)
    pauses = (silent | np.isin(ordered[:-1], handovers)) & (steps > period)
    shift = np.concatenate([[0], np.cumsum(np.where(pauses, steps - period, 0))])
    counted = int(np.count_nonzero(pauses & (np.rint(steps / period) > 1)))
    return stamps - shift[np.searchsorted(ordered, stamps)], counted
