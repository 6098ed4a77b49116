"""Was anything lost? Each topic of a recording against its own stamps, each sample against its answer.

A sample that control does not answer leaves no setpoint and no trace that could be lost: setpoints and traces
are held against the samples, not against their own stamps.
"""

import math
from collections.abc import Mapping
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from engine_mount.recordings.answers import (
    Answers,
    Control,
    Latency,
    Setpoints,
    Span,
    judge_answers,
    setpoint_latency,
    spanned,
)
from engine_mount.recordings.events import CONTROL, node_reports
from engine_mount.recordings.metadata import read_statement
from engine_mount.recordings.recording import Recording
from engine_mount.recordings.series import Column, Series, SeriesError
from engine_mount.recordings.session import recorded_sample_rate
from engine_mount.recordings.times import (
    MOST_JITTER,
    NO_TIMES,
    Times,
    distinct,
    is_in,
    jitter_share,
    misdated,
    missing_samples,
    redated,
    stamp_statistics,
)
from mount_models.sampling import SAMPLE_RATE
from mount_recorder.losses import RECORDER_RECORD
from mount_recorder.stamp_watch import FARTHEST
from mount_ros.topics import (
    AIR_GAP,
    COIL_RIPPLE,
    CONTROL_TRACE,
    CURRENT_SETPOINT,
    DISPLACEMENT,
    Delivery,
    Topic,
)


class TopicAudit(NamedTuple):
    """What is there of a topic and what is not; None and NaN where it cannot be told, as `remark` says.

    `present` counts messages, `duplicated` those of them that repeat a sample, so that
    expected = present - duplicated + lost. The 0 A with which control ends repeats the last stamp, and is no
    duplicate. The stamp of a `misdated` one cannot be that of its sample; for
    all else it counts as taken where it came. `displacement` has `lost_samples`, counted once
    whether their displacement, their ripple or both are missing, and how the samples were answered;
    `current_setpoint` has `latency`.
    """

    expected: int | None
    present: int
    lost: int | None
    duplicated: int | None = None
    out_of_order: int | None = None
    misdated: int | None = None
    longest_gap_s: float = math.nan
    rate_hz: float = math.nan
    lost_samples: int | None = None
    answers: Answers | None = None
    latency: Latency | None = None
    remark: str = ''

    @property
    def sound(self) -> bool:
        """Whether nothing is known to be lost, repeated, out of order or unanswered."""
        unanswered = self.answers is not None and (self.answers.unanswered or self.answers.silences)
        return not (self.lost or self.duplicated or self.out_of_order or self.misdated or unanswered)


class _Topic(NamedTuple):
    """A topic as it is judged: misdated stamps are set to where the rate (Hz) puts their samples."""

    series: Series
    registered: Topic | None  # None for a foreign one that only has the same name
    rate: float  # by registry and session, 0 where they tell none
    wrong: NDArray[np.bool_]
    stamps: Times
    obstacle: str = ''  # why there are no stamps
    closed: bool = False  # whether the last one is the 0 A with which control ends


class _Mount(NamedTuple):
    """The topics of one mount."""

    namespace: str
    topics: Mapping[str, _Topic]

    def stamps(self, topic: Topic) -> Times:
        """Return the stamps (ns) of a topic, none where it is missing."""
        name = self.namespace + topic.name
        return self.topics[name].stamps if name in self.topics else NO_TIMES


def audit(recording: Recording) -> dict[str, TopicAudit]:
    """Return the audit of every topic in `recording` by its full name.

    Lost is what the stamps show, or what the recorder, the file's proven summary or `metadata.yaml` counted
    and is not there, whichever is more.
    """
    recording.load_times()
    topics = {name: _judged(recording, recording[name]) for name in recording}
    counted = {
        name: row.get('kept', 0) + max(0, row.get('lost', 0))
        for file in recording.files
        for name, row in read_statement(file.metadata.get(RECORDER_RECORD, {})).items()
    }
    audits = {
        name: _with_counts(_from_stamps(name, topics), recording.missing.get(name, 0), counted.get(name))
        for name in recording
    }
    for name in [name for name, topic in topics.items() if topic.registered is DISPLACEMENT]:
        if not len(topics[name].series):
            continue
        mount = _Mount(name.removesuffix(DISPLACEMENT.name), topics)
        answers = _answers(recording, mount)
        measured = [mount.stamps(each) for each in (DISPLACEMENT, COIL_RIPPLE)]
        own = [audits.get(mount.namespace + each.name) for each in (DISPLACEMENT, COIL_RIPPLE)]
        lost = [entry.lost or 0 for entry in own if entry is not None]
        audits[name] = audits[name]._replace(
            lost_samples=max(missing_samples(measured, topics[name].rate), *lost),
            answers=answers,
        )
        if answers is not None and (steps := _lost_steps(recording, mount, answers)):
            traced = mount.namespace + CONTROL_TRACE.name
            audits[traced] = _with_counts(audits[traced], steps, None)
    return audits


def control_spans(audits: Mapping[str, TopicAudit]) -> dict[str, tuple[Span, ...]]:
    """Return the spans in which control was active by the topic of its setpoints."""
    return {
        name.removesuffix(DISPLACEMENT.name) + CURRENT_SETPOINT.name: entry.answers.spans
        for name, entry in audits.items()
        if entry.answers is not None
    }


def _judged(recording: Recording, series: Series) -> _Topic:
    topic = series.registered
    if topic is not None and series.first_names and not set(topic.names) <= set(series.first_names):
        topic = None
    rate = topic.rate if topic is not None else 0.0
    if topic is not None and rate == SAMPLE_RATE:
        rate = recorded_sample_rate(recording, series.topic.removesuffix(topic.name))
    try:
        stamps, obstacle = series.stamps, ''
    except SeriesError as error:
        why = str(error).removeprefix(f'{series.topic}: ').removesuffix('; use receive_times')
        stamps, obstacle = NO_TIMES, why
    wrong = misdated(stamps)
    closed = topic is CURRENT_SETPOINT and len(stamps) > 1 and stamps[-2] == stamps[-1]
    closed = closed and _currents(recording, series.topic)[-1] == 0.0
    return _Topic(
        series, topic, rate, wrong, redated(stamps, wrong, rate) if rate else stamps, obstacle, bool(closed)
    )


def _currents(recording: Recording, topic: str) -> Column:
    """Return the setpoints, A; NaN where they are no setpoints of ours."""
    current = CURRENT_SETPOINT.names[0]
    recording.load_columns({topic: (current,)})
    try:
        return recording[topic][current]
    except SeriesError:
        return np.full(len(recording[topic]), math.nan)


def _from_stamps(name: str, topics: Mapping[str, _Topic]) -> TopicAudit:
    series, topic, rate, wrong, stamps, obstacle, closed = topics[name]
    present = len(series)
    if not present:
        return TopicAudit(None, 0, None, remark='no message')
    why = obstacle
    if topic is None:
        why = obstacle or 'no declared rate'
    elif topic.rate == 0.0:
        why = 'latched' if topic.delivery is Delivery.LATCHED else 'irregular'
    elif (share := jitter_share(stamps, rate)) > MOST_JITTER:
        why = f'{100 * share:.3g} % of the stamps are beside the rate (limit {100 * MOST_JITTER:g} %)'
    if why:
        return TopicAudit(None, present, None, remark=f'{why}: only counted')
    entry = TopicAudit(
        **stamp_statistics(stamps, rate)._asdict(),
        misdated=int(np.count_nonzero(wrong)) or None,
        rate_hz=rate,
        remark=_misdated_remark(series.stamps, wrong) if wrong.any() else '',
    )
    entry = entry._replace(
        duplicated=(entry.duplicated or 0) - closed, expected=(entry.expected or 0) + closed
    )
    if topic in (CURRENT_SETPOINT, CONTROL_TRACE):
        if len(_Mount(name.removesuffix(topic.name), topics).stamps(DISPLACEMENT)):
            entry = entry._replace(expected=entry.present - (entry.duplicated or 0), lost=0)
        if topic is CURRENT_SETPOINT:
            entry = entry._replace(latency=setpoint_latency(stamps, series.receive_times))
    return entry


def _misdated_remark(stamps: Times, wrong: NDArray[np.bool_]) -> str:
    first, sound = int(np.argmax(wrong)), stamps[~wrong]
    most = float(np.abs(stamps[wrong] - np.median(sound)).max()) / 1e9 if len(sound) else math.nan
    return (
        f'stamps misdated: {np.count_nonzero(wrong)}, the first {stamps[first] / 1e9:.9f} s '
        f'of message {first + 1}, '
        f'up to {most:.6g} s off (limit {FARTHEST / 1e9:g} s); who else publishes there?'
    )


def _with_counts(entry: TopicAudit, missing: int, recorded: int | None) -> TopicAudit:
    """Return the audit with what others counted taken into account."""
    absent = max(missing, (recorded or 0) - entry.present)
    if absent <= 0:
        counted = recorded is not None and entry.expected is None
        return entry._replace(expected=entry.present, lost=0) if counted else entry
    lost = max(absent, entry.lost or 0)
    return entry._replace(expected=entry.present - (entry.duplicated or 0) + lost, lost=lost)


def _answers(recording: Recording, mount: _Mount) -> Answers | None:
    """Return how the samples of a mount were answered, None where its setpoints were not recorded."""
    stamps = mount.stamps(CURRENT_SETPOINT)
    if not len(stamps):
        return None
    own = [
        report
        for report in node_reports(recording)
        if report.node == CONTROL and report.namespace == mount.namespace.strip('/') and report.state
    ]
    inactive = np.array([report.log_time for report in own if report.state == 'inactive'], np.int64)
    control = Control(
        steps=mount.stamps(CONTROL_TRACE),
        handovers=mount.stamps(AIR_GAP),
        inactive=recording.time_axis.stamps_at(inactive) if own else None,
    )
    sent = mount.topics[mount.namespace + CURRENT_SETPOINT.name].series.publish_times
    return judge_answers(mount.stamps(DISPLACEMENT), Setpoints(stamps, sent), control)


def _lost_steps(recording: Recording, mount: _Mount, answers: Answers) -> int:
    """Return how many setpoints above 0 A have no trace: 0 A may be the answer to an invalid sample."""
    traced, setpoints = mount.stamps(CONTROL_TRACE), mount.stamps(CURRENT_SETPOINT)
    untraced = ~is_in(setpoints, np.sort(traced)) & (spanned(setpoints, answers.spans) >= 0)
    if not len(traced) or not untraced.any():
        return 0
    currents = _currents(recording, mount.namespace + CURRENT_SETPOINT.name)
    return len(distinct(setpoints[untraced & (currents > 0.0)]))
