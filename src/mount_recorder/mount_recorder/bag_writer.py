"""Writes a recording as rosbag2 0.26 (ROS 2 Jazzy) does: a folder with MCAP files and `metadata.yaml`."""

import os
import shutil
from collections.abc import Callable, Mapping, Sequence
from functools import partial
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from mount_recorder.mcap_writer import CHUNK_SIZE
from mount_recorder.offered_qos import OfferedQos
from mount_recorder.piece import BagTopic, Offers, Repetition
from mount_recorder.pieces import Pieces, Statement, reason_of
from mount_recorder.record_file import RecordFile
from mount_recorder.schemas import type_hash
from mount_recorder.split import WHOLE, SplitRule
from mount_recorder.statement import Reception, statement

_NEVER = 1 << 64  # ns, later than every log time


class RecordingError(ValueError):
    """A recording cannot be made or continued; the text says why and what stands on the disk."""


class BagWriter:
    """One recording, from its creation to `close`; used by one thread at a time.

    Each complete chunk is with the kernel, so a crash of the process costs at most the chunk that is
    being filled. On a full disk the last complete chunk stands, the file is closed with its summary,
    and `RecordingError` is raised by the call that met the end and by every later `write`.

    With a `split` rule the recording goes on in a next file, which begins with the last message of each
    latched topic, so that it can be read alone. The file before is closed by a thread of its own. A duration
    is one of log times, or of `clock` (ns), which is looked at after each chunk.
    """

    def __init__(
        self,
        folder: str | os.PathLike[str],
        *,
        split: SplitRule = WHOLE,
        chunk_size: int = CHUNK_SIZE,
        custom_data: Mapping[str, str] | None = None,
        open_file: Callable[[Path], RecordFile] = RecordFile,
        clock: Callable[[], int] | None = None,
    ):
        self.folder = Path(folder)
        self.failure = ''
        self.closed = False
        self.statement: Statement | None = None  # asked at the end
        self._split = split
        self._clock = clock if split.duration else None
        self._piece_begun: int | None = None  # by `clock`, ns
        self._channels: dict[str, int] = {}  # of the topics that `write` need not look at
        self._latched: dict[str, Repetition] = {}
        self._pieces = Pieces(
            self.folder,
            chunk_size=chunk_size,
            custom_data=custom_data or {},
            open_file=open_file,
            after_chunk=self._after_chunk,
        )
        self._duration = 0 if clock else split.duration  # of log times, ns; 0: no limit
        self._due = 0 if self._duration else _NEVER  # log time from which a message may begin a piece
        create_folder(self.folder)
        try:
            self._open_piece()
        except OSError as error:
            shutil.rmtree(self.folder, ignore_errors=True)
            raise RecordingError(f'recording {self.folder} cannot be started: {error.strerror}') from None

    @property
    def kept(self) -> int:
        """How many messages stand in complete chunks."""
        return self._pieces.kept

    @property
    def pending(self) -> int:
        """How many messages wait in the chunk that is being filled."""
        return self._piece.container.pending

    @property
    def size(self) -> int:
        """How many bytes the files have."""
        return self._pieces.size

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
        if name in self._pieces.topics:
            raise RecordingError(f'topic {name} is already part of the recording {self.folder}')
        number = self._pieces.type_number(type_name)
        offers = offered_qos if callable(offered_qos) else _constantly(tuple(offered_qos))
        topic = BagTopic(name, type_name, offers, number, type_hash(type_name), latched, units=units or {})
        self._pieces.topics[name] = topic

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
            self._refuse(f'{reason_of(error)}; the file ends without its summary but with whole chunks')
        if self._pieces.unfinished:
            self._refuse('; '.join(self._pieces.unfinished))

    def stop(self, why: str) -> None:
        """Close the recording before its time and raise `RecordingError` with the sentence `why`."""
        if self.failure:
            raise RecordingError(self.failure)
        self.close()
        self._refuse(f'{why}; the file is closed and readable')

    def discard(self) -> None:
        """Remove the recording from the disk, for one that was never begun."""
        self._shut()
        self._pieces.abandon()
        shutil.rmtree(self.folder, ignore_errors=True)

    def _write_with_care(self, topic: str, raw: bytes, receive_time: int, publish_time: int) -> None:
        """Write the first message of a topic, or any of a latched one."""
        if self.failure:
            raise RecordingError(self.failure)
        if self.closed:
            raise RecordingError(f'recording {self.folder} is closed; nothing can be added')
        if topic not in self._pieces.topics:
            raise RecordingError(f'topic {topic} is not announced; call add_topic before write')
        known = self._pieces.topics[topic]
        self._pieces.open_channel(known)
        if known.latched:
            self._latched[topic] = Repetition(known, raw, publish_time)
        else:
            self._channels[topic] = known.channel
        try:
            self._add_message(known.channel, raw, receive_time, publish_time)
        except OSError as error:
            self._end_early(error)

    # Pieces.

    def _open_piece(self) -> None:
        self._piece = self._pieces.open_next()
        self._add_message = self._piece.container.add_message

    def _after_chunk(self) -> None:
        if self._split.size and self._piece.room_needed > self._split.size:
            self._due = 0  # with the next message, so that no piece is empty
        if self._clock is not None:
            now = self._clock()
            self._piece_begun = now if self._piece_begun is None else self._piece_begun
            if now - self._piece_begun >= self._split.duration:
                self._due = 0

    def _begin_piece(self, time: int) -> None:
        """Begin a piece with the message of log time `time` (ns), unless the present one is still empty."""
        if not self._piece.empty:
            full = self._piece
            full.container.flush()
            self._open_piece()
            self._pieces.close_beside(full)
            self._due = _NEVER
            self._piece_begun = self._clock() if self._clock is not None else None
            self._piece.repeat(self._latched.values(), time)
        self._due = time + self._duration if self._duration else _NEVER

    # The end.

    def _end_early(self, error: OSError) -> None:
        try:
            self._finish()
            state = 'is closed and readable'
        except OSError:
            state = 'ends without its summary but with whole chunks'
        self._refuse(f'{reason_of(error)}; the file {state}')

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
        self._pieces.finish(self.statement)


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
