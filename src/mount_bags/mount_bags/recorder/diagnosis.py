"""The recorder's verdict on itself, from its figures alone."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from enum import Enum

from mount_bags.messages.stamps import FARTHEST, StampWatch
from mount_bags.recorder.recorder import RecorderFigures, Unobserved
from mount_bags.recorder.snapshot import SnapshotFigures
from mount_ros.nodes.diagnostics import Level, Verdict

LEAST_FREE = 1 << 30  # bytes, chosen
LEAST_TIME = 60.0  # s, chosen: how long the disk must last at the present rate


class OnFull(Enum):
    """What a disk without space means for the run."""

    STOP = 'stop'  # an error: the run shall end
    CONTINUE = 'continue'  # a warning: the run goes on without recording


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


def judge(state: RecorderState, on_full: OnFull) -> Verdict:
    """Return level, sentence and figures of an active recorder."""
    level, sentence = _verdict(state, on_full)
    failed = bool(state.figures.failure)
    fatal = failed and on_full is OnFull.STOP
    return Verdict(level, sentence, {**_figures(state), 'failed': failed, 'fatal': fatal})


def _verdict(state: RecorderState, on_full: OnFull) -> tuple[Level, str]:
    figures = state.figures
    if figures.failure and on_full is OnFull.STOP:
        return Level.ERROR, f'{figures.failure}; free some space and start again'
    if figures.failure:
        return Level.WARN, f'the run goes on without recording: {figures.failure}'
    if warnings := list(_warnings(state)):
        return Level.WARN, '. '.join(warnings)
    found = sum(count > 0 for count in state.publishers.values())
    return (
        Level.OK,
        f'{_activity(state.snapshot)}; {found} of {len(state.publishers)} topics have a publisher',
    )


def _warnings(state: RecorderState) -> Iterator[str]:
    """Yield a sentence for each thing that is not as it should be; none hides another."""
    figures = state.figures
    if figures.lost:
        yield (
            f'{figures.lost} of {figures.received} messages lost: the disk is slower than the data; '
            'record fewer topics or use a faster disk'
        )
    if state.unobserved:
        yield f'{unobserved_sentence(state.unobserved)}; who else publishes there?'
    missing = {topic: watch.lost for topic, watch in state.watches.items() if watch.lost}
    if missing:
        counts = ', '.join(f'{topic} {count}' for topic, count in missing.items())
        yield f'samples missing between the stamps: {counts}; is the machine overloaded?'
    misdated = {topic: watch.misdated for topic, watch in state.watches.items() if watch.misdated}
    if misdated:
        counts = ', '.join(f'{topic} {count}' for topic, count in misdated.items())
        limit = f'more than {FARTHEST / 1e9:g} s from the samples around them'
        yield f'stamps {limit}: {counts}; who else publishes there?'
    if _is_short_of_space(state):
        yield (
            f'{state.free / 1e9:.1f} GB left on the disk of {state.folder} at {state.rate / 1e6:.1f} MB/s; '
            'free some space'
        )
    if state.snapshot is not None and state.snapshot.short_of_memory:
        yield (
            'the memory does not hold the wished time before an event; '
            'raise snapshot_memory or record fewer topics'
        )


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
