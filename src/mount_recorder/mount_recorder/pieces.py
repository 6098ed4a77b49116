"""The files of a recording that is being written, one after the other, and what all of them hold together."""

import errno
import os
import threading
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path

from mount_recorder.metadata import (
    METADATA_NAME,
    NO_TIME,
    BagInformation,
    TopicInformation,
    embedded_text,
    metadata_text,
)
from mount_recorder.piece import BagTopic, Piece
from mount_recorder.record_file import RecordFile
from mount_recorder.statement import RECORDER_RECORD

_NO_SPACE = frozenset((errno.ENOSPC, errno.EDQUOT, errno.EFBIG))

Statement = Callable[[Mapping[str, int]], Mapping[str, str]]
"""Makes the metadata record of the recorder from the messages kept by topic."""


class Pieces:
    """All pieces of the recording in `folder`; the last one is written, those before are closed."""

    def __init__(
        self,
        folder: Path,
        *,
        chunk_size: int,
        custom_data: Mapping[str, str],
        open_file: Callable[[Path], RecordFile],
        after_chunk: Callable[[], None],
    ):
        self.topics: dict[str, BagTopic] = {}
        self.unfinished: list[str] = []
        """Why pieces that are full have no summary."""
        self._folder = folder
        self._chunk_size = chunk_size
        self._custom_data = dict(custom_data)
        self._open_file = open_file
        self._after_chunk = after_chunk
        self._types: dict[str, int] = {}
        self._all: list[Piece] = []
        self._closing: threading.Thread | None = None

    @property
    def kept(self) -> int:
        """How many messages stand in complete chunks."""
        return sum(piece.kept for piece in self._all)

    @property
    def size(self) -> int:
        """How many bytes the files have."""
        return sum(piece.file.size for piece in self._all)

    def open_next(self) -> Piece:
        """Return a new piece behind those that there are; raises `OSError`."""
        piece = Piece(
            self._folder,
            len(self._all),
            chunk_size=self._chunk_size,
            open_file=self._open_file,
            after_chunk=self._after_chunk,
        )
        # In the order in which they were declared first, so that all pieces give them the same numbers.
        for type_name in self._types:
            piece.declare_type(type_name)
        for topic in sorted(self.topics.values(), key=lambda topic: topic.channel):
            if topic.channel:
                piece.declare(topic)
        self._all.append(piece)
        return piece

    def type_number(self, type_name: str) -> int:
        """Return the number of a message type; raises `SchemaError` if it is not installed."""
        if type_name not in self._types:
            self._types[type_name] = self._all[-1].declare_type(type_name)
        return self._types[type_name]

    def open_channel(self, topic: BagTopic) -> None:
        """Give a topic its channel, unless it has one."""
        if not topic.channel:
            topic.offered_qos = tuple(topic.offers())
            topic.channel = self._all[-1].declare(topic)

    def close_beside(self, piece: Piece) -> None:
        """Close a full piece while the next one is written: bringing it to the disk may take a second."""
        records = {'rosbag2': {'serialized_metadata': embedded_text(self._information([piece]))}}

        def finish() -> None:
            try:
                piece.finish(records)
            except OSError as error:
                self.unfinished.append(f'{piece.path.name} ends without its summary: {reason_of(error)}')

        self.wait_for_closing()
        self._closing = threading.Thread(target=finish, name='piece', daemon=True)
        self._closing.start()

    def wait_for_closing(self) -> None:
        """Return when no piece is being closed."""
        if self._closing is not None:
            self._closing.join()
            self._closing = None

    def finish(self, statement: Statement | None) -> None:
        """Write the end of the last piece and `metadata.yaml`; raises `OSError`, whole records stand then."""
        for topic in self.topics.values():
            self.open_channel(topic)
        last = self._all[-1]
        records = {'rosbag2': {'serialized_metadata': embedded_text(self._information([last]))}}
        if statement is not None:
            records[RECORDER_RECORD] = dict(statement(self._kept_by_topic()))
        try:
            last.finish(records)
        finally:
            self.wait_for_closing()
            _write_durably(self._folder / METADATA_NAME, metadata_text(self._information(self._all)))

    def abandon(self) -> None:
        """Close all files as they are."""
        for piece in self._all:
            piece.file.close()

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
                for topic in self.topics.values()
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
                for piece in self._all
            )
            for topic in self.topics.values()
        }


def reason_of(error: OSError) -> str:
    """Return in words why the disk took no more."""
    if error.errno in _NO_SPACE:
        return f'no space left on the disk ({error.strerror})'
    return f'the disk refused to write ({error.strerror})'


def _write_durably(path: Path, text: str) -> None:
    with path.open('w', encoding='utf-8') as file:
        file.write(text)
        file.flush()
        os.fsync(file.fileno())
