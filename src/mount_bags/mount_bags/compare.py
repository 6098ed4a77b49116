"""Two recordings against each other: every signal of every topic that both have, sample by sample."""

from collections.abc import Collection
from dataclasses import dataclass

import numpy as np

from mount_bags.alignment import Alignment, ComparisonError, align, paired_topics
from mount_bags.matched_topic import MatchedTopic
from mount_bags.origin import short_name
from mount_bags.reading import Recording
from mount_bags.recorded_events import marked_events
from mount_bags.series import registered_topic
from mount_bags.session_differences import session_differences, session_text
from mount_bags.signal_difference import SignalDifference, signal_difference
from mount_bags.switching_changes import SwitchingChange, paired_switchings, switching_times
from mount_bags.tolerances import Tolerances
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

    topic: str
    samples: int
    signals: tuple[SignalDifference, ...]
    only_a: int
    only_b: int
    outside_a: int
    outside_b: int
    differing_messages: int  # of a topic without signals
    remark: str


@dataclass(frozen=True)
class Comparison:
    """What two recordings have in common and what not; times in s on the time axis of A."""

    name_a: str
    name_b: str
    alignment: Alignment
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
    alignment = align(a, b)
    pairs = paired_topics(a, b)
    matched = matched_topics(a, b, alignment, topics)
    tolerances.check({(topic.topic, signal) for topic in matched for signal in topic.signals})
    if not any(topic.samples for topic in matched):
        raise ComparisonError(f'no sample is in both {a.path} and {b.path}; {alignment.sentence}')
    switching = _switching(matched)
    text_a, text_b = session_text(a), session_text(b)
    return Comparison(
        name_a=short_name(a),
        name_b=short_name(b),
        alignment=alignment,
        topics=tuple(_compared(topic, tolerances, switching is not None) for topic in matched),
        only_a=_lonely_topics(a, pairs, topics),
        only_b=_lonely_topics(b, pairs.values(), topics),
        sessions=tuple(session_differences(text_a, text_b)) if text_a and text_b else (),
        both_have_session=bool(text_a and text_b),
        marks_a=_lonely_marks(a, b),
        marks_b=_lonely_marks(b, a),
        switching=None if switching is None else tuple(switching),
        switching_tolerance=tolerances.switching,
        common_only=common_only,
    )


def matched_topics(
    a: Recording, b: Recording, alignment: Alignment, topics: Collection[Topic] | None = None
) -> list[MatchedTopic]:
    """Return the topics of both that are compared sample by sample; all, or those in `topics`."""
    return [
        MatchedTopic(a[name], b[other], alignment)
        for name, other in paired_topics(a, b).items()
        if registered_topic(name) not in (*_TOLD_OTHERWISE, *_OF_THE_MOMENT)
        and (topics is None or registered_topic(name) in topics)
    ]


def _compared(topic: MatchedTopic, tolerances: Tolerances, switching_told: bool) -> TopicComparison:
    (only_a, outside_a), (only_b, outside_b) = topic.lonely_samples()
    signals = {
        name: unit for name, unit in topic.signals.items() if not (switching_told and _is_switch(topic, name))
    }
    different = topic.different_messages()
    if different:
        grid = topic.grid()
        found = tuple(
            signal_difference(topic.column(name), tolerances.of(topic.topic, name), grid, topic.period)
            for name in signals
        )
    else:
        found = tuple(
            SignalDifference(topic.topic, name, unit, topic.samples) for name, unit in signals.items()
        )
    return TopicComparison(
        topic=topic.topic,
        samples=topic.samples,
        signals=found,
        only_a=only_a,
        only_b=only_b,
        outside_a=outside_a,
        outside_b=outside_b,
        differing_messages=0 if topic.signals else different,
        remark=_remark(topic),
    )


def _remark(topic: MatchedTopic) -> str:
    lonely = topic.lonely_signals
    return f'only one of both has {", ".join(lonely)}' if lonely else ''


def _is_switch(topic: MatchedTopic, signal: str) -> bool:
    return topic.topic == CONTROL_TRACE.name and signal == _ACTIVE


def _switching(matched: Collection[MatchedTopic]) -> list[SwitchingChange] | None:
    for topic in matched:
        if topic.samples and any(_is_switch(topic, signal) for signal in topic.signals):
            column = topic.column(_ACTIVE)
            if not np.isin(np.concatenate([column.a, column.b]), (0.0, 1.0)).all():
                return None  # no switch; compared as any other signal
            times = (switching_times(column.time, active) for active in (column.a, column.b))
            return paired_switchings(*times, topic.period)
    return None


def _lonely_topics(
    recording: Recording, paired: Collection[str], topics: Collection[Topic] | None
) -> tuple[str, ...]:
    return tuple(
        name
        for name, topic in recording.topics.items()
        if name not in paired and topic.message_count and (topics is None or registered_topic(name) in topics)
    )


def _lonely_marks(recording: Recording, other: Recording) -> tuple[str, ...]:
    known = {(event.kind, event.text) for event in marked_events(other)}
    return tuple(
        ' '.join(filter(None, (event.kind, event.text)))
        for event in marked_events(recording)
        if (event.kind, event.text) not in known
    )
