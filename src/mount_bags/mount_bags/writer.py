"""Writes a recording as rosbag2 0.26 (ROS 2 Jazzy) does: a folder with one MCAP file and `metadata.yaml`."""

import errno
import os
import shutil
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from mount_bags.container import CHUNK_SIZE, ChunkedMcap
from mount_bags.metadata import (
    METADATA_NAME,
    NO_TIME,
    BagInformation,
    FileInformation,
    TopicInformation,
    embedded_text,
    metadata_text,
)
from mount_bags.offered_qos import OfferedQos, qos_text
from mount_bags.record_file import RecordFile
from mount_bags.schemas import schema_text, type_hash

PROFILE = 'ros2'
LIBRARY = 'engine-mount mount_bags 0.1.0'
SCHEMA_ENCODING = 'ros2msg'
MESSAGE_ENCODING = 'cdr'
_NO_SPACE = frozenset((errno.ENOSPC, errno.EDQUOT, errno.EFBIG))

Offers = Callable[[], Sequence[OfferedQos]]


class RecordingError(ValueError):
    """A recording cannot be made or continued; the text says why and what stands on the disk."""


@dataclass
class _Topic:
    name: str
    type: str
    offers: Offers
    schema: int
    type_hash: str
    channel: int = 0  # 0 until the first message: only then is its publisher surely known
    offered_qos: tuple[OfferedQos, ...] = ()


class BagWriter:
    """One recording, from its creation to `close`; used by one thread at a time.

    Each complete chunk is with the kernel, so a crash of the process costs at most the chunk that is
    being filled. On a full disk the last complete chunk stands, the file is closed with its summary,
    and `RecordingError` is raised by the call that met the end and by every later `write`.
    """

    def __init__(
        self,
        folder: str | os.PathLike[str],
        *,
        chunk_size: int = CHUNK_SIZE,
        custom_data: Mapping[str, str] | None = None,
        open_file: Callable[[Path], RecordFile] = RecordFile,
    ):
        self.folder = Path(folder)
        self.failure = ''
        self.closed = False
        self._custom_data = dict(custom_data or {})
        self._topics: dict[str, _Topic] = {}
        self._schemas: dict[str, int] = {}
        self._channels: dict[str, int] = {}
        self._file_name = f'{self.folder.name}_0.mcap'
        _create(self.folder)
        try:
            self._file = open_file(self.folder / self._file_name)
            self._container = ChunkedMcap(self._file, chunk_size)
            self._container.start(PROFILE, LIBRARY)
        except OSError as error:
            shutil.rmtree(self.folder, ignore_errors=True)
            raise RecordingError(f'recording {self.folder} cannot be started: {error.strerror}') from None

    @property
    def kept(self) -> int:
        """How many messages stand in complete chunks."""
        return sum(self._container.message_counts.values())

    @property
    def pending(self) -> int:
        """How many messages wait in the chunk that is being filled."""
        return self._container.pending

    @property
    def size(self) -> int:
        """How many bytes the file has."""
        return self._file.size

    def add_topic(self, name: str, type_name: str, offered_qos: Sequence[OfferedQos] | Offers = ()) -> None:
        """Announce a topic by its full name; raises `SchemaError` if its type is not installed.

        `offered_qos` may be a function: it is asked at the first message, when publishers are known.
        """
        if name in self._topics:
            raise RecordingError(f'topic {name} is already part of the recording {self.folder}')
        if type_name not in self._schemas:
            text = schema_text(type_name).encode()
            self._schemas[type_name] = self._container.add_schema(type_name, SCHEMA_ENCODING, text)
        offers = offered_qos if callable(offered_qos) else _constantly(tuple(offered_qos))
        self._topics[name] = _Topic(name, type_name, offers, self._schemas[type_name], type_hash(type_name))

    def write(self, topic: str, raw: bytes, receive_time: int, publish_time: int | None = None) -> None:
        """Add one serialised message; times in ns, the publish time is the receive time where unknown.

        Raises `RecordingError` for an unknown topic, after `close`, and when the disk is full.
        """
        try:
            self._container.add_message(
                self._channels[topic],
                raw,
                receive_time,
                receive_time if publish_time is None else publish_time,
            )
        except KeyError:
            self._open_channel(topic)
            self.write(topic, raw, receive_time, publish_time)
        except OSError as error:
            self._end_early(error)

    def flush(self) -> None:
        """Complete the chunk that is being filled; raises `RecordingError` when the disk is full."""
        if self.closed:
            return
        try:
            self._container.flush()
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

    def discard(self) -> None:
        """Remove the recording from the disk, for one that was never begun."""
        self.closed = True
        self._channels.clear()
        self._file.close()
        shutil.rmtree(self.folder, ignore_errors=True)

    def _open_channel(self, topic: str) -> None:
        if self.failure:
            raise RecordingError(self.failure)
        if self.closed:
            raise RecordingError(f'recording {self.folder} is closed; nothing can be added')
        if topic not in self._topics:
            raise RecordingError(f'topic {topic} is not announced; call add_topic before write')
        self._declare(self._topics[topic])
        self._channels[topic] = self._topics[topic].channel

    def _declare(self, topic: _Topic) -> None:
        topic.offered_qos = tuple(topic.offers())
        details = {'offered_qos_profiles': qos_text(topic.offered_qos), 'topic_type_hash': topic.type_hash}
        topic.channel = self._container.add_channel(topic.name, MESSAGE_ENCODING, topic.schema, details)

    def _end_early(self, error: OSError) -> None:
        try:
            self._finish()
            state = 'is closed and readable'
        except OSError:
            state = 'ends without its summary but with whole chunks'
        self._refuse(f'{_reason(error)}; the file {state}')

    def _refuse(self, why: str) -> None:
        self.closed = True
        self._channels.clear()  # so that `write` comes to know without a test per message
        self.failure = f'recording {self.folder} stopped after {self.kept} messages: {why}'
        raise RecordingError(self.failure)

    def _finish(self) -> None:
        """Write the end of the file; on the way every step leaves whole records."""
        self.closed = True
        self._channels.clear()
        for topic in self._topics.values():
            if not topic.channel:
                self._declare(topic)
        information = self._information()
        try:
            self._file.release_room()
            self._container.add_metadata('rosbag2', {'serialized_metadata': embedded_text(information)})
            self._container.finish()
        finally:
            self._file.close()
            _write_durably(self.folder / METADATA_NAME, metadata_text(information))

    def _information(self) -> BagInformation:
        counts = self._container.message_counts
        start, end = self._container.start_time, self._container.end_time
        starting_time = NO_TIME if start is None else start
        duration = 0 if start is None or end is None else end - start
        return BagInformation(
            topics=tuple(
                TopicInformation(
                    name=topic.name,
                    type=topic.type,
                    message_count=counts.get(topic.channel, 0),
                    offered_qos=topic.offered_qos,
                    type_hash=topic.type_hash,
                )
                for topic in self._topics.values()
            ),
            files=(FileInformation(self._file_name, starting_time, duration, self.kept),),
            starting_time=starting_time,
            duration=duration,
            message_count=self.kept,
            ros_distro=os.environ.get('ROS_DISTRO', 'jazzy'),
            custom_data=self._custom_data,
        )


def _create(folder: Path) -> None:
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
