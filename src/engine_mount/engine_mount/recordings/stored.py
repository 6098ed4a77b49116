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
"""Metadata in which a recording describes itself; a recording made of it has its own."""

HEAD = np.dtype(
    [
        ('opcode', '<u1'),
        ('length', '<i8'),
        ('topic', '<u2'),
        ('sequence', '<u4'),
        ('log_time', '<i8'),
        ('publish_time', '<i8'),
    ]
)
"""What is known of a message beside its bytes, as MCAP stores it: the number of its topic, times in ns."""


class StorageError(ValueError):
    """A file holds no recording that can be read; the text gives the reason."""


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

    def of(self, topics: Collection[int]) -> 'StoredMessages':
        """Return the messages of these topics alone."""
        number = self.heads['topic']
        wanted = np.logical_or.reduce([number == topic for topic in topics])
        return self if wanted.all() else self.at(np.flatnonzero(wanted))

    def at(self, places: NDArray[np.int64] | slice) -> 'StoredMessages':
        """Return the messages at these places."""
        return StoredMessages(self.heads[places], self.data, self.begins[places], self.ends[places])

    def message(self, place: int) -> tuple[bytes, int]:
        """Return bytes and publish time (ns) of one message."""
        raw = self.data[int(self.begins[place]) : int(self.ends[place])].tobytes()
        return raw, int(self.heads[place]['publish_time'])

    def beginnings(self, size: int) -> NDArray[np.uint8] | None:
        """Return the first `size` bytes of each message as rows, None if one of them is shorter."""
        return None if (self.ends - self.begins < size).any() else rows_at(self.data, self.begins, size)

    def payloads(self) -> NDArray[np.uint8] | list[bytes]:
        """Return the bytes as rows if all messages have one length, else one by one."""
        lengths = self.ends - self.begins
        if lengths.size and (lengths == lengths[0]).all():
            return rows_at(self.data, self.begins, int(lengths[0]))
        buffer = self.data.data
        pairs = zip(self.begins.tolist(), self.ends.tolist(), strict=True)
        return [bytes(buffer[begin:end]) for begin, end in pairs]


class StoredFile(ABC):
    """One file of a recording; each topic has a number in it.

    It is `whole` if nothing is known to be missing, `damaged` if messages are known to be lost inside of it,
    and `proven` if its own account of its content can be relied upon.
    """

    whole: bool
    damaged: bool
    proven: bool
    time_range: tuple[int, int] | None  # log times in ns, None without messages

    def __init__(self, path: Path):
        self.path = path
        self.topics: dict[int, StoredTopic] = {}
        self.records: list[tuple[str, dict[str, str]]] = []  # of metadata
        self.warnings: list[str] = []
        self.lost_beside: list[str] = []  # names of metadata and attachments that are known to be lost
        self.message_counts: dict[int, int] = {}  # by topic: as written where proven, else as readable
        self.time_range = None

    @property
    def metadata(self) -> dict[str, dict[str, str]]:
        """The last record of each name."""
        return dict(self.records)

    @abstractmethod
    def blocks(self, topics: Collection[int]) -> Iterator[StoredMessages]:
        """Yield the messages of `topics` in the order of the file, unpacked where each is packed."""

    def attachments(self) -> Iterator[Attachment]:
        """Yield the attachments without the damaged ones."""
        return iter(())


def stored_messages(heads: np.ndarray, raws: list[bytes]) -> StoredMessages:
    """Return messages from their heads (n,) and their bytes one by one."""
    lengths = np.array([len(raw) for raw in raws], np.int64)
    ends = np.cumsum(lengths)
    return StoredMessages(heads, np.frombuffer(b''.join(raws), np.uint8), ends - lengths, ends)


def rows_at(data: NDArray[np.uint8], begins: NDArray[np.int64], width: int) -> NDArray[np.uint8]:
    """Return `width` bytes from each of `begins` on, which the caller knows to be inside of `data`."""
    if not (width and len(begins)):
        return np.empty((len(begins), width), np.uint8)
    return np.lib.stride_tricks.sliding_window_view(data, width)[begins]
