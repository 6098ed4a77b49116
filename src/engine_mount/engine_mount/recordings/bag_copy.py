"""A recording made of others: messages, schemas and channels as they were, and what their recorders lost.

Each original recording is a source of losses of its own, told apart by what its recorder said and when it was
made. So pieces of one recording that are put together count its losses once, those of different ones add up.
"""

import contextlib
import hashlib
import os
import shutil
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from types import TracebackType

import numpy as np
import yaml
from mcap.records import Attachment
from numpy.typing import NDArray

from engine_mount.recordings.metadata import TopicInformation, read_statement
from engine_mount.recordings.pieces import offers_of
from engine_mount.recordings.recording import Recording, open_recording
from engine_mount.recordings.series import Payloads, Times
from engine_mount.recordings.stored import ACCOUNTS, StoredTopic
from mount_models.plain_yaml import plain_yaml
from mount_recorder.bag_writer import LIBRARY, create_folder, file_entry
from mount_recorder.losses import RECORDER_RECORD, Reception, loss_statement
from mount_recorder.mcap_writer import LONG_CHUNK_SIZE, McapWriter
from mount_recorder.metadata import METADATA_NAME, TopicEntry, bag_description, embedded_record, metadata_text
from mount_recorder.topic_groups import topic_group

_LARGE = 500_000  # messages, chosen: about 100 MB
_SOURCES = 'sources'  # key in the record of the recorder

Sources = dict[str, dict[str, Reception]]
"""{source: {topic: what its recorder received and lost, and what could not be read of it later}}."""


@dataclass(frozen=True)
class Messages:
    """Messages of one topic in the order of their log times (ns).

    `declared` is what their file says of them; None only where there are none.
    """

    topic: TopicInformation
    declared: StoredTopic | None
    log_times: Times
    publish_times: Times
    sequences: NDArray[np.uint32]
    payloads: Payloads

    def __len__(self) -> int:
        return len(self.log_times)

    def chosen(self, places: NDArray[np.int64]) -> 'Messages':
        """Return the messages at `places`."""
        return replace(
            self,
            log_times=self.log_times[places],
            publish_times=self.publish_times[places],
            sequences=self.sequences[places],
            payloads=self.payloads.chosen(places),
        )

    def ordered(self) -> 'Messages':
        """Return the messages in the order of their log times."""
        return self.chosen(np.argsort(self.log_times, kind='stable'))


def joined(topic: TopicInformation, parts: Sequence[Messages]) -> Messages:
    """Return the messages of several parts, of which there is one at least, in the order of log times."""
    return Messages(
        topic,
        next((part.declared for part in parts if part.declared), None),
        np.concatenate([part.log_times for part in parts]),
        np.concatenate([part.publish_times for part in parts]),
        np.concatenate([part.sequences for part in parts]),
        Payloads([part.payloads.messages for part in parts if len(part)]),
    ).ordered()


def read_messages(recording: Recording, name: str) -> tuple[Messages, list[str]]:
    """Return all messages of the topic `name` and what was found damaged on the way.

    A large recording is opened anew, so that the memory holds one topic at a time.
    """
    known = list(recording.warnings)
    source = open_recording(recording.path) if recording.message_count > _LARGE else recording
    topics = (topic for file in recording.files for topic in file.topics.values())
    declared = next((topic for topic in topics if topic.name == name), None)
    series = source[name]
    columns = series.receive_times, series.publish_times, series.sequences
    messages = Messages(recording.topics[name], declared, *columns, series.payloads).ordered()
    return messages, [warning for warning in source.warnings if warning not in known]


def in_log_order(parts: Sequence[Messages]) -> Iterable[tuple[int, int]]:
    """Return (number of the part, place in it) of all messages, sorted by log time, then by part."""
    numbers = np.repeat(np.arange(len(parts)), [len(part) for part in parts])
    places = np.concatenate([np.arange(0), *(np.arange(len(part)) for part in parts)])
    order = np.argsort(np.concatenate([np.zeros(0), *(part.log_times for part in parts)]), kind='stable')
    return zip(numbers[order].tolist(), places[order].tolist(), strict=True)


class BagCopy:
    """One recording of one file, made of messages of others; types need not be installed.

    A context that ends with an error leaves nothing behind. Raises `RecordingError` where the folder exists.
    """

    def __init__(self, folder: str | os.PathLike[str]):
        self.folder = Path(folder)
        self._file_name = f'{self.folder.name}_0.mcap'
        self._schemas: dict[tuple[str, str, bytes], int] = {}
        self._channels: dict[tuple[str, str, int], int] = {}
        self._topics: dict[int, StoredTopic] = {}  # by channel
        create_folder(self.folder)
        self._file = McapWriter(self.folder / self._file_name, LIBRARY, LONG_CHUNK_SIZE)
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
    def time_range(self) -> tuple[int, int]:
        """The first and the last log time in ns, 0 without messages."""
        return self._file.start_time or 0, self._file.end_time or 0

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
        channels = [self.channel_of(part.declared) if part.declared else 0 for part in parts]
        for number, place in in_log_order(parts):
            part = parts[number]
            times = int(part.log_times[place]), int(part.publish_times[place])
            self.write(channels[number], part.payloads[place], *times, int(part.sequences[place]))

    def complete(
        self,
        recordings: Sequence[Recording],
        read: Sequence[Mapping[str, int]] | None,
        custom_data: Mapping[str, str],
    ) -> None:
        """Add what stands beside the messages of `recordings`, and their losses; write the end.

        `read` are how many messages of each topic could be read of each recording; None: all that were added.
        """
        self._file.flush()
        self._copy_beside_messages(recordings)
        counts = {topic.name: 0 for topic in self._topics.values()}
        for number, topic in self._topics.items():
            counts[topic.name] += self._file.message_counts.get(number, 0)
        sources: Sources = {}
        for recording, own in zip(recordings, read or [counts] * len(recordings), strict=True):
            sources |= _sources_of(recording, own)
        if sources:
            self._file.add_metadata(RECORDER_RECORD, _inherited_statement(sources, counts))
        topics = {topic.name: _entry(topic, counts[topic.name]) for topic in self._topics.values()}
        distros = [recording.information.ros_distro for recording in recordings if recording.information]
        description = bag_description(
            topics.values(),
            [file_entry(self._file_name, self._file)],
            custom_data,
            next(filter(None, distros), 'jazzy'),
        )
        self._file.finish(embedded_record(description))
        (self.folder / METADATA_NAME).write_text(metadata_text(description), encoding='utf-8')

    def _copy_beside_messages(self, recordings: Sequence[Recording]) -> None:
        """Copy attachments, and records that are no account of a recording; what is equal once."""
        records: list[tuple[str, dict[str, str]]] = []
        attached: list[Attachment] = []
        for file in (file for recording in recordings for file in recording.files):
            for entry in file.records:
                if entry[0] not in ACCOUNTS and entry not in records:
                    records.append(entry)
                    self._file.add_metadata(*entry)
            for attachment in file.attachments():
                if attachment not in attached:
                    attached.append(attachment)
                    self._file.add_attachment(attachment)


def _entry(topic: StoredTopic, count: int) -> TopicEntry:
    return TopicEntry(
        name=topic.name,
        type=topic.type,
        message_count=count,
        offered_qos=offers_of(topic),
        type_hash=topic.details.get('topic_type_hash', ''),
        encoding=topic.encoding,
    )


# What recorders said of their losses.


def _sources_of(recording: Recording, read: Mapping[str, int]) -> Sources:
    """Return the sources of a recording of which `read` messages of each topic could be read."""
    records = [file.metadata[RECORDER_RECORD] for file in recording.files if RECORDER_RECORD in file.metadata]
    record = records[-1] if records else {}
    rows, inherited = read_statement(record), _inherited(record)
    unread = {name: max(0, row.get('kept', 0) - read.get(name, 0)) for name, row in rows.items()}
    if inherited:
        own = {name: Reception(overflowed=count) for name, count in unread.items() if count}
    else:
        own = {
            name: Reception(row.get('received', 0), row.get('lost', 0) + unread[name], row.get('missing', 0))
            for name, row in rows.items()
        }
    text = f'{record.get("topics")} {recording.time_range}'
    identity = hashlib.sha256(text.encode()).hexdigest()[:16]
    return {**inherited, identity: own} if own else inherited


def _inherited(record: Mapping[str, str]) -> Sources:
    try:
        return {
            str(identity): {str(name): Reception(*map(int, counts)) for name, counts in topics.items()}
            for identity, topics in plain_yaml(record[_SOURCES]).items()
        }
    except (KeyError, TypeError, ValueError, AttributeError, OverflowError):
        return {}


def _inherited_statement(sources: Sources, kept: Mapping[str, int]) -> dict[str, str]:
    """Return the recorder's record of a recording made of `sources` that holds `kept` messages by topic."""
    total: dict[str, Reception] = {}
    rows: dict[str, dict[str, list[int]]] = {}
    for identity, topics in sources.items():
        for name, each in topics.items():
            rows.setdefault(identity, {})[name] = [each.received, each.overflowed, each.missing]
            entry = total.setdefault(name, Reception())
            entry.received += each.received
            entry.overflowed += each.overflowed
            entry.missing += each.missing
    counts = {name: kept.get(name, 0) for name in total}
    return {
        **loss_statement(total, counts, excerpt=True),
        _SOURCES: yaml.safe_dump(rows, sort_keys=False),
    }
