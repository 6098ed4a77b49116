"""Was anything lost? Each topic of a recording against its own stamps, each sample against its answer.

A sample that control does not answer leaves no setpoint and no trace that could be lost: setpoints and traces
are held against the samples, not against their own stamps.
"""

import math
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, replace

import numpy as np

from engine_mount.recordings.audit.answers import (
    Answers,
    Control,
    Latency,
    Setpoints,
    judge_answers,
    setpoint_latency,
    spanned,
)
from engine_mount.recordings.audit.node_reports import NodeReport, node_reports
from engine_mount.recordings.metadata import read_statement
from engine_mount.recordings.recording import Recording
from engine_mount.recordings.run.session import recorded_sample_rate
from engine_mount.recordings.series import SeriesError, TopicTimes
from engine_mount.recordings.time_axis import TimeAxis
from engine_mount.recordings.times import (
    NO_TIMES,
    Times,
    distinct,
    is_in,
    misdated,
    missing_samples,
    redated,
    regular_rate,
    stamp_jitter,
    stamp_statistics,
)
from mount_models.sampling import SAMPLE_RATE
from mount_recorder.losses import RECORDER_RECORD
from mount_recorder.stamp_watch import FARTHEST
from mount_recorder.topic_groups import registered_topic
from mount_ros.topics import (
    AIR_GAP,
    COIL_RIPPLE,
    CONTROL_TRACE,
    CURRENT_SETPOINT,
    DISPLACEMENT,
    Delivery,
    Topic,
)

AllTimes = Mapping[str, TopicTimes]

CONTROL = 'mount_control'  # the node
_CURRENT = CURRENT_SETPOINT.names[0]


@dataclass(frozen=True)
class TopicAudit:
    """What is there of a topic and what is not; None and NaN where it cannot be told, as `remark` says.

    `present` counts messages, `duplicated` those of them that repeat a sample, so that
    expected = present - duplicated + lost. The stamp of a `misdated` one cannot be that of its sample; for
    all else it counts as taken where it came. Of `displacement` are told `lost_samples`, counted once
    whether their displacement, their ripple or both are missing, and how the samples were answered;
    `latency` of `current_setpoint`.
    """

    expected: int | None
    present: int
    lost: int | None
    duplicated: int | None = None
    out_of_order: int | None = None
    misdated: int | None = None
    longest_gap_s: float = math.nan
    rate_hz: float = math.nan
    jitter_s: float = math.nan  # rms
    worst_jitter_s: float = math.nan
    lost_samples: int | None = None
    answers: Answers | None = None
    latency: Latency | None = None
    remark: str = ''

    @property
    def sound(self) -> bool:
        """Whether nothing is known to be lost, repeated, out of order or unanswered."""
        unanswered = self.answers is not None and (self.answers.unanswered or self.answers.silences)
        return not (self.lost or self.duplicated or self.out_of_order or self.misdated or unanswered)


def audit(recording: Recording) -> dict[str, TopicAudit]:
    """Return the audit of every topic in `recording` by its full name.

    Lost is what the stamps show, or what the recorder, the file's proven summary or `metadata.yaml` counted
    and is not there, whichever is more.
    """
    times, recorded = recording.times(), _recorder_counts(recording)
    rates = {name: _rate(recording, found) for name, found in times.items()}
    plausible = {name: _redated(found, rates[name]) for name, found in times.items()}
    audits = {
        name: _with_counts(
            _audit_topic(plausible, times[name], rates[name]),
            recording.missing.get(name, 0),
            recorded.get(name),
        )
        for name in recording
    }
    mounts = [name for name, found in times.items() if _own_topic(found) is DISPLACEMENT and len(found)]
    if mounts:
        reports, axis = node_reports(recording), recording.time_axis
        for namespace in (name.removesuffix(DISPLACEMENT.name) for name in mounts):
            answers = _answers(plausible, namespace, _inactive(reports, namespace, axis))
            lost = _lost_samples(plausible, audits, namespace, rates[namespace + DISPLACEMENT.name])
            sampled, traced = namespace + DISPLACEMENT.name, namespace + CONTROL_TRACE.name
            audits[sampled] = replace(audits[sampled], lost_samples=lost, answers=answers)
            if steps := _lost_steps(recording, plausible, namespace, answers):
                audits[traced] = _with_counts(audits[traced], steps, None)
    return audits


def _recorder_counts(recording: Recording) -> dict[str, int]:
    """Return how many messages of each topic the recorder says there ought to be."""
    recorded: dict[str, int] = {}
    for file in recording.files:
        for name, row in read_statement(file.metadata.get(RECORDER_RECORD, {})).items():
            recorded[name] = row.get('kept', 0) + max(0, row.get('lost', 0))
    return recorded


def _with_counts(entry: TopicAudit, missing: int, recorded: int | None) -> TopicAudit:
    """Return the audit with what others counted taken into account."""
    absent = max(missing, (recorded or 0) - entry.present)
    if absent <= 0:
        counted = recorded is not None and entry.expected is None
        return replace(entry, expected=entry.present, lost=0) if counted else entry
    lost = max(absent, entry.lost or 0)
    return replace(entry, expected=entry.present - (entry.duplicated or 0) + lost, lost=lost)


def _rate(recording: Recording, found: TopicTimes) -> float:
    """Return the rate (Hz) that a topic should have by registry and session, 0 where they tell none."""
    topic = _own_topic(found)
    if topic is None or topic.rate != SAMPLE_RATE:
        return topic.rate if topic is not None else 0.0
    return recorded_sample_rate(recording, found.topic.removesuffix(topic.name))


def _redated(found: TopicTimes, rate: float) -> TopicTimes:
    if found.stamps is None or not rate:
        return found
    return replace(found, stamps=redated(found.stamps, misdated(found.stamps), rate))


def _audit_topic(times: AllTimes, as_recorded: TopicTimes, own_rate: float) -> TopicAudit:
    name = as_recorded.topic
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
    rate = own_rate if topic is not None else regular_rate(found.stamps)
    if rate is None:
        return TopicAudit(None, present, None, remark='stamps without a regular rate: only counted')
    entry = _with_misdated(_from_stamps(found.stamps, topic, rate), as_recorded.stamps)
    sampled = name.removesuffix(topic.name if topic else '') + DISPLACEMENT.name
    if topic in (CURRENT_SETPOINT, CONTROL_TRACE) and len(_stamps_of(times, sampled)):
        entry = replace(entry, expected=entry.present - (entry.duplicated or 0), lost=0)
    if topic is CURRENT_SETPOINT and found.receive_times is not None:
        return replace(entry, latency=setpoint_latency(found.stamps, found.receive_times))
    return entry


def _own_topic(found: TopicTimes) -> Topic | None:
    """Return the registered topic of a series, None for a foreign one that only has the same name."""
    topic = registered_topic(found.topic, found.type)
    if topic is None:
        return None
    return topic if not found.names or set(topic.names) <= set(found.names) else None


def _from_stamps(stamps: Times, topic: Topic | None, rate: float) -> TopicAudit:
    jitter, worst = stamp_jitter(stamps, rate)
    return TopicAudit(
        **asdict(stamp_statistics(stamps, rate)),
        rate_hz=rate,
        jitter_s=jitter,
        worst_jitter_s=worst,
        remark='' if topic is not None else f'rate of {rate:.4g} Hz taken from the stamps',
    )


def _with_misdated(entry: TopicAudit, stamps: Times | None) -> TopicAudit:
    if stamps is None or not (wrong := misdated(stamps)).any():
        return entry
    first = int(np.flatnonzero(wrong)[0])
    most = (
        float(np.abs(stamps[wrong] - np.median(stamps[~wrong])).max()) / 1e9 if not wrong.all() else math.nan
    )
    remark = (
        f'stamps misdated: {np.count_nonzero(wrong)}, the first {stamps[first] / 1e9:.9f} s '
        f'of message {first + 1}, '
        f'up to {most:.6g} s off (limit {FARTHEST / 1e9:g} s); who else publishes there?'
    )
    return replace(entry, misdated=int(np.count_nonzero(wrong)), remark=remark)


def _lost_samples(
    times: AllTimes, audits: Mapping[str, TopicAudit], namespace: str, sample_rate: float
) -> int:
    """Return how many samples of a mount lack displacement or ripple, or more if others say so."""
    measured = [namespace + topic.name for topic in (DISPLACEMENT, COIL_RIPPLE)]
    found = missing_samples([_stamps_of(times, name) for name in measured], sample_rate)
    return max(found, *(audits[name].lost or 0 for name in measured if name in audits))


def _answers(times: AllTimes, namespace: str, inactive: Times | None) -> Answers | None:
    """Return how the samples of a mount were answered, None where its setpoints were not recorded."""
    name = namespace + CURRENT_SETPOINT.name
    stamps = _stamps_of(times, name)
    if not len(stamps) or (sent := times[name].publish_times) is None:
        return None
    setpoints = Setpoints(stamps, sent)
    control = Control(
        steps=_stamps_of(times, namespace + CONTROL_TRACE.name),
        handovers=_stamps_of(times, namespace + AIR_GAP.name),
        inactive=inactive,
    )
    return judge_answers(_stamps_of(times, namespace + DISPLACEMENT.name), setpoints, control)


def _lost_steps(recording: Recording, times: AllTimes, namespace: str, answers: Answers | None) -> int:
    """Return how many setpoints above 0 A have no trace: 0 A may be the answer to an invalid sample."""
    traced = _stamps_of(times, namespace + CONTROL_TRACE.name)
    if answers is None or not len(traced):
        return 0
    name = namespace + CURRENT_SETPOINT.name
    setpoints = _stamps_of(times, name)
    untraced = ~is_in(setpoints, np.sort(traced)) & (spanned(setpoints, answers.spans) >= 0)
    if not untraced.any():
        return 0
    recording.load_columns({name: (_CURRENT,)})
    try:
        above = recording[name][_CURRENT] > 0.0
    except SeriesError:
        return 0  # no setpoints of ours
    return len(distinct(setpoints[untraced & above]))


def _inactive(reports: Sequence[NodeReport], namespace: str, axis: TimeAxis) -> Times | None:
    """Return when the control of a mount said that it is inactive (stamps, ns), None if it said nothing."""
    own = [
        report
        for report in reports
        if report.node == CONTROL and report.namespace == namespace.strip('/') and report.state
    ]
    if not own:
        return None
    logged = np.array([report.log_time for report in own if report.state == 'inactive'], np.int64)
    return axis.stamps_at(logged)


def _stamps_of(times: AllTimes, name: str) -> Times:
    """Return the stamps (ns) of a topic by its full name, none if it is missing or has none."""
    stamps = times[name].stamps if name in times else None
    return NO_TIMES if stamps is None else stamps
