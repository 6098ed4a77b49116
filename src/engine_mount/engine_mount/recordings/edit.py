"""Cut pieces and sound remainders of recordings, as recordings of their own."""

import math
import os
from collections.abc import Callable
from pathlib import Path
from typing import NamedTuple

import numpy as np

from engine_mount.recordings.bag_copy import BagCopy, read_messages
from engine_mount.recordings.metadata import (
    ZERO_KEY,
    TopicInformation,
    custom_data,
    registered_topic,
    with_step,
)
from engine_mount.recordings.recording import Recording, open_recording
from mount_recorder.session import time_text
from mount_ros.topics import EVENT, Delivery


class CutError(ValueError):
    """A recording has nothing in the asked range, or the range is none; the text says what there is."""


class Cut(NamedTuple):
    """What was cut; `begin` and `end` in s on the time axis of the original."""

    folder: Path
    begin: float
    end: float
    messages: int  # of the range
    carried: int  # latched ones from before it
    losses: tuple[str, ...]  # what of the original could not be read, in sentences


def cut(
    recording: Recording,
    out: str | os.PathLike[str],
    begin: float | None = None,
    end: float | None = None,
    reason: str = '',
    made: str = '',
) -> Cut:
    """Write what was logged from `begin` on and before `end` to the new recording `out`.

    Times are in s on the time axis of `recording`, which the piece keeps; None is its beginning, or its end
    with the last message. Messages keep their bytes, log and publish times. Of latched topics and of `event`
    the last message before `begin` comes with it, and so does metadata. What the recorder lost
    is told of the piece too: when that was is not known. `reason` and `made`, the time of the cut
    (by default now), go into the note of origin. Raises `CutError`.
    """
    first, behind = _span(recording, begin, end)
    axis = recording.time_axis
    whole = axis.of_log((recording.time_range or (0, 0))[1])
    begin = axis.of_log(first) if begin is None else begin
    end = whole if end is None else min(end, whole)
    known = list(recording.warnings)
    parts, carried, read = [], 0, {}
    for name, topic in recording.topics.items():
        messages = read_messages(recording, name)
        if messages is None:
            continue
        read[name] = len(messages)
        edges = np.searchsorted(messages.heads['log_time'], [first, behind]).tolist()
        before = range(edges[0])[_carried(topic)]
        parts.append(messages.at(np.array([*before, *range(*edges)], np.int64)))
        carried += len(before)
    count = sum(map(len, parts)) - carried
    if not count:
        raise CutError(
            f'{recording.path} has no message from {begin:.3f} s to {end:.3f} s; it ends at {whole:.3f} s'
        )
    step = {
        'did': 'cut',
        'recording': recording.short_name,
        'from_s': begin,
        'to_s': end,
        ZERO_KEY: axis.zero,
        'made': made or time_text(),
        **({'reason': reason} if reason else {}),
    }
    losses = [warning for warning in recording.warnings if warning not in known]
    with BagCopy(out) as bag:
        bag.add(parts)
        bag.complete(recording, with_step(recording.information, step), read)
    return Cut(Path(out), begin, end, count, carried, tuple(losses))


def _span(recording: Recording, begin: float | None, end: float | None) -> tuple[int, int]:
    """Return the log times (ns) from which and before which messages are cut."""
    axis, logged = recording.time_axis, recording.time_range
    if logged is None:
        raise CutError(f'{recording.path} has no message; there is nothing to cut')
    if not all(value is None or math.isfinite(value) for value in (begin, end)):
        raise CutError(f'the ends of a cut must be numbers of seconds; instead received {begin}, {end}')
    first = logged[0] if begin is None else max(logged[0], axis.log_time(begin))
    behind = logged[1] + 1 if end is None else min(axis.log_time(end), logged[1] + 1)
    if behind <= first or first > logged[1]:
        raise CutError(
            f'the cut would end at {axis.of_log(behind):.3f} s and begin at {axis.of_log(first):.3f} s; '
            f'{recording.path} ends at {axis.of_log(logged[1]):.3f} s'
        )
    return first, behind


def _carried(topic: TopicInformation) -> slice:
    """Return which of the messages before a cut come with it."""
    registered = registered_topic(topic.name, topic.type)
    if registered is not None and (registered is EVENT or registered.delivery is Delivery.LATCHED):
        return slice(-1, None)
    if any(offer['durability'] == 'transient_local' for offer in topic.offered_qos):
        # Foreign ones may have several publishers that each say their part, as /tf_static does.
        return slice(None)
    return slice(0)


Progress = Callable[[int, int], None]  # messages done, messages in all


class RecoveryError(ValueError):
    """Nothing of a recording can be recovered; the text says why."""


class Recovery(NamedTuple):
    """What was kept and what is lost; `lost` is None where no summary or description counts the messages."""

    folder: Path
    kept: int
    lost: int | None
    kept_seconds: float  # from the first to the last message
    complete: bool  # nothing of the file is lost
    notes: tuple[str, ...]

    def __str__(self) -> str:
        kept = f'kept {self.kept} messages, {self.kept_seconds:.3f} s'
        if self.complete:
            return f'{kept}; nothing of the file is missing'
        if self.lost is None:
            return f'{kept}; lost what followed the last whole chunk: how much, the file cannot tell'
        return f'{kept}; lost {self.lost} messages'


def recover(
    path: str | os.PathLike[str], out: str | os.PathLike[str], progress: Progress | None = None
) -> Recovery:
    """Write what is readable of the recording `path` to the new folder `out`.

    Raises `ReadingError` where nothing can be opened, `RecoveryError` where no message is left.
    """
    recording = open_recording(path)
    with BagCopy(out) as bag:
        channels = {
            (file, number): bag.channel_of(topic)
            for file in recording.files
            for number, topic in file.topics.items()
        }
        for file in recording.files:
            for _, block in file.blocks([list(file.topics)]):
                heads = block.heads[['topic', 'log_time', 'publish_time', 'sequence']].tolist()
                for (number, *head), raw in zip(heads, map(bytes, block.payloads()), strict=True):
                    bag.write(channels[file, number], raw, *head)
                if progress is not None:
                    progress(bag.added, recording.message_count)
        if not bag.added:
            reasons = '; '.join(recording.warnings) or 'it is empty'
            raise RecoveryError(f'{path} holds no message that can be recovered: {reasons}')
        origin = {'recovered_from': f'{recording.path.name}: {bag.added} messages'}
        bag.complete(recording, {**custom_data(recording.information), **origin})
    expected = recording.described_count
    if recording.proven:
        expected = sum(file.message_counts.total() for file in recording.files)
    complete = recording.whole and (expected is None or expected <= bag.added)
    return Recovery(
        folder=bag.folder,
        kept=bag.added,
        lost=0 if complete else None if expected is None else max(0, expected - bag.added),
        kept_seconds=bag.seconds,
        complete=complete,
        notes=tuple(recording.warnings),
    )
