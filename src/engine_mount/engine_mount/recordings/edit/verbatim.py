"""A recording written with the declarations of another: its messages, schemas and channels as they were."""

import contextlib
import os
import shutil
from collections.abc import Iterable, Mapping
from pathlib import Path

from mcap.records import Attachment

from engine_mount.recordings.pieces import offers_of
from engine_mount.recordings.recording import Recording
from engine_mount.recordings.stored import ACCOUNTS, StoredTopic
from mount_recorder.bag_writer import LIBRARY, create_folder, file_entry
from mount_recorder.mcap_writer import LONG_CHUNK_SIZE, McapWriter
from mount_recorder.metadata import METADATA_NAME, TopicEntry, bag_description, embedded_record, metadata_text
from mount_recorder.topic_groups import topic_group


class VerbatimBag:
    """One recording of one file; types need not be installed. Raises `RecordingError` where one exists."""

    def __init__(self, folder: str | os.PathLike[str]):
        self.folder = Path(folder)
        self._file_name = f'{self.folder.name}_0.mcap'
        self._schemas: dict[tuple[str, str, bytes], int] = {}
        self._channels: dict[tuple[str, str, int], int] = {}
        self._topics: dict[int, StoredTopic] = {}  # by channel
        create_folder(self.folder)
        self._container = McapWriter(self.folder / self._file_name, LIBRARY, LONG_CHUNK_SIZE)

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
            group = topic_group(topic.name, topic.type)
            added = self._container.add_channel(*wanted, topic.details, group)
            self._channels[wanted] = added
            self._topics[added] = topic
        return self._channels[wanted]

    def write(self, channel: int, raw: bytes, log_time: int, publish_time: int, sequence: int) -> None:
        """Add one message; times in ns."""
        self._container.add_message(channel, raw, log_time, publish_time, sequence)

    def add_record(self, name: str, values: Mapping[str, str]) -> None:
        """Add a metadata record behind the messages so far."""
        self.flush()
        self._container.add_metadata(name, values)

    def copy_beside_messages(self, recordings: Iterable[Recording]) -> None:
        """Copy attachments, and records that are no account of a recording; what is equal once."""
        records: list[tuple[str, dict[str, str]]] = []
        attached: list[Attachment] = []
        for file in (file for recording in recordings for file in recording.files):
            for entry in file.records:
                if entry[0] not in ACCOUNTS and entry not in records:
                    records.append(entry)
                    self.add_record(*entry)
            for attachment in file.attachments():
                if attachment not in attached:
                    attached.append(attachment)
                    self.flush()
                    self._container.add_attachment(attachment)

    def flush(self) -> None:
        """Complete the chunk that is being filled."""
        self._container.flush()

    def close(self, custom_data: Mapping[str, str], ros_distro: str) -> None:
        """Write summary and `metadata.yaml`."""
        self._container.flush()
        topics = {topic.name: self._entry(topic) for topic in self._topics.values()}
        files = [file_entry(self._file_name, self._container)]
        description = bag_description(topics.values(), files, custom_data, ros_distro or 'jazzy')
        self._container.finish(embedded_record(description))
        (self.folder / METADATA_NAME).write_text(metadata_text(description), encoding='utf-8')

    def discard(self) -> None:
        """Remove the recording from the disk."""
        with contextlib.suppress(OSError):
            self._container.file.close()
        shutil.rmtree(self.folder, ignore_errors=True)

    def _entry(self, topic: StoredTopic) -> TopicEntry:
        return TopicEntry(
            name=topic.name,
            type=topic.type,
            message_count=self.kept_by_topic[topic.name],
            offered_qos=offers_of(topic),
            type_hash=topic.details.get('topic_type_hash', ''),
            encoding=topic.encoding,
        )
