"""Writes a recording as rosbag2 0.26 (ROS 2 Jazzy) does: a folder with MCAP files and `metadata.yaml`."""

import errno
import os
import shutil
from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import NamedTuple

import numpy as np
import yaml
from numpy.typing import NDArray

from mount_models.quantity import ParameterError
from mount_recorder.losses import RECORDER_RECORD, Reception, loss_statement
from mount_recorder.mcap_writer import CHUNK_SIZE, McapWriter
from mount_recorder.metadata import (
    METADATA_NAME,
    FileEntry,
    OfferedQos,
    TopicEntry,
    bag_description,
    embedded_record,
    metadata_text,
    qos_text,
)
from mount_recorder.record_file import RecordFile
from mount_recorder.schemas import schema_text, type_hash
from mount_recorder.topic_groups import topic_group

LIBRARY = 'engine-mount mount_recorder 0.1.0'
PIECE_RECORD = 'engine_mount_piece'
"""Name of the writer's note in every file but the first: which latched topics it repeats there."""
LEAST_SIZE = 1_000_000  # bytes, chosen: below, a file is mostly head and end
LEAST_DURATION = 1_000_000_000  # ns, chosen
_NEVER = 1 << 64  # ns, later than every log time
_NO_SPACE = frozenset((errno.ENOSPC, errno.EDQUOT, errno.EFBIG))

Offers = Callable[[], Sequence[OfferedQos]]


class RecordingError(ValueError):
    """A recording cannot be made or continued; the text says why and what stands on the disk."""


class SplitRule(NamedTuple):
    """The limits of a file: bytes of `size`, ns of log time in `duration`; 0 is no limit."""

    size: int = 0
    duration: int = 0


WHOLE = SplitRule()
"""One file, however long it becomes."""


def checked_rule(rule: SplitRule) -> SplitRule:
    """Return `rule` if its limits are large enough to make sense; raises `ParameterError`."""
    if rule.size and rule.size < LEAST_SIZE:
        raise ParameterError(
            f'split size ({rule.size} bytes) must be at least {LEAST_SIZE} bytes, or 0 for none'
        )
    if rule.duration and rule.duration < LEAST_DURATION:
        raise ParameterError(
            f'split duration ({rule.duration / 1e9:g} s) must be at least 1 s, or 0 for none'
        )
    return rule


@dataclass
class _Topic:
    name: str
    type: str
    hash: str
    offers: Offers
    latched: bool
    details: Mapping[str, str]
    channel: int = 0  # the same in all files; 0 until the first message: only then is its publisher known
    offered_qos: Sequence[OfferedQos] = ()
    last: tuple[bytes, int] | None = None  # message and publish time, of a latched one


class BagWriter:
    """One recording, from its creation to `close`; used by one thread at a time.

    Each complete chunk is with the kernel, so a crash of the process costs at most the chunk that is
    being filled. On a full disk the last complete chunk stands, the file is closed with its summary,
    and `RecordingError` is raised by the call that met the end and by every later `write`.

    With a `split` rule the recording goes on in a next file, which begins with the last message of each
    latched topic, so that it can be read alone. `close` forces all files to the disk.
    """

    def __init__(
        self,
        folder: str | os.PathLike[str],
        *,
        split: SplitRule = WHOLE,
        chunk_size: int = CHUNK_SIZE,
        custom_data: Mapping[str, str] | None = None,
        open_file: type[RecordFile] = RecordFile,
    ):
        self.folder = Path(folder)
        self.failure = ''
        self.closed = False
        self.receptions: Mapping[str, Reception] | None = None
        """The counts of the recorder, from which the end of the recording states the losses."""
        self.excerpt = False
        """Whether the recording holds a part of what was received, on purpose."""
        self._split = split
        self._custom_data = dict(custom_data or {})
        self._create_file = partial(McapWriter, library=LIBRARY, chunk_size=chunk_size, open_file=open_file)
        self._topics: dict[str, _Topic] = {}
        self._schemas: dict[str, int] = {}  # by type, the same in all files
        self._channels: dict[str, int] = {}  # of the topics for which `write` has nothing else to do
        self._files: list[McapWriter] = []
        self._repeated = Counter[int]()  # by channel: messages that an earlier file has too
        self._due = 0 if split.duration else _NEVER  # log time from which a message may begin a file
        create_folder(self.folder)
        try:
            self._open_file()
        except OSError as error:
            shutil.rmtree(self.folder, ignore_errors=True)
            raise RecordingError(f'recording {self.folder} cannot be started: {error.strerror}') from None

    @property
    def kept(self) -> int:
        """How many messages stand in complete chunks, repetitions not counted."""
        return sum(writer.message_counts.total() for writer in self._files) - self._repeated.total()

    @property
    def pending(self) -> int:
        """How many messages wait in the chunks that are being filled."""
        return self._file.pending

    @property
    def size(self) -> int:
        """How many bytes the files have."""
        return sum(writer.file.size for writer in self._files)

    def add_topic(
        self,
        name: str,
        type_name: str,
        offered_qos: Sequence[OfferedQos] | Offers = (),
        *,
        latched: bool = False,
        details: Mapping[str, str] | None = None,
    ) -> None:
        """Announce a topic by its full name; raises `SchemaError` if its type is not installed.

        `offered_qos` may be a function: it is called at the first message, when publishers are known.
        The last message of a `latched` topic is repeated at the head of each file. `details` are further
        metadata of the channel.
        """
        if name in self._topics:
            raise RecordingError(f'topic {name} is already part of the recording {self.folder}')
        if type_name not in self._schemas:
            self._schemas[type_name] = _add_schema(self._file, type_name)
        offers = offered_qos if callable(offered_qos) else partial(tuple, offered_qos)
        self._topics[name] = _Topic(name, type_name, type_hash(type_name), offers, latched, details or {})

    def write(self, topic: str, raw: bytes, receive_time: int, publish_time: int | None = None) -> None:
        """Add one serialised message; times in ns, the publish time is the receive time where unknown.

        Raises `RecordingError` for an unknown topic, after `close`, and when the disk is full.
        """
        if publish_time is None:
            publish_time = receive_time
        try:
            if receive_time >= self._due:
                self._begin_file(receive_time)
            channel = self._channels.get(topic) or self._checked_channel(topic, raw, publish_time)
            self._add_message(channel, raw, receive_time, publish_time)
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
        """Complete the chunks that are being filled; raises `RecordingError` when the disk is full."""
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

    def _checked_channel(self, name: str, raw: bytes, publish_time: int) -> int:
        """Return the channel of a topic for its first message, and for each of a latched topic."""
        if self.closed:
            raise RecordingError(self.failure or f'recording {self.folder} is closed; nothing can be added')
        if name not in self._topics:
            raise RecordingError(f'topic {name} is not announced; call add_topic before write')
        topic = self._topics[name]
        self._open_channel(topic)
        if topic.latched:
            topic.last = raw, publish_time
        else:
            self._channels[name] = topic.channel
        return topic.channel

    # Files.

    def _open_file(self) -> None:
        writer = self._create_file(self.folder / f'{self.folder.name}_{len(self._files)}.mcap')
        # In the order in which they were declared first, so that all files give them the same numbers.
        for type_name in self._schemas:
            _add_schema(writer, type_name)
        for topic in sorted(self._topics.values(), key=lambda topic: topic.channel):
            if topic.channel:
                self._add_channel(writer, topic)
        writer.after_chunk = self._note_size
        self._files.append(writer)
        self._file, self._add_message = writer, writer.add_message

    def _add_channel(self, writer: McapWriter, topic: _Topic) -> int:
        details = {
            'offered_qos_profiles': qos_text(topic.offered_qos),
            'topic_type_hash': topic.hash,
            **topic.details,
        }
        group = topic_group(topic.name, topic.type)
        return writer.add_channel(topic.name, 'cdr', self._schemas[topic.type], details, group)

    def _open_channel(self, topic: _Topic) -> None:
        if not topic.channel:
            topic.offered_qos = tuple(topic.offers())
            topic.channel = self._add_channel(self._file, topic)

    def _note_size(self) -> None:
        if self._split.size and self._file.size_at_end > self._split.size:
            self._due = 0  # with the next message, so that no file is empty

    def _begin_file(self, time: int) -> None:
        """Begin a file with the message of log time `time` (ns), unless the present one is still empty."""
        full = self._file
        if full.pending or full.message_counts:
            full.flush()
            self._open_file()
            full.finish(embedded_record(self._description([full])))
            self._due = _NEVER
            self._repeat_latched(time)
        self._due = time + self._split.duration if self._split.duration else _NEVER

    def _repeat_latched(self, time: int) -> None:
        """Write the latched messages with log time `time` (ns) and their own publish times.

        A metadata record before them names their topics: a reader of all files counts each once.
        """
        repeated = [(topic, *topic.last) for topic in self._topics.values() if topic.last is not None]
        names = yaml.safe_dump([topic.name for topic, *_ in repeated], default_flow_style=True)
        self._file.add_metadata(PIECE_RECORD, {'number': str(len(self._files) - 1), 'repeated': names})
        try:
            for topic, raw, publish_time in repeated:
                self._file.add_message(topic.channel, raw, time, publish_time)
            self._file.flush()
        finally:
            self._repeated.update(self._file.message_counts)

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
        state = 'the file is closed and readable'
        if cut:
            state = f'{cut} ends without its summary but with whole chunks'
        self._fail(f'{_reason_of(error)}; {state}')

    def _fail(self, why: str) -> None:
        self._refuse_writes()
        self.failure = f'recording {self.folder} stopped after {self.kept} messages: {why}'
        raise RecordingError(self.failure)

    def _refuse_writes(self) -> None:
        """Lead `write` to its checks, which it does not make for each message."""
        self.closed = True
        self._channels.clear()
        self._due = _NEVER

    def _finish(self) -> None:
        """Write the end of the last file and `metadata.yaml`; whatever fails, whole records stand."""
        self._refuse_writes()
        for topic in self._topics.values():
            self._open_channel(topic)
        records: dict[str, Mapping[str, str]] = {**embedded_record(self._description([self._file]))}
        if self.receptions is not None:
            kept = {
                topic.name: _count(self._files, topic) - self._repeated[topic.channel]
                for topic in self._topics.values()
            }
            records[RECORDER_RECORD] = loss_statement(self.receptions, kept, excerpt=self.excerpt)
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
            TopicEntry(topic.name, topic.type, _count(files, topic), topic.offered_qos, topic.hash)
            for topic in self._topics.values()
        ]
        entries = [file_entry(writer.file.path.name, writer) for writer in files]
        return bag_description(topics, entries, self._custom_data, os.environ.get('ROS_DISTRO', 'jazzy'))


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


def file_entry(name: str, writer: McapWriter) -> FileEntry:
    """Return what `metadata.yaml` says of a file: what is physically there."""
    return FileEntry(name, writer.start_time, writer.end_time, writer.message_counts.total())


def _add_schema(writer: McapWriter, type_name: str) -> int:
    return writer.add_schema(type_name, 'ros2msg', schema_text(type_name).encode())


def _count(files: Sequence[McapWriter], topic: _Topic) -> int:
    return sum(writer.message_counts[topic.channel] for writer in files)


def _reason_of(error: OSError) -> str:
    if error.errno in _NO_SPACE:
        return f'no space left on the disk ({error.strerror})'
    return f'the disk refused to write ({error.strerror})'
