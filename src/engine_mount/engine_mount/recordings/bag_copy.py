"""A recording made of others: messages, schemas and channels as they were, and what their recorders lost.

Each original recording is a source of losses of its own, told apart by the record of its recorder and by its
times. So pieces of one recording that are put together count its losses once, those of different ones add up.
"""

import contextlib
import hashlib
import os
import shutil
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from types import TracebackType

import numpy as np
import yaml

from engine_mount.recordings.mcap_file import ACCOUNTS
from engine_mount.recordings.mcap_records import StoredTopic
from engine_mount.recordings.metadata import read_statement, readable_qos
from engine_mount.recordings.recording import Recording
from engine_mount.recordings.series import Payloads
from mount_models.plain_yaml import plain_yaml
from mount_recorder.bag_writer import LIBRARY, create_folder, file_entry
from mount_recorder.losses import RECORDER_RECORD, Reception, loss_statement
from mount_recorder.mcap_writer import LONG_CHUNK_SIZE, McapWriter
from mount_recorder.metadata import METADATA_NAME, TopicEntry, bag_description, embedded_record, metadata_text
from mount_recorder.topic_groups import topic_group

_SOURCES = 'sources'  # key in the record of the recorder

Sources = dict[str, dict[str, list[int]]]
"""{source: {topic: counts of messages that were received, lost since, and missing before}}."""


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
    """One recording of one file, made of messages of others; types need not be installed.

    A context that ends with an error leaves nothing behind. Raises `RecordingError` where the folder exists.
    """

    def __init__(self, folder: str | os.PathLike[str], chunk_size: int = LONG_CHUNK_SIZE):
        self.folder = Path(folder)
        self._file_name = f'{self.folder.name}_0.mcap'
        self._schemas: dict[tuple[str, str, bytes], int] = {}
        self._channels: dict[tuple[str, str, int], int] = {}
        self._topics: dict[int, StoredTopic] = {}  # by channel
        self.notes: list[str] = []
        """What was not copied, in sentences."""
        create_folder(self.folder)
        self._file = McapWriter(self.folder / self._file_name, LIBRARY, chunk_size)
        self.write = self._file.add_message
        """Adds one message: channel, bytes, log time, publish time (ns), sequence."""

    def __enter__(self) -> 'BagCopy':
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        if kind is not None:
            with contextlib.suppress(OSError):
                self._file.file.close()
            shutil.rmtree(self.folder, ignore_errors=True)

    @property
    def added(self) -> int:
        """How many messages were added."""
        return sum(self._file.message_counts.values()) + self._file.pending

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
            group = topic_group(topic.name, topic.type)
            self._channels[wanted] = self._file.add_channel(*wanted, topic.details, group)
            self._topics[self._channels[wanted]] = topic
        return self._channels[wanted]

    def add(self, parts: Sequence[Messages]) -> None:
        """Add messages by their log times."""
        channels = [self.channel_of(part.topic) for part in parts]
        heads = [part.heads[['log_time', 'publish_time', 'sequence']].tolist() for part in parts]
        numbers = np.repeat(np.arange(len(parts)), [len(part) for part in parts])
        places = np.concatenate([np.arange(0), *(np.arange(len(part)) for part in parts)])
        times = np.concatenate([np.zeros(0, np.int64), *(part.heads['log_time'] for part in parts)])
        order = np.argsort(times, kind='stable')
        for number, place in zip(numbers[order].tolist(), places[order].tolist(), strict=True):
            self.write(channels[number], parts[number].payloads[place], *heads[number][place])

    def complete(
        self,
        recordings: Sequence[Recording],
        read: Sequence[Mapping[str, int]] | None,
        custom_data: Mapping[str, str],
    ) -> None:
        """Add the metadata of `recordings`, each once, and their losses; write the end.

        `read` are how many messages of each topic could be read of each recording; None: all that were added.
        """
        self._file.flush()
        copied: list[tuple[str, dict[str, str]]] = []
        for file in (file for recording in recordings for file in recording.files):
            for record in file.records:
                if record[0] not in ACCOUNTS and record not in copied:
                    copied.append(record)
                    self._file.add_metadata(*record)
            if file.attachments:
                self.notes.append(
                    f'{file.attachments} attachments are not copied: '
                    f'mcap get attachment {file.path.name} has them'
                )
        counts = {topic.name: 0 for topic in self._topics.values()}
        for number, topic in self._topics.items():
            counts[topic.name] += self._file.message_counts.get(number, 0)
        sources: Sources = {}
        for recording, own in zip(recordings, read or [counts] * len(recordings), strict=True):
            sources |= _sources_of(recording, own)
        if sources:
            self._file.add_metadata(RECORDER_RECORD, _inherited_statement(sources, counts))
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
        distros = [recording.information.ros_distro for recording in recordings if recording.information]
        description = bag_description(
            topics.values(),
            [file_entry(self._file_name, self._file)],
            custom_data,
            next(filter(None, distros), 'jazzy'),
        )
        self._file.finish(embedded_record(description))
        (self.folder / METADATA_NAME).write_text(metadata_text(description), encoding='utf-8')


# Losses that recorders stated.


def _sources_of(recording: Recording, read: Mapping[str, int]) -> Sources:
    """Return the sources of a recording of which `read` messages of each topic could be read."""
    records = [file.metadata[RECORDER_RECORD] for file in recording.files if RECORDER_RECORD in file.metadata]
    record = records[-1] if records else {}
    inherited: Sources = {}
    with contextlib.suppress(KeyError, TypeError, ValueError, AttributeError, OverflowError):
        inherited = {
            str(identity): {str(name): list(map(int, counts)) for name, counts in topics.items()}
            for identity, topics in plain_yaml(record[_SOURCES]).items()
        }
    own = {}
    for name, row in read_statement(record).items():
        unread = max(0, row.get('kept', 0) - read.get(name, 0))
        if not inherited:
            own[name] = [row.get('received', 0), row.get('lost', 0) + unread, row.get('missing', 0)]
        elif unread:
            own[name] = [0, unread, 0]
    identity = hashlib.sha256(f'{record.get("topics")} {recording.time_range}'.encode()).hexdigest()[:16]
    return {**inherited, identity: own} if own else inherited


def _inherited_statement(sources: Sources, kept: Mapping[str, int]) -> dict[str, str]:
    """Return the recorder's record of a recording made of `sources` that holds `kept` messages by topic."""
    total: dict[str, Reception] = {}
    for topics in sources.values():
        for name, (received, overflowed, missing) in topics.items():
            entry = total.setdefault(name, Reception())
            entry.received += received
            entry.overflowed += overflowed
            entry.missing += missing
    statement = loss_statement(total, {name: kept.get(name, 0) for name in total}, excerpt=True)
    return {**statement, _SOURCES: yaml.safe_dump(sources, sort_keys=False)}
