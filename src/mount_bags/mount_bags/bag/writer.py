"""Writes a recording as rosbag2 0.26 (ROS 2 Jazzy) does: a folder with MCAP files and `metadata.yaml`."""

import errno
import os
import shutil
import threading
from collections.abc import Callable, Mapping, Sequence
from functools import partial
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from mount_bags.bag.metadata import (
    METADATA_NAME,
    NO_TIME,
    BagInformation,
    TopicInformation,
    embedded_text,
    metadata_text,
)
from mount_bags.bag.offered_qos import OfferedQos
from mount_bags.bag.piece import BagTopic, Offers, Piece, Repetition
from mount_bags.bag.schemas import type_hash
from mount_bags.bag.split import WHOLE, SplitRule
from mount_bags.bag.statement import Reception, statement
from mount_bags.container.record_file import RecordFile
from mount_bags.container.stored import RECORDER_RECORD
from mount_bags.container.writer import CHUNK_SIZE

_NO_SPACE = frozenset((errno.ENOSPC, errno.EDQUOT, errno.EFBIG))
_NEVER = 1 << 64  # ns, later than every log time

Statement = Callable[[Mapping[str, int]], Mapping[str, str]]
"""Makes the metadata record of the recorder from the messages kept by topic."""


class RecordingError(ValueError):
    """A recording cannot be made or continued; the text says why and what stands on the disk."""


class BagWriter:
    """One recording, from its creation to `close`; used by one thread at a time.

    Each complete chunk is with the kernel, so a crash of the process costs at most the chunk that is
    being filled. On a full disk the last complete chunk stands, the file is closed with its summary,
    and `RecordingError` is raised by the call that met the end and by every later `write`.

    With a `split` rule the recording goes on in a next file, which begins with the last message of each
    latched topic, so that it can be read alone. The file before is closed by a thread of its own.
    """

    def __init__(
        self,
        folder: str | os.PathLike[str],
        *,
        split: SplitRule = WHOLE,
        chunk_size: int = CHUNK_SIZE,
        custom_data: Mapping[str, str] | None = None,
        open_file: Callable[[Path], RecordFile] = RecordFile,
    ):
        self.folder = Path(folder)
        self.failure = ''
        self.closed = False
        self.statement: Statement | None = None  # asked at the end
        self._split = split
        self._chunk_size = chunk_size
        self._custom_data = dict(custom_data or {})
        self._open_file = open_file
        self._topics: dict[str, BagTopic] = {}
        self._types: dict[str, int] = {}
        self._channels: dict[str, int] = {}  # of the topics that `write` need not look at
        self._latched: dict[str, Repetition] = {}
        self._pieces: list[Piece] = []
        self._closing: threading.Thread | None = None
        self._unfinished: list[str] = []
        self._due = 0 if split.duration else _NEVER  # log time from which a message may begin a piece
        create_folder(self.folder)
        try:
            self._piece = self._open_piece()
        except OSError as error:
            shutil.rmtree(self.folder, ignore_errors=True)
            raise RecordingError(f'recording {self.folder} cannot be started: {error.strerror}') from None

    @property
    def kept(self) -> int:
        """How many messages stand in complete chunks."""
        return sum(piece.kept for piece in self._pieces)

    @property
    def pending(self) -> int:
        """How many messages wait in the chunk that is being filled."""
        return self._piece.container.pending

    @property
    def size(self) -> int:
        """How many bytes the files have."""
        return sum(piece.file.size for piece in self._pieces)

    def unwritten(self, handed: int) -> int:
        """Return how many of the messages handed over do not stand on the disk, once writing has failed."""
        return handed - self.kept

    def attach(self, receptions: Mapping[str, Reception]) -> None:
        """Take the recorder's counts, which the end of the recording shall tell of."""
        self.statement = partial(statement, receptions)

    def add_topic(
        self,
        name: str,
        type_name: str,
        offered_qos: Sequence[OfferedQos] | Offers = (),
        *,
        latched: bool = False,
        units: Mapping[str, str] | None = None,
    ) -> None:
        """Announce a topic by its full name; raises `SchemaError` if its type is not installed.

        `offered_qos` may be a function: it is asked at the first message, when publishers are known.
        The last message of a `latched` topic is repeated at the head of each file. `units` are those of the
        fields, of a topic that no registry knows.
        """
        if name in self._topics:
            raise RecordingError(f'topic {name} is already part of the recording {self.folder}')
        if type_name not in self._types:
            self._types[type_name] = self._piece.declare_type(type_name)
        offers = offered_qos if callable(offered_qos) else _constantly(tuple(offered_qos))
        number = self._types[type_name]
        topic = BagTopic(name, type_name, offers, number, type_hash(type_name), latched, units=units or {})
        self._topics[name] = topic

    def write(self, topic: str, raw: bytes, receive_time: int, publish_time: int | None = None) -> None:
        """Add one serialised message; times in ns, the publish time is the receive time where unknown.

        Raises `RecordingError` for an unknown topic, after `close`, and when the disk is full.
        """
        if publish_time is None:
            publish_time = receive_time
        try:
            if receive_time >= self._due:
                self._begin_piece(receive_time)
            self._add_message(self._channels[topic], raw, receive_time, publish_time)
        except KeyError:
            self._write_with_care(topic, raw, receive_time, publish_time)
        except OSError as error:
            self._end_early(error)

    def write_columns(
        self, topics: Sequence[str], columns: Sequence[NDArray[np.uint8]], times: NDArray[np.int64]
    ) -> None:
        """Add a message of each topic for each of `times` (ns), receive and publish time in one.

        `columns` are the serialised messages, (times, bytes) for each topic. The recording is the one that
        `write` would make of them, time by time and in the order of the topics; raises what `write` raises.
        """
        place = 0
        # One by one, where a next file may begin, and topics that are met for the first time or latched.
        while place < len(times) and (self._split != WHOLE or not self._channels.keys() >= set(topics)):
            for topic, rows in zip(topics, columns, strict=True):
                self.write(topic, rows[place].tobytes(), int(times[place]))
            place += 1
        if place == len(times):
            return
        numbers = [self._channels[topic] for topic in topics]
        try:
            self._piece.container.add_columns(numbers, [rows[place:] for rows in columns], times[place:])
        except OSError as error:
            self._end_early(error)

    def flush(self) -> None:
        """Complete the chunk that is being filled; raises `RecordingError` when the disk is full."""
        if self.closed:
            return
        try:
            self._piece.container.flush()
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
            self._refuse(f'{_reason(error)}; the file ends without its summary but with whole chunks')
        if self._unfinished:
            self._refuse('; '.join(self._unfinished))

    def stop(self, why: str) -> None:
        """Close the recording before its time and raise `RecordingError` with the sentence `why`."""
        if self.failure:
            raise RecordingError(self.failure)
        self.close()
        self._refuse(f'{why}; the file is closed and readable')

    def discard(self) -> None:
        """Remove the recording from the disk, for one that was never begun."""
        self._shut()
        for piece in self._pieces:
            piece.file.close()
        shutil.rmtree(self.folder, ignore_errors=True)

    def _write_with_care(self, topic: str, raw: bytes, receive_time: int, publish_time: int) -> None:
        """Write the first message of a topic, or any of a latched one."""
        if self.failure:
            raise RecordingError(self.failure)
        if self.closed:
            raise RecordingError(f'recording {self.folder} is closed; nothing can be added')
        if topic not in self._topics:
            raise RecordingError(f'topic {topic} is not announced; call add_topic before write')
        known = self._topics[topic]
        self._open_channel(known)
        if known.latched:
            self._latched[topic] = Repetition(known, raw, publish_time)
        else:
            self._channels[topic] = known.channel
        try:
            self._add_message(known.channel, raw, receive_time, publish_time)
        except OSError as error:
            self._end_early(error)

    def _open_channel(self, topic: BagTopic) -> None:
        if not topic.channel:
            topic.offered_qos = tuple(topic.offers())
            topic.channel = self._piece.declare(topic)

    # Pieces.

    def _open_piece(self) -> Piece:
        piece = Piece(
            self.folder,
            len(self._pieces),
            chunk_size=self._chunk_size,
            open_file=self._open_file,
            after_chunk=self._after_chunk,
        )
        # In the order in which they were declared first, so that all pieces give them the same numbers.
        for type_name in self._types:
            piece.declare_type(type_name)
        for topic in sorted(self._topics.values(), key=lambda topic: topic.channel):
            if topic.channel:
                piece.declare(topic)
        self._pieces.append(piece)
        self._add_message = piece.container.add_message
        return piece

    def _after_chunk(self) -> None:
        if self._split.size and self._piece.room_needed > self._split.size:
            self._due = 0  # with the next message, so that no piece is empty

    def _begin_piece(self, time: int) -> None:
        """Begin a piece with the message of log time `time` (ns), unless the present one is still empty."""
        if not self._piece.empty:
            full = self._piece
            full.container.flush()
            self._piece = self._open_piece()
            self._finish_beside(full)
            self._due = _NEVER
            self._piece.repeat(self._latched.values(), time)
        self._due = time + self._split.duration if self._split.duration else _NEVER

    def _finish_beside(self, piece: Piece) -> None:
        """Close a full piece while the next one is written: bringing it to the disk may take a second."""
        records = {'rosbag2': {'serialized_metadata': embedded_text(self._information([piece]))}}

        def finish() -> None:
            try:
                piece.finish(records)
            except OSError as error:
                self._unfinished.append(f'{piece.path.name} ends without its summary: {_reason(error)}')

        self._wait_for_closing()
        self._closing = threading.Thread(target=finish, name='piece', daemon=True)
        self._closing.start()

    def _wait_for_closing(self) -> None:
        if self._closing is not None:
            self._closing.join()
            self._closing = None

    # The end.

    def _end_early(self, error: OSError) -> None:
        try:
            self._finish()
            state = 'is closed and readable'
        except OSError:
            state = 'ends without its summary but with whole chunks'
        self._refuse(f'{_reason(error)}; the file {state}')

    def _refuse(self, why: str) -> None:
        self._shut()
        self.failure = f'recording {self.folder} stopped after {self.kept} messages: {why}'
        raise RecordingError(self.failure)

    def _shut(self) -> None:
        """Make `write` come to know, without a test for each message."""
        self.closed = True
        self._channels.clear()
        self._due = _NEVER

    def _finish(self) -> None:
        """Write the end of the last file; on the way every step leaves whole records."""
        self._shut()
        for topic in self._topics.values():
            self._open_channel(topic)
        last = [self._piece]
        records = {'rosbag2': {'serialized_metadata': embedded_text(self._information(last))}}
        if self.statement is not None:
            records[RECORDER_RECORD] = dict(self.statement(self._kept_by_topic()))
        try:
            self._piece.finish(records)
        finally:
            self._wait_for_closing()
            _write_durably(self.folder / METADATA_NAME, metadata_text(self._information(self._pieces)))

    def _information(self, pieces: Sequence[Piece]) -> BagInformation:
        files = [piece.information() for piece in pieces]
        filled = [file for file in files if file.starting_time != NO_TIME]
        start = min((file.starting_time for file in filled), default=NO_TIME)
        end = max((file.starting_time + file.duration for file in filled), default=start)
        return BagInformation(
            topics=tuple(
                TopicInformation(
                    name=topic.name,
                    type=topic.type,
                    message_count=sum(p.container.message_counts.get(topic.channel, 0) for p in pieces),
                    offered_qos=topic.offered_qos,
                    type_hash=topic.type_hash,
                )
                for topic in self._topics.values()
            ),
            files=tuple(files),
            starting_time=start,
            duration=end - start,
            message_count=sum(file.message_count for file in files),
            ros_distro=os.environ.get('ROS_DISTRO', 'jazzy'),
            custom_data=self._custom_data,
        )

    def _kept_by_topic(self) -> dict[str, int]:
        return {
            topic.name: sum(
                piece.container.message_counts.get(topic.channel, 0) - piece.repeated.get(topic.channel, 0)
                for piece in self._pieces
            )
            for topic in self._topics.values()
        }


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


def _constantly(offers: tuple[OfferedQos, ...]) -> Offers:
    return lambda: offers


def _reason(error: OSError) -> str:
    if error.errno in _NO_SPACE:
        return f'no space left on the disk ({error.strerror})'
    return f'the disk refused to write ({error.strerror})'


def _write_durably(path: Path, text: str) -> None:
    with path.open('w', encoding='utf-8') as file:
        file.write(text)
        file.flush()
        os.fsync(file.fileno())
