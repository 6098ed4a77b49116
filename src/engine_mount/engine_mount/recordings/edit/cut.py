"""A piece of a recording as a recording of its own, with what it needs to be understood."""

import math
import os
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from engine_mount.recordings.edit.inherited_statement import sources_of
from engine_mount.recordings.edit.messages import Messages, read_messages, write_messages
from engine_mount.recordings.metadata import ZERO_KEY, TopicInformation, with_step
from engine_mount.recordings.recording import Recording
from engine_mount.recordings.time_axis import TimeAxis
from mount_recorder.session import time_text
from mount_recorder.topic_groups import registered_topic
from mount_ros.topics import EVENT, Delivery

_ALL = slice(None)
_LAST = slice(-1, None)
_NONE = slice(0)


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
    the last message before `begin` comes with it, and so do attachments and metadata. What the recorder lost
    is told of the piece too: when that was is not known. `reason` and `made`, the time of the cut
    (by default now), go into the note of origin. Raises `CutError`.
    """
    span = _checked_span(recording, recording.time_axis, begin, end)
    parts, losses, carried, read = [], [], 0, {}
    for name in recording:
        messages, damages = read_messages(recording, name)
        read[name] = len(messages)
        before, inside = _places(messages, span)
        parts.append(messages.chosen(np.concatenate([before, inside])))
        carried += len(before)
        losses += damages
    count = sum(len(part) for part in parts) - carried
    if not count:
        raise CutError(f'{recording.path} has no message {span}; it ends at {span.whole:.3f} s')
    distro = recording.information.ros_distro if recording.information else ''
    custom = with_step([recording.information], _step(recording, span, reason, made or time_text()))
    write_messages(out, parts, [recording], sources_of(recording, read), custom, distro)
    losses += [f'{name} is lost by damage' for name in recording.lost_beside]
    return Cut(Path(out), span.begin, span.end, count, carried, tuple(losses))


@dataclass(frozen=True)
class _Span:
    """From the log time `first` on and before `last` (ns); `closed`: with the last message.

    `begin` and `end`, and `whole` at which the recording ends, are the same in s on its time axis.
    """

    first: int
    last: int
    closed: bool
    begin: float
    end: float
    whole: float
    zero: int  # stamp, ns

    def __str__(self) -> str:
        return f'from {self.begin:.3f} s to {self.end:.3f} s'


def _checked_span(recording: Recording, axis: TimeAxis, begin: float | None, end: float | None) -> _Span:
    found = recording.time_range
    if found is None:
        raise CutError(f'{recording.path} has no message; there is nothing to cut')
    for name, value in (('begin', begin), ('end', end)):
        if value is not None and not math.isfinite(value):
            raise CutError(f'the {name} of a cut must be a number of seconds; instead received {value}')
    whole = axis.of_log(found[1])
    first = found[0] if begin is None else max(found[0], axis.log_time(begin))
    last = found[1] if end is None else axis.log_time(end)
    if first > found[1]:
        raise CutError(f'the cut begins at {begin:g} s, but {recording.path} ends at {whole:.3f} s')
    if end is not None and last <= first:
        from_where = axis.of_log(first) if begin is None else begin
        raise CutError(f'the end of a cut ({end:g} s) must lie behind its begin ({from_where:g} s)')
    closed = end is None or last > found[1]
    return _Span(
        first,
        min(last, found[1]),
        closed,
        axis.of_log(first) if begin is None else begin,
        whole if closed or end is None else end,
        whole,
        axis.zero,
    )


def _places(messages: Messages, span: _Span) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Return where the carried messages from before the span stand, and those of the span."""
    first = int(np.searchsorted(messages.log_times, span.first, side='left'))
    behind = int(np.searchsorted(messages.log_times, span.last, side='right' if span.closed else 'left'))
    return np.arange(first)[_carried(messages.topic)], np.arange(first, behind)


def _carried(topic: TopicInformation) -> slice:
    """Return which of the messages before a cut come with it."""
    registered = registered_topic(topic.name, topic.type)
    if registered is not None and (registered is EVENT or registered.delivery is Delivery.LATCHED):
        return _LAST
    if any(offer.durability == 'transient_local' for offer in topic.offered_qos):
        # Foreign ones may have several publishers that each say their part, as /tf_static does.
        return _ALL
    return _NONE


def _step(recording: Recording, span: _Span, reason: str, made: str) -> dict[str, Any]:
    return {
        'did': 'cut',
        'recording': recording.short_name,
        'from_s': span.begin,
        'to_s': span.end,
        ZERO_KEY: span.zero,
        'made': made,
        **({'reason': reason} if reason else {}),
    }
