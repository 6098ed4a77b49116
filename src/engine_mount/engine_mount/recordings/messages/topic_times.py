"""The times of all messages of a recording, in one pass and without keeping the messages."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from engine_mount.recordings.container.stored import HEAD, StoredMessages
from engine_mount.recordings.messages.compact_times import CompactTimes, Times
from engine_mount.recordings.messages.definitions import Definition
from engine_mount.recordings.messages.series import Payloads, Series, heads_of

_HEADER = 'std_msgs/Header'
_STAMP_AT, _STAMP_END = 4, 12  # bytes in the message: behind the kind of encoding


@dataclass(frozen=True)
class TopicTimes:
    """Times in ns in the order of the recording; `stamps` are None for the reason that `obstacle` tells.

    `receive_times` and `publish_times` are None where nobody needs them.
    """

    topic: str
    type: str
    count: int
    stamps: CompactTimes | None
    receive_times: CompactTimes | None
    publish_times: CompactTimes | None
    names: tuple[str, ...] = ()  # of the scalars in the first message of a JointState
    obstacle: str = ''

    def __len__(self) -> int:
        return self.count


class TimesCollector:
    """Collects the times of one topic, block by block."""

    def __init__(
        self,
        topic: str,
        type_name: str,
        definition: Definition | None,
        obstacle: str,
        *,
        received: bool,
        sent: bool,
    ):
        """Take the topic and the sentence why there is no definition; keep the times that are asked for."""
        self._topic, self._type, self._definition = topic, type_name, definition
        self._obstacle = obstacle
        if definition is not None and not _begins_with_header(definition):
            self._obstacle = f'{type_name} has no header with a stamp'
        self._count = 0
        self._stamps = CompactTimes()
        self._received = CompactTimes() if received else None
        self._sent = CompactTimes() if sent else None
        self._first: bytes | None = None

    def __len__(self) -> int:
        return self._count

    def add(self, block: StoredMessages) -> None:
        """Take the times of the messages in `block`."""
        if self._first is None:
            self._first = block.message(0)[0]
        self._count += len(block)
        for times, kept in (('log_time', self._received), ('publish_time', self._sent)):
            if kept is not None:
                kept.add(block.heads[times].copy())
        if not self._obstacle:
            stamps = _stamps_in(block)
            if stamps is None:
                self._obstacle = 'not every message begins with a stamp'
            else:
                self._stamps.add(stamps)

    def times(self) -> TopicTimes:
        """Return what was collected."""
        kept = (None if self._obstacle else self._stamps, self._received, self._sent)
        stamps, received, sent = (None if times is None else times.finished() for times in kept)
        return TopicTimes(
            self._topic, self._type, self._count, stamps, received, sent, self._names(), self._obstacle
        )

    def _names(self) -> tuple[str, ...]:
        if self._first is None or self._obstacle:
            return ()
        row = np.frombuffer(self._first, np.uint8)[None]
        heads = heads_of(np.zeros(1, HEAD))
        first = Series(self._topic, self._type, Payloads([row]), heads, definition=self._definition)
        try:
            return first.names
        except ValueError:
            return ()


def _begins_with_header(definition: Definition) -> bool:
    fields, header = definition.fields, definition.types.get(_HEADER, {})
    return next(iter(fields.values())) == _HEADER and next(iter(header.values()), '') == (
        'builtin_interfaces/Time'
    )


def _stamps_in(block: StoredMessages) -> Times | None:
    rows = block.beginnings(_STAMP_END)
    if rows is None or rows[:, 0].any() or (rows[:, 1] > 1).any():
        return None
    numbers = np.ascontiguousarray(rows[:, _STAMP_AT:])
    little, big = _read(numbers, '<'), rows[:, 1] == 0
    if big.any():
        little[big] = _read(numbers[big], '>')
    return little


def _read(stamps: NDArray[np.uint8], order: str) -> Times:
    """Return stamps (n, 8 bytes) in ns."""
    seconds = stamps.view(f'{order}i4')[:, 0].astype(np.int64)
    return seconds * 1_000_000_000 + stamps.view(f'{order}u4')[:, 1]
