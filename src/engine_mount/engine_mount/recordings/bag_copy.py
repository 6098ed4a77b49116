"""A recording made of another: messages, schemas and channels as they were, and what its recorder lost."""

import contextlib
import os
import shutil
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from engine_mount.recordings.mcap_file import ACCOUNTS
from engine_mount.recordings.mcap_records import StoredTopic
from engine_mount.recordings.metadata import read_statement, readable_qos
from engine_mount.recordings.recording import Recording
from engine_mount.recordings.series import Payloads
from mount_recorder.bag_writer import LIBRARY, create_folder
from mount_recorder.losses import RECORDER_RECORD, Reception, loss_statement
from mount_recorder.mcap_writer import LONG_CHUNK_SIZE, McapWriter
from mount_recorder.metadata import METADATA_NAME, TopicEntry, bag_description, embedded_record, metadata_text


@dataclass(frozen=True)
class Messages:
    """Messages of one topic in the order of their log times; `heads` have the dtype `HEAD` of a file."""

    topic: StoredTopic
    heads: np.ndarray
    payloads: Payloads

    def __len__(self) -> int:
        return len(self.heads)

    def at(self, places: np.ndarray) -> 'Messages':
        """Return the messages at `places`."""
        return Messages(self.topic, self.heads[places], self.payloads.at(places))


def read_messages(recording: Recording, name: str) -> Messages | None:
    """Return all messages of the topic `name`, None of one that only the description names.

    What the recording holds in memory is released, so that of a long one there is one topic at a time.
    """
    stored = recording.topics[name].stored
    if stored is None:
        return None
    series = recording[name]
    found = Messages(stored, series.heads, series.payloads)
    recording.release()
    return found.at(np.argsort(found.heads['log_time'], kind='stable'))


class BagCopy:
    """One recording of one file, made of messages of another; types need not be installed.

    A context that ends with an error leaves nothing behind. Raises `RecordingError` where the folder exists.
    """

    def __init__(self, folder: str | os.PathLike[str], chunk_size: int = LONG_CHUNK_SIZE):
        self.folder = Path(folder)
        self._schemas: dict[tuple[str, str, bytes], int] = {}
        self._channels: dict[tuple[str, str, int], int] = {}
        self._topics: dict[int, StoredTopic] = {}  # by channel
        create_folder(self.folder)
        self._file = McapWriter(self.folder / f'{self.folder.name}_0.mcap', LIBRARY, chunk_size)
        self.write = self._file.add_message
        """Adds one message: channel, bytes, log time, publish time (ns), sequence."""

    def __enter__(self) -> 'BagCopy':
        return self

    def __exit__(self, kind: type[BaseException] | None, *_: Any) -> None:
        if kind is not None:
            with contextlib.suppress(OSError):
                self._file.file.close()
            shutil.rmtree(self.folder, ignore_errors=True)

    @property
    def added(self) -> int:
        """How many messages were added."""
        return self._file.message_counts.total() + self._file.pending

    @property
    def seconds(self) -> float:
        """The time from the first to the last message, s."""
        return ((self._file.end_time or 0) - (self._file.start_time or 0)) / 1e9

    def channel_of(self, topic: StoredTopic) -> int:
        """Declare a topic of another file and return the number of its channel; equal ones share it."""
        definition = (topic.type, topic.definition_encoding, topic.definition)
        if definition not in self._schemas:
            self._schemas[definition] = self._file.add_schema(*definition)
        wanted = (topic.name, topic.encoding, self._schemas[definition])
        if wanted not in self._channels:
            self._channels[wanted] = self._file.add_channel(*wanted, topic.details)
            self._topics[self._channels[wanted]] = topic
        return self._channels[wanted]

    def add(self, parts: Sequence[Messages]) -> None:
        """Add messages by their log times."""
        channels = [self.channel_of(part.topic) for part in parts]
        heads = [part.heads[['log_time', 'publish_time', 'sequence']].tolist() for part in parts]
        order = sorted(
            (head[0], number, place) for number, rows in enumerate(heads) for place, head in enumerate(rows)
        )
        for _, number, place in order:
            self.write(channels[number], parts[number].payloads[place], *heads[number][place])

    def complete(
        self,
        recording: Recording | None = None,
        custom_data: Mapping[str, str] | None = None,
        read: Mapping[str, int] | None = None,
    ) -> None:
        """Add the metadata of `recording` and its losses; write the end.

        `read` are how many messages of each topic could be read of it; None: all that were added.
        """
        self._file.flush()
        counts = {topic.name: 0 for topic in self._topics.values()}
        for number, topic in self._topics.items():
            counts[topic.name] += self._file.message_counts[number]
        for file in recording.files if recording else ():
            for name, values in file.records:
                if name not in ACCOUNTS:
                    self._file.add_metadata(name, values)
            if statement := read_statement(file.metadata.get(RECORDER_RECORD, {})):
                losses = _losses(statement, counts if read is None else read)
                self._file.add_metadata(RECORDER_RECORD, loss_statement(losses, counts, excerpt=True))
        topics = {
            topic.name: TopicEntry(
                name=topic.name,
                type=topic.type,
                message_count=counts[topic.name],
                offered_qos=readable_qos(topic.details.get('offered_qos_profiles', '')),
                type_hash=topic.details.get('topic_type_hash', ''),
                encoding=topic.encoding,
            )
            for topic in self._topics.values()
        }
        distro = recording.information.ros_distro if recording and recording.information else ''
        description = bag_description(topics.values(), [self._file], distro or 'jazzy', custom_data)
        self._file.finish(embedded_record(description))
        (self.folder / METADATA_NAME).write_text(metadata_text(description), encoding='utf-8')


def _losses(statement: Mapping[str, Mapping[str, int]], read: Mapping[str, int]) -> dict[str, Reception]:
    """Return what a recorder stated, and as lost what it kept and is not among the messages `read`."""
    return {
        name: Reception(
            row.get('received', 0),
            row.get('lost', 0) + max(0, row.get('kept', 0) - read.get(name, 0)),
            row.get('missing', 0),
        )
        for name, row in statement.items()
    }
