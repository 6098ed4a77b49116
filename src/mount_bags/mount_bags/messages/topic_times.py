"""The times of all messages of a recording, in one pass and without keeping the messages."""

from dataclasses import dataclass

import numpy as np

from mount_bags.container.stored import StoredMessages
from mount_bags.messages.definitions import Definition
from mount_bags.messages.series import Payloads, Series, Times

_HEADER = 'std_msgs/Header'
_STAMP_AT, _STAMP_END = 4, 12  # bytes in the message: behind the kind of encoding


@dataclass(frozen=True)
class TopicTimes:
    """Times in ns in the order of the recording; `stamps` are None for the reason that `obstacle` tells."""

    topic: str
    type: str
    stamps: Times | None
    receive_times: Times
    publish_times: Times
    names: tuple[str, ...] = ()  # of the scalars in the first message of a JointState
    obstacle: str = ''

    def __len__(self) -> int:
        return len(self.receive_times)


class TimesCollector:
    """Collects the times of one topic, block by block."""

    def __init__(self, topic: str, type_name: str, definition: Definition | None, obstacle: str):
        self._topic, self._type, self._definition = topic, type_name, definition
        self._obstacle = obstacle
        if definition is not None and not _begins_with_header(definition):
            self._obstacle = f'{type_name} has no header with a stamp'
        self._stamps: list[Times] = []
        self._received: list[Times] = []
        self._sent: list[Times] = []
        self._first: bytes | None = None

    def add(self, block: StoredMessages) -> None:
        """Take the times of the messages in `block`."""
        if self._first is None:
            self._first = block.message(0)[0]
        self._received.append(block.heads['log_time'].copy())
        self._sent.append(block.heads['publish_time'].copy())
        if not self._obstacle:
            stamps = _stamps_in(block)
            if stamps is None:
                self._obstacle = 'not every message begins with a stamp'
            else:
                self._stamps.append(stamps)

    def times(self) -> TopicTimes:
        """Return what was collected."""
        empty = np.empty(0, np.int64)
        stamps = np.concatenate([empty, *self._stamps]) if not self._obstacle else None
        received, sent = np.concatenate([empty, *self._received]), np.concatenate([empty, *self._sent])
        return TopicTimes(self._topic, self._type, stamps, received, sent, self._names(), self._obstacle)

    def _names(self) -> tuple[str, ...]:
        if self._first is None or self._obstacle:
            return ()
        time = np.zeros(1, np.int64)
        row = np.frombuffer(self._first, np.uint8)[None]
        first = Series(self._topic, self._type, Payloads([row]), time, time, definition=self._definition)
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
    if rows is None:
        return None
    for kind, order in ((1, '<'), (0, '>')):
        if (rows[:, 0] == 0).all() and (rows[:, 1] == kind).all():
            numbers = np.ascontiguousarray(rows[:, _STAMP_AT:])
            seconds = numbers[:, :4].copy().view(f'{order}i4')[:, 0].astype(np.int64)
            return seconds * 1_000_000_000 + numbers[:, 4:].copy().view(f'{order}u4')[:, 0]
    return None
