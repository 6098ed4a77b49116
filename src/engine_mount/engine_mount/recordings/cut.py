"""A piece of a recording as a recording of its own, with what it needs to be understood."""

import math
import os
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from engine_mount.recordings.bag_copy import BagCopy, read_messages
from engine_mount.recordings.metadata import ZERO_KEY, TopicInformation, registered_topic, with_step
from engine_mount.recordings.recording import Recording
from mount_recorder.session import time_text
from mount_ros.topics import EVENT, Delivery


class CutError(ValueError):
    """A recording has nothing in the asked range, or the range is none; the text says what there is."""


@dataclass(frozen=True)
class Cut:
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
