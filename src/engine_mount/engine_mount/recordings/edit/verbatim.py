"""A recording written with the declarations of another: its messages, schemas and channels as they were."""

import contextlib
import os
import shutil
from collections.abc import Mapping
from pathlib import Path

from mcap.records import Attachment

from engine_mount.recordings.bag.piece_topics import offers_of
from engine_mount.recordings.container.stored import StoredTopic
from mount_recorder.bag_writer import create_folder
from mount_recorder.chunk_groups import chunk_group
from mount_recorder.mcap_writer import LONG_CHUNK_SIZE, ChunkedMcap
from mount_recorder.metadata import (
    METADATA_NAME,
    NO_TIME,
    BagInformation,
    FileInformation,
    TopicInformation,
    embedded_text,
    metadata_text,
)
from mount_recorder.record_file import RecordFile

_PROFILE = 'ros2'
_LIBRARY = 'engine-mount mount_recorder 0.1.0'


class VerbatimBag:
    """One recording of one file; types need not be installed. Raises `RecordingError` where one exists."""

    def __init__(self, folder: str | os.PathLike[str]):
        self.folder = Path(folder)
        self._file_name = f'{self.folder.name}_0.mcap'
        self._schemas: dict[tuple[str, str, bytes], int] = {}
        self._channels: dict[tuple[str, str, int], int] = {}
        self._topics: dict[int, TopicInformation] = {}
        create_folder(self.folder)
        self._file = RecordFile(self.folder / self._file_name)
        self._container = ChunkedMcap(self._file, LONG_CHUNK_SIZE)
        self._container.start(_PROFILE, _LIBRARY)

    @property
    def kept(self) -> int:
        """How many messages stand in complete chunks."""
        return sum(self._container.message_counts.values())

    @property
    def pending(self) -> int:
        """How many messages wait in the chunk that is being filled."""
        return self._container.pending

    @property
    def time_range(self) -> tuple[int, int] | None:
        """The first and the last log time in ns, None without messages."""
        start, end = self._container.start_time, self._container.end_time
        return None if start is None or end is None else (start, end)

    @property
    def kept_by_topic(self) -> dict[str, int]:
        """How many messages of each topic stand in complete chunks."""
        counts: dict[str, int] = {}
        for number, topic in self._topics.items():
            counts[topic.name] = counts.get(topic.name, 0) + self._container.message_counts.get(number, 0)
        return counts

    def topic(self, topic: StoredTopic) -> int:
        """Declare a topic of another file and return the number of its channel; equal ones share it."""
        definition = (topic.type, topic.definition_encoding, topic.definition)
        schema_id = self._schemas.get(definition) or self._container.add_schema(*definition)
        self._schemas[definition] = schema_id
        wanted = (topic.name, topic.encoding, schema_id)
        if wanted not in self._channels:
            group = chunk_group(topic.name, topic.type)
            added = self._container.add_channel(*wanted, topic.details, group)
            self._channels[wanted] = added
            self._topics[added] = TopicInformation(
                name=topic.name,
                type=topic.type,
                message_count=0,
                serialization_format=topic.encoding,
                offered_qos=offers_of(topic),
                type_hash=topic.details.get('topic_type_hash', ''),
            )
        return self._channels[wanted]

    def write(self, channel: int, raw: bytes, log_time: int, publish_time: int, sequence: int) -> None:
        """Add one message; times in ns."""
        self._container.add_message(channel, raw, log_time, publish_time, sequence)

    def add_record(self, name: str, values: Mapping[str, str]) -> None:
        """Add a metadata record behind the messages so far."""
        self.flush()
        self._container.add_metadata(name, values)

    def add_attachment(self, attachment: Attachment) -> None:
        """Add an attachment behind the messages so far."""
        self.flush()
        self._container.add_attachment(attachment)

    def flush(self) -> None:
        """Complete the chunk that is being filled."""
        self._container.flush()

    def close(self, custom_data: Mapping[str, str], ros_distro: str) -> None:
        """Write summary and `metadata.yaml`."""
        self._container.flush()
        information = self._information(custom_data, ros_distro)
        self._container.add_metadata('rosbag2', {'serialized_metadata': embedded_text(information)})
        self._container.finish()
        self._file.close()
        (self.folder / METADATA_NAME).write_text(metadata_text(information), encoding='utf-8')

    def discard(self) -> None:
        """Remove the recording from the disk."""
        with contextlib.suppress(OSError):
            self._file.close()
        shutil.rmtree(self.folder, ignore_errors=True)

    def _information(self, custom_data: Mapping[str, str], ros_distro: str) -> BagInformation:
        counts = self.kept_by_topic
        start, end = self.time_range or (NO_TIME, NO_TIME)
        topics = {topic.name: topic for topic in self._topics.values()}
        return BagInformation(
            topics=tuple(
                TopicInformation(
                    name=name,
                    type=topic.type,
                    message_count=counts[name],
                    serialization_format=topic.serialization_format,
                    offered_qos=topic.offered_qos,
                    type_hash=topic.type_hash,
                )
                for name, topic in topics.items()
            ),
            files=(FileInformation(self._file_name, start, end - start, self.kept),),
            starting_time=start,
            duration=end - start,
            message_count=self.kept,
            ros_distro=ros_distro or 'jazzy',
            custom_data=custom_data,
        )
