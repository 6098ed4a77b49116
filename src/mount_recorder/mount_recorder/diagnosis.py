"""The recorder's verdict on itself, from its figures alone: all of them, and what came lately."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field, replace
from enum import Enum
from typing import NamedTuple

from mount_recorder.recorder import RecorderFigures, Unobserved
from mount_recorder.snapshot import SnapshotFigures
from mount_recorder.stamp_watch import FARTHEST, StampWatch
from mount_ros.nodes.diagnostics import WINDOW, Finding, Level, Verdict, verdict_on

LEAST_FREE = 1 << 30  # bytes, chosen
LEAST_TIME = 60.0  # s, chosen: how long the disk must last at the present rate


class OnFull(Enum):
    """What a disk without space means for the run."""

    STOP = 'stop'  # an error: the run shall end
    CONTINUE = 'continue'  # a warning: the run goes on without recording


class Counted(NamedTuple):
    """What had been counted at one time, of which a verdict takes what came lately; counts by topic."""

    received: int = 0
    lost: int = 0
    missing: Mapping[str, int] = {}
    misdated: Mapping[str, int] = {}
    unobserved: Mapping[str, int] = {}


_NOTHING = Counted()


@dataclass(frozen=True)
class RecorderState:
    """All that the verdict looks at; sizes in bytes, rate in bytes/s."""

    folder: str
    figures: RecorderFigures
    publishers: Mapping[str, int] = field(default_factory=dict)
    watches: Mapping[str, StampWatch] = field(default_factory=dict)
    free: int = LEAST_FREE
    rate: float = 0.0
    overflowed: Mapping[str, int] = field(default_factory=dict)
    unobserved: Mapping[str, Unobserved] = field(default_factory=dict)
    marks: int = 0  # set by the recorder itself
    events: int = 0  # all that came on `event`
    snapshot: SnapshotFigures | None = None

    @property
    def counted(self) -> Counted:
        """What has been counted by now."""
        return Counted(
            self.figures.received,
            self.figures.lost,
            {topic: watch.lost for topic, watch in self.watches.items()},
            {topic: watch.misdated for topic, watch in self.watches.items()},
            {topic: entry.count for topic, entry in self.unobserved.items()},
        )


def judge(state: RecorderState, on_full: OnFull, earlier: Counted = _NOTHING) -> Verdict:
    """Return level, sentence and figures of an active recorder.

    `earlier` is what had been counted a window ago, or when it began.
    """
    failed = bool(state.figures.failure)
    fatal = failed and on_full is OnFull.STOP
    found = sum(count > 0 for count in state.publishers.values())
    well = f'{_activity(state.snapshot)}; {found} of {len(state.publishers)} topics have a publisher'
    values = {**_figures(state), 'failed': failed, 'fatal': fatal}
    return verdict_on(_findings(state, on_full, earlier), well, values)


def _findings(state: RecorderState, on_full: OnFull, earlier: Counted) -> list[Finding]:
    failure = state.figures.failure
    if failure and on_full is OnFull.STOP:
        return [Finding(Level.ERROR, failure, f'{failure}; free some space and start again')]
    if failure:
        return [Finding(Level.WARN, failure, f'the run goes on without recording: {failure}')]
    return [
        Finding(Level.WARN, name, sentence)
        for name, sentence in (*_of_messages(state, earlier), *_of_space(state))
    ]


def _of_messages(state: RecorderState, earlier: Counted) -> Iterator[tuple[str, str]]:
    """Yield name and sentence of what was wrong lately with messages and their stamps."""
    now, none = state.counted, f'limit: none in {WINDOW:g} s'
    if now.lost > earlier.lost:
        yield (
            'lost',
            f'{now.lost - earlier.lost} of {now.received - earlier.received} messages lost ({none}): '
            'the disk is slower than the data; record fewer topics or use a faster disk',
        )
    if unobserved := _lately(now.unobserved, earlier.unobserved):
        entries = {name: replace(state.unobserved[name], count=count) for name, count in unobserved.items()}
        sentence = f'{unobserved_sentence(entries)} ({none}); who else publishes there?'
        yield f'unobserved {", ".join(unobserved)}', sentence
    if missing := _lately(now.missing, earlier.missing):
        sentence = (
            f'samples missing between the stamps: {_counts(missing)} ({none}); is the machine overloaded?'
        )
        yield f'missing {", ".join(missing)}', sentence
    if misdated := _lately(now.misdated, earlier.misdated):
        limit = f'more than {FARTHEST / 1e9:g} s from the samples around them'
        sentence = f'stamps {limit}: {_counts(misdated)} ({none}); who else publishes there?'
        yield f'misdated {", ".join(misdated)}', sentence


def _of_space(state: RecorderState) -> Iterator[tuple[str, str]]:
    """Yield name and sentence of what disk and memory lack."""
    if _is_short_of_space(state):
        yield (
            'space',
            f'{state.free / 1e9:.1f} GB left on the disk of {state.folder} at {state.rate / 1e6:.1f} MB/s '
            f'(limit: {LEAST_FREE / 1e9:.1f} GB, and enough for {LEAST_TIME:g} s); free some space',
        )
    if state.snapshot is not None and state.snapshot.short_of_memory:
        yield (
            'memory',
            'the memory does not hold the wished time before an event; '
            'raise snapshot_memory or record fewer topics',
        )


def _lately(now: Mapping[str, int], earlier: Mapping[str, int]) -> dict[str, int]:
    """Return how much each count has grown, where it has."""
    grown = {topic: count - earlier.get(topic, 0) for topic, count in now.items()}
    return {topic: count for topic, count in grown.items() if count > 0}


def _counts(counts: Mapping[str, int]) -> str:
    return ', '.join(f'{topic} {count}' for topic, count in counts.items())


def unobserved_sentence(unobserved: Mapping[str, Unobserved]) -> str:
    """Return what the recorder could write but not read, by topic."""
    counts = ', '.join(
        f'{topic} {entry.count} (the last of {entry.size} bytes; {entry.why})'
        for topic, entry in unobserved.items()
    )
    return f'malformed messages, recorded but neither watched nor marked: {counts}'


def _activity(snapshot: SnapshotFigures | None) -> str:
    return 'recording' if snapshot is None or snapshot.running else 'waiting for an event'


def _is_short_of_space(state: RecorderState) -> bool:
    return state.free < LEAST_FREE or state.free < state.rate * LEAST_TIME


def _figures(state: RecorderState) -> dict[str, object]:
    figures = state.figures
    return {
        'folder': state.folder,
        'received': figures.received,
        'kept': figures.kept,
        'file_bytes': figures.file_size,
        'queued': figures.queued,
        'queued_bytes': figures.queued_bytes,
        'lost': figures.lost,
        'free_bytes': state.free,
        'bytes_per_second': round(state.rate),
        'last_stamp': max((watch.last_stamp for watch in state.watches.values()), default=0),
        'marks': state.marks,
        'events': state.events,
        **_snapshot_figures(state.snapshot),
        **{f'lost.{topic}': count for topic, count in state.overflowed.items()},
        **{f'publishers.{topic}': count for topic, count in state.publishers.items()},
        **{f'malformed.{topic}': entry.count for topic, entry in state.unobserved.items()},
        **{f'missing.{topic}': watch.lost for topic, watch in state.watches.items()},
    }


def _snapshot_figures(snapshot: SnapshotFigures | None) -> dict[str, object]:
    if snapshot is None:
        return {}
    return {
        'snapshots': snapshot.recordings,
        'held_s': round(snapshot.held, 3),
        'held_bytes': snapshot.held_bytes,
    }
