"""The times of a topic, read in one pass through a recording that keeps no messages."""

from collections.abc import Collection
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from engine_mount.recordings.definitions import Definition
from engine_mount.recordings.layout import HEAD
from engine_mount.recordings.series import STAMP_BYTES
from engine_mount.recordings.stored import StoredMessages
from engine_mount.recordings.times import NO_TIMES, Times


@dataclass(frozen=True)
class TopicTimes:
    """Times in ns in the order of the recording; `obstacle` is the reason where `stamps` are None.

    `receive_times` and `publish_times` are None where nobody needs them.
    """

    topic: str
    type: str
    count: int
    stamps: Times | None
    receive_times: Times | None
    publish_times: Times | None
    names: tuple[str, ...] = ()  # of the scalars in the first message of a JointState
    obstacle: str = ''

    def __len__(self) -> int:
        return self.count


class TimesCollector:
    """Collects the times of one topic, block by block."""

    def __init__(
        self, topic: str, type_name: str, definition: Definition | None, obstacle: str, kept: Collection[str]
    ):
        """Take the definition, or the sentence why there is none; keep these times of heads."""
        self._topic, self._type, self._count = topic, type_name, 0
        self._obstacle = obstacle
        if definition is not None and not definition.has_stamp:
            self._obstacle = f'{type_name} has no header with a stamp'
        self._times: dict[str, list[Times]] = {name: [NO_TIMES] for name in ('stamps', *kept)}

    def add(self, block: StoredMessages) -> None:
        """Take the times of the messages in `block`."""
        self._count += len(block)
        for name in self._times.keys() - {'stamps'}:
            self._times[name].append(block.heads[name].copy())
        if self._obstacle:
            return
        beginnings = block.beginnings(HEAD + STAMP_BYTES)
        stamps = None if beginnings is None else _stamps_in(beginnings)
        if stamps is None:
            self._obstacle = 'not every message begins with a stamp'
        else:
            self._times['stamps'].append(stamps)

    def finish(self, names: tuple[str, ...]) -> TopicTimes:
        """Return the times; `names` are the columns of the first message."""
        found = {name: np.concatenate(self._times.pop(name)) for name in tuple(self._times)}
        stamps = None if self._obstacle else found['stamps']
        received, sent = found.get('log_time'), found.get('publish_time')
        return TopicTimes(self._topic, self._type, self._count, stamps, received, sent, names, self._obstacle)


def _stamps_in(beginnings: NDArray[np.uint8]) -> Times | None:
    """Return the stamps (ns) in the first bytes of messages (n, 12), None where one is no plain CDR."""
    if beginnings[:, 0].any() or (beginnings[:, 1] > 1).any():
        return None
    numbers = np.ascontiguousarray(beginnings[:, HEAD:])
    little, big = (
        numbers.view(f'{order}i4')[:, 0].astype(np.int64) * 1_000_000_000 + numbers.view(f'{order}u4')[:, 1]
        for order in '<>'
    )
    return np.where(beginnings[:, 1] == 1, little, big)
