"""Two recordings against each other: every signal of every topic that both have, sample by sample."""

from collections.abc import Collection, Mapping
from typing import Any, NamedTuple

from engine_mount.recordings.difference import SHOWN, SignalDifference, Tolerances, few, signal_sentences
from engine_mount.recordings.events import (
    SwitchingChange,
    paired_switchings,
    switching_times,
)
from engine_mount.recordings.matching import (
    SWITCH,
    Alignment,
    ComparisonError,
    MatchedTopic,
    TopicComparison,
    align,
    alignment_sentence,
    mount_of,
    registered_in,
)
from engine_mount.recordings.recording import Recording
from engine_mount.recordings.session import recorded_sessions, session_differences
from mount_ros.topics import DIAGNOSTICS, EVENT, SESSION, Topic

# Sessions have words of their own; diagnostics hold clock time and load, which are never equal.
_NOT_BY_SAMPLES = (SESSION, EVENT, DIAGNOSTICS)
_LACKING = {
    'samples missing in B': 'missing_in_b',
    'samples missing in A': 'missing_in_a',
    'samples of A before or behind those of B': 'outside_in_a',
    'samples of B before or behind those of A': 'outside_in_b',
    'messages that differ': 'differing_messages',
}


class Comparison(NamedTuple):
    """What two recordings have in common and what not; times in s on the time axis of A."""

    name_a: str
    name_b: str
    alignments: Mapping[str, Alignment]  # by mount
    topics: tuple[TopicComparison, ...]
    only_a: tuple[str, ...]  # topics
    only_b: tuple[str, ...]
    sessions: tuple[str, ...]  # differences in words
    switching: tuple[SwitchingChange, ...] | None  # None: not told by both
    switching_tolerance: float
    common_only: bool

    @property
    def alignment(self) -> Alignment:
        """That of the only mount, or of the first."""
        return next(iter(self.alignments.values()))

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
    def incomplete(self) -> dict[str, list[tuple[str, int]]]:
        """Topics of which one recording lacks samples, or whose messages differ: [(topic, count)] by what."""
        counts = {
            what: [(topic.name, count) for topic in self.topics if (count := getattr(topic, field))]
            for what, field in _LACKING.items()
            if not (self.common_only and field.startswith('outside'))
        }
        return {what: found for what, found in counts.items() if found}

    @property
    def equal(self) -> bool:
        """Whether nothing differs beyond the tolerances; topics of one recording alone do not count."""
        return not (self.incomplete or self.switching_changes or self.differing)

    def sentences(self) -> list[str]:
        """Return what differs, most important first; the last sentence says what is equal."""
        alone = {
            'topics only in A': self.only_a,
            'topics only in B': self.only_b,
        }
        return [
            *self.difference_sentences(),
            *([f'the sessions differ: {few(self.sessions, "; ")}'] if self.sessions else []),
            *(
                f'{what}: {few([f"{count} of {name}" for name, count in found])}'
                for what, found in self.incomplete.items()
            ),
            *(f'{topic.name}: {topic.remark}' for topic in self.topics if topic.remark),
            *(f'{what}: {few(names)}' for what, names in alone.items() if names),
            self._rest(),
        ]

    def difference_sentences(self) -> list[str]:
        """Return the sentences about switching and signals that differ beyond the tolerances."""
        changes = self.switching_changes
        more = [f'{len(changes) - SHOWN} more switchings differ'] if len(changes) > SHOWN else []
        shown = [change.sentence() for change in changes[:SHOWN]]
        return [*shown, *more, *signal_sentences(self.differing)]

    def figures(self) -> dict[str, Any]:
        """Return everything as JSON knows it: unknown is null, times in s on the time axis of A."""
        return {
            'a': self.name_a,
            'b': self.name_b,
            'equal': self.equal,
            'sentences': self.sentences(),
            'alignment': {
                'same_stamps': self.alignment.same_stamps,
                'shift_s': self.alignment.shift / 1e9,
                'sentence': alignment_sentence(self.alignments),
            },
            'session': list(self.sessions),
            'only_in_a': list(self.only_a),
            'only_in_b': list(self.only_b),
            'switching': None if self.switching is None else [change.figures() for change in self.switching],
            'topics': {topic.name: topic.figures() for topic in self.topics},
        }

    def _rest(self) -> str:
        alike = [signal for signal in self.signals if signal.samples and not signal.differing]
        exact = all(signal.exact for signal in alike)
        how = 'equal to the bit' if exact else 'equal within the tolerances'
        if not self.differing and not self.switching_changes:
            where = 'everything that both have' if self.incomplete else 'everything'
            topics = len({(signal.mount, signal.topic) for signal in alike})
            return f'{where} is {how} ({len(alike)} signals of {topics} topics)'
        if not alike:
            return 'no signal is equal'
        switching = '' if self.switching is None or self.switching_changes else ' and the switching'
        return f'everything else is {how} ({len(alike)} of {len(self.signals)} signals{switching})'


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
    the only ones to compare. What belongs to no mount is aligned as the first one.
    """
    tolerances = tolerances or Tolerances()
    alignments = align(a, b)
    first = next(iter(alignments.values()))
    wanted, other = _wanted_topics(a, topics), _wanted_topics(b, topics)
    matched = [
        MatchedTopic(a[name], b[name], alignments.get(mount_of(name, registered_in(a, name)), first))
        for name in wanted
        if name in other and registered_in(a, name) not in _NOT_BY_SAMPLES
    ]
    tolerances.check({(topic.topic, signal) for topic in matched for signal in topic.signals})
    if not any(topic.samples for topic in matched):
        raise ComparisonError(f'no sample is in both {a.path} and {b.path}; {alignment_sentence(alignments)}')
    switched = [topic for topic in matched if topic.tells_switching]
    changes = [change for topic in switched for change in _switching(topic)]
    return Comparison(
        name_a=a.short_name,
        name_b=b.short_name,
        alignments=alignments,
        topics=tuple(topic.compared(tolerances) for topic in matched),
        only_a=tuple(name for name in wanted if name not in other and a.topics[name].message_count),
        only_b=tuple(name for name in other if name not in wanted and b.topics[name].message_count),
        sessions=tuple(_sessions(a, b)),
        switching=tuple(sorted(changes, key=lambda change: change.time)) if switched else None,
        switching_tolerance=tolerances.switching,
        common_only=common_only,
    )


def _wanted_topics(recording: Recording, topics: Collection[Topic] | None) -> list[str]:
    return [name for name in recording if topics is None or registered_in(recording, name) in topics]


def _switching(topic: MatchedTopic) -> list[SwitchingChange]:
    column = topic.column(SWITCH)
    times = [switching_times(column.time, active) for active in (column.a, column.b)]
    return paired_switchings(times[0], times[1], topic.period, topic.mount)


def _sessions(a: Recording, b: Recording) -> list[str]:
    """Return how the sessions differ, mount by mount."""
    others = recorded_sessions(b)
    return [
        mount_of(name, SESSION).replace('/', ': ') + difference
        for name, text in recorded_sessions(a).items()
        if text and others.get(name)
        for difference in session_differences(text, others[name])
    ]
