"""Writes a recording as rosbag2 0.26 (ROS 2 Jazzy) does: a folder with MCAP files and `metadata.yaml`."""

import errno
import os
import shutil
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from mount_recorder.losses import RECORDER_RECORD, Reception, loss_statement
from mount_recorder.mcap_writer import CHUNK_SIZE, McapWriter
from mount_recorder.metadata import (
    METADATA_NAME,
    Offers,
    TopicEntry,
    bag_description,
    embedded_record,
    metadata_text,
    qos_text,
)
from mount_recorder.record_file import RecordFile
from mount_recorder.schemas import schema_text, type_hash

LIBRARY = 'engine-mount mount_recorder 0.1.0'
_NO_SPACE = frozenset((errno.ENOSPC, errno.EDQUOT, errno.EFBIG))

FindOffers = Callable[[], Offers]


class RecordingError(ValueError):
    """A recording cannot be made or continued; the text says why and what stands on the disk."""


@dataclass
class _Topic:
    name: str
    type: str
    find_offers: FindOffers
    details: Mapping[str, str]
    channel: int = 0  # the same in all files; 0 until the first message: only then is its publisher known
    offers: Offers = ()


class BagWriter:
    """One recording, from its creation to `close`; used by one thread at a time.

    Each complete chunk is with the kernel, so a crash of the process costs at most the chunk that is
    being filled. On a full disk the last complete chunk stands, the file is closed with its summary,
    and `RecordingError` is raised by the call that met the end and by every later `write`.

    With a `split_size` (bytes) the recording goes on in a next file before one becomes larger. `close` forces
    all files to the disk.
    """

    def __init__(
        self,
        folder: str | os.PathLike[str],
        *,
        split_size: int = 0,
        chunk_size: int = CHUNK_SIZE,
        open_file: type[RecordFile] = RecordFile,
    ):
        self.folder = Path(folder)
        self.failure = ''
        self.closed = False
        self.receptions: Mapping[str, Reception] | None = None
        """The counts of the recorder, from which the end of the recording states the losses."""
        self._create_file = partial(
            McapWriter, library=LIBRARY, chunk_size=chunk_size, open_file=open_file, size_limit=split_size
        )
        self._topics: dict[str, _Topic] = {}
        self._schemas: dict[str, int] = {}  # by type, the same in all files
        self._channels: dict[str, int] = {}  # of the topics for which `write` has nothing else to do
        self._files: list[McapWriter] = []
        create_folder(self.folder)
        try:
            self._open_file()
        except OSError as error:
            shutil.rmtree(self.folder, ignore_errors=True)
            raise RecordingError(f'recording {self.folder} cannot be started: {error.strerror}') from None

    @property
    def kept(self) -> int:
        """How many messages stand in complete chunks."""
        return sum(writer.message_counts.total() for writer in self._files)

    @property
    def pending(self) -> int:
        """How many messages wait in the chunk that is being filled."""
        return self._file.pending

    @property
    def size(self) -> int:
        """How many bytes the files have."""
        return sum(writer.file.size for writer in self._files)

    def add_topic(
        self,
        name: str,
        type_name: str,
        find_offers: FindOffers = tuple,
        details: Mapping[str, str] | None = None,
    ) -> None:
        """Announce a topic by its full name; raises `SchemaError` if its type is not installed.

        `find_offers` is called at the first message, when publishers are known. `details` are further
        metadata of the channel.
        """
        if name in self._topics:
            raise RecordingError(f'topic {name} is already part of the recording {self.folder}')
        if type_name not in self._schemas:
            self._schemas[type_name] = _add_schema(self._file, type_name)
        self._topics[name] = _Topic(name, type_name, find_offers, details or {})

    def write(self, topic: str, raw: bytes, receive_time: int, publish_time: int | None = None) -> None:
        """Add one serialised message; times in ns, the publish time is the receive time where unknown.

        Raises `RecordingError` for an unknown topic, after `close`, and when the disk is full.
        """
        if publish_time is None:
            publish_time = receive_time
        channel = self._channels.get(topic) or self._first_channel(topic)
        try:
            if self._file.full:
                self._begin_next_file()
            self._file.add_message(channel, raw, receive_time, publish_time)
        except OSError as error:
            self._end_early(error)

    def write_columns(
        self, topics: Sequence[str], columns: Sequence[NDArray[np.uint8]], times: NDArray[np.int64]
    ) -> None:
        """Write a message of each topic for each of `times` (ns), time by time.

        `columns` are the serialised messages, (times, bytes) for each topic.
        """
        for place, time in enumerate(times.tolist()):
            for topic, rows in zip(topics, columns, strict=True):
                self.write(topic, rows[place].tobytes(), time)

    def flush(self) -> None:
        """Complete the chunk that is being filled; raises `RecordingError` when the disk is full."""
        if not self.closed:
            try:
                self._file.flush()
            except OSError as error:
                self._end_early(error)

    def close(self) -> None:
        """Complete the last chunk, write summary and `metadata.yaml`; safe to call twice."""
        if self.closed:
            return
        self.flush()
        try:
            self._finish()
        except OSError as error:
            self._fail_at_end(error, 'the file')

    def stop(self, why: str) -> None:
        """Close the recording before its time and raise `RecordingError` with the sentence `why`."""
        self.close()
        self._fail(f'{why}; the file is closed and readable')

    def discard(self) -> None:
        """Remove the recording from the disk, for one that was never begun."""
        self._refuse_writes()
        for writer in self._files:
            writer.file.close()
        shutil.rmtree(self.folder, ignore_errors=True)

    # Files.

    def _first_channel(self, name: str) -> int:
        """Return the channel of a topic for its first message."""
        if self.closed:
            raise RecordingError(self.failure or f'recording {self.folder} is closed; nothing can be added')
        if name not in self._topics:
            raise RecordingError(f'topic {name} is not announced; call add_topic before write')
        self._open_channel(self._topics[name])
        self._channels[name] = self._topics[name].channel
        return self._channels[name]

    def _open_channel(self, topic: _Topic) -> None:
        if not topic.channel:
            topic.offers = topic.find_offers()
            topic.channel = self._add_channel(self._file, topic)

    def _add_channel(self, writer: McapWriter, topic: _Topic) -> int:
        details = {
            'offered_qos_profiles': qos_text(topic.offers),
            'topic_type_hash': type_hash(topic.type),
            **topic.details,
        }
        return writer.add_channel(topic.name, 'cdr', self._schemas[topic.type], details)

    def _open_file(self) -> None:
        writer = self._create_file(self.folder / f'{self.folder.name}_{len(self._files)}.mcap')
        # In the order in which they were declared first, so that all files give them the same numbers.
        for type_name in self._schemas:
            _add_schema(writer, type_name)
        for topic in sorted(self._topics.values(), key=lambda topic: topic.channel):
            if topic.channel:
                self._add_channel(writer, topic)
        self._files.append(writer)
        self._file = writer

    def _begin_next_file(self) -> None:
        full = self._file
        self._open_file()
        full.finish(embedded_record(self._description([full])))

    # The end.

    def _end_early(self, error: OSError) -> None:
        try:
            self._finish()
            cut = ''
        except OSError:
            cut = 'the file'
        self._fail_at_end(error, cut)

    def _fail_at_end(self, error: OSError, cut: str) -> None:
        """Raise what `error` says and which files have no end; `cut` where none of the MCAP files has not."""
        cut = ', '.join(writer.file.path.name for writer in self._files if not writer.finished) or cut
        state = (
            f'{cut} ends without its summary but with whole chunks'
            if cut
            else 'the file is closed and readable'
        )
        reason = 'no space left on the disk' if error.errno in _NO_SPACE else 'the disk refused to write'
        self._fail(f'{reason} ({error.strerror}); {state}')

    def _fail(self, why: str) -> None:
        self._refuse_writes()
        self.failure = f'recording {self.folder} stopped after {self.kept} messages: {why}'
        raise RecordingError(self.failure)

    def _refuse_writes(self) -> None:
        """Lead `write` to its checks, which it does not make for each message."""
        self.closed = True
        self._channels.clear()

    def _finish(self) -> None:
        """Write the end of the last file and `metadata.yaml`; whatever fails, whole records stand."""
        self._refuse_writes()
        for topic in self._topics.values():
            self._open_channel(topic)
        records: dict[str, Mapping[str, str]] = {**embedded_record(self._description([self._file]))}
        if self.receptions is not None:
            kept = {topic.name: _count(self._files, topic) for topic in self._topics.values()}
            records[RECORDER_RECORD] = loss_statement(self.receptions, kept)
        try:
            self._file.finish(records)
        finally:
            metadata = self.folder / METADATA_NAME
            metadata.write_text(metadata_text(self._description(self._files)), encoding='utf-8')
            for path in (metadata, *(writer.file.path for writer in self._files)):
                with path.open('rb') as file:
                    os.fsync(file.fileno())

    def _description(self, files: Sequence[McapWriter]) -> dict[str, object]:
        topics = [
            TopicEntry(topic.name, topic.type, _count(files, topic), topic.offers, type_hash(topic.type))
            for topic in self._topics.values()
        ]
        return bag_description(topics, files, os.environ.get('ROS_DISTRO', 'jazzy'))


def create_folder(folder: Path) -> None:
    """Create the folder of a recording; raises `RecordingError`, also where it exists already."""
    if not folder.name:
        raise RecordingError(f'{str(folder)!r} names no folder for the recording')
    try:
        folder.parent.mkdir(parents=True, exist_ok=True)
        folder.mkdir()
    except FileExistsError:
        raise RecordingError(
            f'{folder} exists already; a recording is never written over: name another folder or remove it'
        ) from None
    except OSError as error:
        raise RecordingError(f'folder {folder} cannot be created: {error.strerror}') from None


def _add_schema(writer: McapWriter, type_name: str) -> int:
    return writer.add_schema(type_name, 'ros2msg', schema_text(type_name).encode())


def _count(files: Sequence[McapWriter], topic: _Topic) -> int:
    return sum(writer.message_counts[topic.channel] for writer in files)
