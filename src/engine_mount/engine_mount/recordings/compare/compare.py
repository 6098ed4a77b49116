"""Two recordings against each other: every signal of every topic that both have, sample by sample."""

from collections import Counter
from collections.abc import Collection, Iterable, Mapping
from dataclasses import dataclass

import numpy as np

from engine_mount.recordings.bag.recording import Recording
from engine_mount.recordings.compare.alignment import (
    Alignment,
    Alignments,
    ComparisonError,
    align,
    mount_of,
    paired_topics,
    registered_in,
)
from engine_mount.recordings.compare.matched_topic import MatchedTopic
from engine_mount.recordings.compare.signal_difference import SignalDifference, signal_difference
from engine_mount.recordings.compare.tolerances import Tolerances
from engine_mount.recordings.events.recorded_events import recorded_marks
from engine_mount.recordings.events.switching_changes import (
    SwitchingChange,
    paired_switchings,
    switching_times,
)
from engine_mount.recordings.run.session import recorded_sessions
from engine_mount.recordings.run.session_differences import session_differences
from mount_ros.topics import CONTROL_TRACE, DIAGNOSTICS, EVENT, SESSION, Topic

_TOLD_OTHERWISE = (SESSION, EVENT)  # in words of their own
_OF_THE_MOMENT = (DIAGNOSTICS,)  # clock time, load: never equal
_ACTIVE = 'damping_active'


@dataclass(frozen=True)
class TopicComparison:
    """One topic of both: its signals, and how many samples are in one recording alone.

    `only_a` and `only_b` are samples within the time that both recordings cover with this topic,
    `outside_a` and `outside_b` those before and behind it.
    """

    mount: str  # what stands before the topic where it is of a namespace: `mount_left/`
    topic: str
    samples: int
    signals: tuple[SignalDifference, ...]
    only_a: int
    only_b: int
    outside_a: int
    outside_b: int
    differing_messages: int  # in what no signal shows
    remark: str

    @property
    def name(self) -> str:
        """Mount and topic."""
        return f'{self.mount}{self.topic}'


@dataclass(frozen=True)
class Comparison:
    """What two recordings have in common and what not; times in s on the time axis of A."""

    name_a: str
    name_b: str
    alignments: Alignments
    topics: tuple[TopicComparison, ...]
    only_a: tuple[str, ...]  # topics
    only_b: tuple[str, ...]
    sessions: tuple[str, ...]  # differences in words
    both_have_session: bool
    marks_a: tuple[str, ...]  # events that the other has not
    marks_b: tuple[str, ...]
    switching: tuple[SwitchingChange, ...] | None  # None: not told by both
    switching_tolerance: float
    common_only: bool

    @property
    def alignment(self) -> Alignment:
        """That of the only mount, or of the first."""
        return self.alignments.first

    @property
    def signals(self) -> list[SignalDifference]:
        """All signals that both have."""
        return [signal for topic in self.topics for signal in topic.signals]

    @property
    def differing(self) -> list[SignalDifference]:
        """The signals that differ beyond their tolerance."""
        return [signal for signal in self.signals if signal.differing]

    @property
    def switching_changes(self) -> list[SwitchingChange]:
        """The switchings that appeared, vanished, or moved beyond the tolerance."""
        least = self.switching_tolerance + 1e-9
        return [change for change in self.switching or () if change.alone or abs(change.moved) > least]

    @property
    def incomplete(self) -> list[TopicComparison]:
        """The topics of which one recording lacks samples, or whose messages differ."""
        return [
            topic
            for topic in self.topics
            if topic.only_a
            or topic.only_b
            or topic.differing_messages
            or (not self.common_only and (topic.outside_a or topic.outside_b))
        ]

    @property
    def equal(self) -> bool:
        """Whether nothing differs beyond the tolerances; topics of one recording alone do not count."""
        return not (self.incomplete or self.switching_changes or self.differing)


def compare(
    a: Recording,
    b: Recording,
    tolerances: Tolerances | None = None,
    *,
    common_only: bool = False,
    topics: Collection[Topic] | None = None,
) -> Comparison:
    """Compare `b` with `a`; raises `ComparisonError` if no sample belongs to both, `ToleranceError`.

    `common_only` leaves samples before and behind the common time of a topic out of account; `topics` are
    the only ones to compare.
    """
    tolerances = tolerances or Tolerances()
    alignments = align(a, b)
    pairs = paired_topics(a, b)
    matched = matched_topics(a, b, alignments, topics)
    tolerances.check({(topic.mount, topic.topic, signal) for topic in matched for signal in topic.signals})
    if not any(topic.samples for topic in matched):
        raise ComparisonError(f'no sample is in both {a.path} and {b.path}; {alignments.sentence}')
    switching = _switching(matched)
    marks_a, marks_b = _marks(a, {}), _marks(b, {other: name for name, other in pairs.items()})
    sessions = _sessions(a, b, pairs)
    return Comparison(
        name_a=a.short_name,
        name_b=b.short_name,
        alignments=alignments,
        topics=tuple(_compared(topic, tolerances, switching) for topic in matched),
        only_a=_unpaired_topics(a, pairs, topics),
        only_b=_unpaired_topics(b, pairs.values(), topics),
        sessions=tuple(sessions or ()),
        both_have_session=sessions is not None,
        marks_a=tuple((marks_a - marks_b).elements()),
        marks_b=tuple((marks_b - marks_a).elements()),
        switching=_in_time(switching.values()) if switching else None,
        switching_tolerance=tolerances.switching,
        common_only=common_only,
    )


def matched_topics(
    a: Recording, b: Recording, alignments: Alignments, topics: Collection[Topic] | None = None
) -> list[MatchedTopic]:
    """Return the topics of both that are compared sample by sample; all, or those in `topics`."""
    return [
        MatchedTopic(a[name], b[other], alignments.of(a[name]))
        for name, other in paired_topics(a, b).items()
        if _wanted(registered_in(a, name), topics)
    ]


def _wanted(registered: Topic | None, topics: Collection[Topic] | None) -> bool:
    return registered not in (*_TOLD_OTHERWISE, *_OF_THE_MOMENT) and (topics is None or registered in topics)


def _compared(
    topic: MatchedTopic, tolerances: Tolerances, switching: Mapping[str, list[SwitchingChange]]
) -> TopicComparison:
    (only_a, outside_a), (only_b, outside_b) = topic.unmatched_samples()
    signals = {
        name: unit
        for name, unit in topic.signals.items()
        if not (topic.mount in switching and _is_switch(topic, name) and _only_on_or_off(topic))
    }
    hidden = 0
    if topic.different_messages().any():
        hidden = int(np.count_nonzero(topic.hidden_differences()))
        grid = topic.grid()
        found = tuple(
            signal_difference(
                topic.column(name), tolerances.of(topic.mount, topic.topic, name), grid, topic.period
            )
            for name in signals
        )
    else:
        found = tuple(
            SignalDifference(topic.mount, topic.topic, name, unit, topic.samples)
            for name, unit in signals.items()
        )
    return TopicComparison(
        mount=topic.mount,
        topic=topic.topic,
        samples=topic.samples,
        signals=found,
        only_a=only_a,
        only_b=only_b,
        outside_a=outside_a,
        outside_b=outside_b,
        differing_messages=hidden,
        remark=_remark(topic),
    )


def _remark(topic: MatchedTopic) -> str:
    if topic.a.type != topic.b.type:
        return f'in A it is {topic.a.type}, in B {topic.b.type}'
    unmatched = topic.unmatched_signals
    return f'only one of both has {", ".join(unmatched)}' if unmatched else ''


def _is_switch(topic: MatchedTopic, signal: str) -> bool:
    return topic.topic == CONTROL_TRACE.name and signal == _ACTIVE


def _switching(matched: Collection[MatchedTopic]) -> dict[str, list[SwitchingChange]]:
    """Return the switchings of each mount that tells of them in both recordings."""
    found = {}
    for topic in matched:
        if topic.samples and any(_is_switch(topic, signal) for signal in topic.signals):
            column = topic.column(_ACTIVE)
            both = np.concatenate([column.a, column.b])
            if ((both >= 0.0) & (both <= 1.0)).all():
                times = (switching_times(column.time, active) for active in (column.a, column.b))
                found[topic.mount] = paired_switchings(*times, topic.period, topic.mount)
    return found  # what is no switch is compared as any other signal, an opening as both


def _only_on_or_off(topic: MatchedTopic) -> bool:
    column = topic.column(_ACTIVE)
    return bool(np.isin(np.concatenate([column.a, column.b]), (0.0, 1.0)).all())


def _in_time(switchings: Iterable[list[SwitchingChange]]) -> tuple[SwitchingChange, ...]:
    return tuple(sorted((change for each in switchings for change in each), key=lambda change: change.time))


def _unpaired_topics(
    recording: Recording, paired: Collection[str], topics: Collection[Topic] | None
) -> tuple[str, ...]:
    return tuple(
        name
        for name, topic in recording.topics.items()
        if name not in paired
        and topic.message_count
        and (topics is None or registered_in(recording, name) in topics)
    )


def _sessions(a: Recording, b: Recording, pairs: Mapping[str, str]) -> list[str] | None:
    """Return how the sessions differ, mount by mount; None where no mount has one in both."""
    texts_a, texts_b = recorded_sessions(a), recorded_sessions(b)
    both = [(name, other) for name, other in pairs.items() if texts_a.get(name) and texts_b.get(other)]
    if not both:
        return None
    return [
        mount_of(name, SESSION).replace('/', ': ') + difference
        for name, other in both
        for difference in session_differences(texts_a[name], texts_b[other])
    ]


def _marks(recording: Recording, renamed: Mapping[str, str]) -> Counter[str]:
    """Return the marks as text, each with its mount, of a topic in `renamed` with that of the other name."""
    return Counter(
        mount_of(renamed.get(name, name), EVENT).replace('/', ': ')
        + ' '.join(filter(None, (mark.kind, mark.text)))
        for name, marks in recorded_marks(recording).items()
        for _, mark in marks
    )
