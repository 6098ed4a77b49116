"""What a file of a recording is, whatever its format: topics, and messages as bytes with their times."""

from abc import ABC, abstractmethod
from collections.abc import Collection, Iterator, Mapping
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
from mcap.records import Attachment
from numpy.typing import NDArray

from mount_recorder.bag_writer import PIECE_RECORD
from mount_recorder.losses import RECORDER_RECORD

ACCOUNTS = ('rosbag2', RECORDER_RECORD, PIECE_RECORD)
"""Metadata in which a recording tells of itself; one that is made of it has its own."""

HEAD = np.dtype([('topic', '<i8'), ('sequence', '<u4'), ('log_time', '<i8'), ('publish_time', '<i8')])
"""What is told of a message beside its bytes: the number of its topic in the file, times in ns."""


class StorageError(ValueError):
    """A file holds no recording that can be read; the text says why."""


@dataclass(frozen=True)
class StoredTopic:
    """A topic as a file declares it: its type and the definition of that, empty where the file has none.

    `encoding` is that of the messages (`cdr`), `definition_encoding` that of the text (`ros2msg`); `details`
    are `offered_qos_profiles` (YAML), `topic_type_hash` and what else the writer noted.
    """

    name: str
    type: str
    encoding: str
    definition: bytes = b''
    definition_encoding: str = ''
    details: Mapping[str, str] = field(default_factory=dict)


@dataclass(frozen=True, slots=True)
class StoredMessages:
    """Messages of a file in its order: `heads` (n,) of dtype `HEAD`, bytes `data[begins[i]:ends[i]]`."""

    heads: np.ndarray
    data: NDArray[np.uint8]
    begins: NDArray[np.int64]
    ends: NDArray[np.int64]

    def __len__(self) -> int:
        return len(self.heads)

    def of(self, topics: NDArray[np.int64]) -> 'StoredMessages':
        """Return the messages of these topics alone."""
        number = self.heads['topic']
        wanted = number == topics[0] if len(topics) == 1 else np.isin(number, topics)
        return self if wanted.all() else self.at(np.flatnonzero(wanted))

    def at(self, places: NDArray[np.int64] | slice) -> 'StoredMessages':
        """Return the messages at these places."""
        return StoredMessages(self.heads[places], self.data, self.begins[places], self.ends[places])

    def message(self, place: int) -> tuple[bytes, int]:
        """Return bytes and publish time (ns) of one message."""
        raw = self.data[int(self.begins[place]) : int(self.ends[place])].tobytes()
        return raw, int(self.heads[place]['publish_time'])

    def counts(self) -> dict[int, int]:
        """Return the number of messages by topic."""
        topics, counts = np.unique(self.heads['topic'], return_counts=True)
        return dict(zip(topics.tolist(), counts.tolist(), strict=True))

    def time_range(self) -> tuple[int, int]:
        """Return the first and the last log time (ns) of messages, of which there is one at least."""
        times = self.heads['log_time']
        return int(times.min()), int(times.max())

    def beginnings(self, size: int) -> NDArray[np.uint8] | None:
        """Return the first `size` bytes of each message as rows, None if one of them is shorter."""
        if (self.ends - self.begins < size).any():
            return None
        return rows_at(self.data, self.begins, size)

    def payloads(self) -> NDArray[np.uint8] | list[bytes]:
        """Return the bytes as rows if all messages have one length, else one by one."""
        lengths = self.ends - self.begins
        if lengths.size and (lengths == lengths[0]).all():
            return rows_at(self.data, self.begins, int(lengths[0]))
        buffer = self.data.data
        pairs = zip(self.begins.tolist(), self.ends.tolist(), strict=True)
        return [bytes(buffer[begin:end]) for begin, end in pairs]


class StoredFile(ABC):
    """One file of a recording; topics are told apart by numbers of its own.

    It is `whole` if nothing is known to be missing, `damaged` if messages are known to be lost inside of it,
    and `proven` if what it says of itself can be relied upon.
    """

    whole: bool
    damaged: bool
    proven: bool
    _times: tuple[int, int] | None

    def __init__(self, path: Path):
        self.path = path
        self.topics: dict[int, StoredTopic] = {}
        self.metadata: dict[str, dict[str, str]] = {}  # the last record of each name
        self.records: list[tuple[str, dict[str, str]]] = []  # all of them
        self.warnings: list[str] = []
        self.lost_beside: list[str] = []  # names of metadata and attachments that are known to be lost
        self._counts: dict[int, int] = {}
        self._times = None

    def message_counts(self) -> dict[int, int]:
        """Return the number of messages by topic: as written where that is proven, else as readable."""
        return dict(self._counts)

    def time_range(self) -> tuple[int, int] | None:
        """Return the earliest and the latest log time (ns), None for a file without messages."""
        return self._times

    @abstractmethod
    def blocks(self, topics: Collection[int]) -> Iterator[StoredMessages]:
        """Yield the messages of `topics` in the order of the file, unpacked where each is packed."""

    def attachments(self) -> Iterator[Attachment]:
        """Yield what is attached, without what is damaged."""
        return iter(())


def stored_messages(heads: np.ndarray, raws: list[bytes]) -> StoredMessages:
    """Return messages from their heads (n,) and their bytes one by one."""
    ends = np.cumsum([len(raw) for raw in raws], dtype=np.int64)
    begins = ends - np.array([len(raw) for raw in raws], np.int64)
    return StoredMessages(heads, np.frombuffer(b''.join(raws), np.uint8), begins, ends)


def united(one: tuple[int, int] | None, other: tuple[int, int]) -> tuple[int, int]:
    """Return the range of time that holds two others."""
    return other if one is None else (min(one[0], other[0]), max(one[1], other[1]))


def rows_at(data: NDArray[np.uint8], begins: NDArray[np.int64], width: int) -> NDArray[np.uint8]:
    """Return `width` bytes from each of `begins` on, which the caller knows to be inside of `data`."""
    if not (width and len(begins)):
        return np.empty((len(begins), width), np.uint8)
    windows = np.lib.stride_tricks.as_strided(data, (data.size - width + 1, width), (1, 1), writeable=False)
    return windows[begins]
