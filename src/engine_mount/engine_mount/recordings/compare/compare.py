"""Two recordings against each other: every signal of every topic that both have, sample by sample."""

from collections import Counter
from collections.abc import Collection, Mapping
from dataclasses import dataclass
from typing import Any

from engine_mount.recordings.compare.alignment import (
    Alignment,
    Alignments,
    ComparisonError,
    align,
    mount_of,
    paired_topics,
    registered_in,
)
from engine_mount.recordings.compare.quantity_text import quantity_text, time_text
from engine_mount.recordings.compare.signals import SHOWN, SignalDifference, few, signal_sentences
from engine_mount.recordings.compare.tolerances import Tolerances
from engine_mount.recordings.compare.topics import SWITCH, MatchedTopic, TopicComparison
from engine_mount.recordings.events.recorded_events import recorded_marks
from engine_mount.recordings.events.switching_changes import (
    SwitchingChange,
    paired_switchings,
    switching_times,
)
from engine_mount.recordings.recording import Recording
from engine_mount.recordings.run.session import recorded_sessions, session_differences
from mount_ros.topics import DIAGNOSTICS, DISPLACEMENT, EVENT, SESSION, Topic

_TOLD_OTHERWISE = (SESSION, EVENT)  # in words of their own
_OF_THE_MOMENT = (DIAGNOSTICS,)  # clock time, load: never equal


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

    def sentences(self) -> list[str]:
        """Return what differs, most important first; the last sentence says what is equal."""
        return [
            *self.difference_sentences(),
            *self._reasons(),
            *self._sample_sentences(),
            *(f'{topic.name}: {topic.remark}' for topic in self.topics if topic.remark),
            *(
                f'{what} only in {where}: {few(names, ", ")}'
                for what, where, names in (
                    ('topics', 'A', self.only_a),
                    ('topics', 'B', self.only_b),
                    ('marks', 'A', self.marks_a),
                    ('marks', 'B', self.marks_b),
                )
                if names
            ),
            self._rest(),
        ]

    def difference_sentences(self) -> list[str]:
        """Return the sentences about switching and signals that differ beyond the tolerances."""
        changes = self.switching_changes
        more = [f'{len(changes) - SHOWN} more switchings differ'] if len(changes) > SHOWN else []
        return [*map(switching_sentence, changes[:SHOWN]), *more, *signal_sentences(self.differing)]

    def figures(self) -> dict[str, Any]:
        """Return everything as JSON knows it: unknown is null, times in s on the time axis of A."""
        alignment = self.alignment
        return {
            'a': self.name_a,
            'b': self.name_b,
            'equal': self.equal,
            'sentences': self.sentences(),
            'alignment': {
                'same_stamps': alignment.same_stamps,
                'shift_s': alignment.shift / 1e9,
                'sentence': self.alignments.sentence,
            },
            'session': list(self.sessions),
            'only_in_a': list(self.only_a),
            'only_in_b': list(self.only_b),
            'marks_only_in_a': list(self.marks_a),
            'marks_only_in_b': list(self.marks_b),
            'switching': None if self.switching is None else list(map(_switching_figures, self.switching)),
            'topics': {topic.name: topic.figures() for topic in self.topics},
        }

    def _reasons(self) -> list[str]:
        if self.sessions:
            return [f'the sessions differ: {few(self.sessions, "; ")}']
        if self.equal or not self.both_have_session:
            return []
        differing = {signal.topic for signal in self.differing}
        inputs = next((topic for topic in self.topics if topic.topic == DISPLACEMENT.name), None)
        if inputs is None or not inputs.samples or not differing:
            return []
        if DISPLACEMENT.name in differing:
            return ['the sessions are equal, but the displacements differ, so all else may']
        return [
            'displacement and session are equal: the programs differ, or one of them began in another state'
        ]

    def _sample_sentences(self) -> list[str]:
        kinds = {'samples missing in B': 'only_a', 'samples missing in A': 'only_b'}
        if not self.common_only:
            kinds |= {'samples of A before or behind those of B': 'outside_a'}
            kinds |= {'samples of B before or behind those of A': 'outside_b'}
        sentences = []
        for what, field in {**kinds, 'messages that differ': 'differing_messages'}.items():
            counts = [(getattr(topic, field), topic.name) for topic in self.incomplete]
            told = [f'{count} of {name}' for count, name in counts if count]
            sentences += [f'{what}: {few(told, ", ")}'] if told else []
        return sentences

    def _rest(self) -> str:
        alike = [signal for signal in self.signals if signal.samples and not signal.differing]
        exact = all(signal.exact for signal in alike)
        how = 'equal to the bit' if exact else 'equal within the tolerances'
        switching = '' if self.switching is None or self.switching_changes else ' and the switching'
        if not self.differing and not self.switching_changes:
            where = 'everything that both have' if self.incomplete else 'everything'
            topics = len({(signal.mount, signal.topic) for signal in alike})
            return f'{where} is {how} ({len(alike)} signals of {topics} topics)'
        if not alike:
            return 'no signal is equal'
        return f'everything else is {how} ({len(alike)} of {len(self.signals)} signals{switching})'


def switching_sentence(change: SwitchingChange, a: str = 'A', b: str = 'B') -> str:
    """Return the sentence about a switching; `a` and `b` is what the recordings are called."""
    word = 'on' if change.on else 'off'
    mount = change.mount.replace('/', ': ')
    if change.time_b is None:
        return f'{mount}damping is not switched {word} in {b}, in {a} it is at {time_text(change.time)}'
    if change.time_a is None:
        return f'{mount}damping is switched {word} at {time_text(change.time_b)} in {b}, in {a} it is not'
    direction = 'later' if change.moved > 0.0 else 'earlier'
    by = quantity_text(abs(change.moved), 's')
    return f'{mount}switched {word} {by} {direction} in {b}, at {time_text(change.time_b)}'


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
    switching = [change for topic in matched if topic.tells_switching for change in _switching(topic)]
    told = any(topic.tells_switching for topic in matched)
    marks_a, marks_b = _marks(a, {}), _marks(b, {other: name for name, other in pairs.items()})
    sessions = _sessions(a, b, pairs)
    return Comparison(
        name_a=a.short_name,
        name_b=b.short_name,
        alignments=alignments,
        topics=tuple(topic.compared(tolerances) for topic in matched),
        only_a=_unpaired_topics(a, pairs, topics),
        only_b=_unpaired_topics(b, pairs.values(), topics),
        sessions=tuple(sessions or ()),
        both_have_session=sessions is not None,
        marks_a=tuple((marks_a - marks_b).elements()),
        marks_b=tuple((marks_b - marks_a).elements()),
        switching=tuple(sorted(switching, key=lambda change: change.time)) if told else None,
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


def _switching(topic: MatchedTopic) -> list[SwitchingChange]:
    column = topic.column(SWITCH)
    times = (switching_times(column.time, active) for active in (column.a, column.b))
    return paired_switchings(*times, topic.period, topic.mount)


def _switching_figures(change: SwitchingChange) -> dict[str, Any]:
    return {
        'mount': change.mount.rstrip('/'),
        'kind': 'on' if change.on else 'off',
        'time_a_s': change.time_a,
        'time_b_s': change.time_b,
        'moved_ms': None if change.alone else round(1e3 * change.moved, 6),
    }


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
