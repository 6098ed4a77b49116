"""The topics of a recording, put together from its files and its description.

What the files say counts more: there it is under checksums.
"""

from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Protocol

import yaml
from mcap.records import Attachment, Channel, Schema

from mount_bags.bag.metadata import BagInformation, TopicInformation
from mount_bags.bag.offered_qos import OfferedQos, QosError, read_qos
from mount_bags.bag.statement import RECORDER_RECORD
from mount_bags.container.chunks import Contents
from mount_bags.messages.definitions import Definition, DefinitionError, installed_definition, text_definition

# The writer's note at the head of every piece but the first: which latched topics it repeats there.
PIECE_RECORD = 'engine_mount_piece'
# Metadata records in which a recording tells of itself; one that is made of it has its own.
ACCOUNTS = ('rosbag2', RECORDER_RECORD, PIECE_RECORD)


class BagFile(Protocol):
    """One file of a recording, whatever its storage."""

    path: Path
    channels: dict[int, Channel]
    schemas: dict[int, Schema]
    metadata: dict[str, dict[str, str]]  # the last record of each name
    records: list[tuple[str, dict[str, str]]]  # all of them
    warnings: list[str]
    lost_beside: list[str]  # names of metadata and attachments that are known to be lost

    @property
    def whole(self) -> bool: ...
    @property
    def damaged(self) -> bool: ...
    @property
    def proven(self) -> bool: ...
    def topic_type(self, channel: int) -> str: ...
    def message_counts(self) -> dict[int, int]: ...
    def time_range(self) -> tuple[int, int] | None: ...
    def blocks(self, channels: Collection[int]) -> Iterator[Contents]: ...
    def attachments(self) -> Iterator[Attachment]: ...


@dataclass
class Declared:
    """A topic as the files declare it: counted without repetitions, `stored` with them."""

    information: TopicInformation
    stored: int = 0
    schema: Schema | None = None
    other_types: tuple[str, ...] = ()
    channels: list[tuple[BagFile, int]] = field(default_factory=list)

    def channels_of(self, file: BagFile) -> list[int]:
        """Return the topic's channels in one of the files."""
        return [number for owner, number in self.channels if owner is file]


def declared_topics(files: Sequence[BagFile], information: BagInformation | None) -> dict[str, Declared]:
    """Return the topics by name, those of the description first and in its order."""
    described = information.topics if information else ()
    topics = {topic.name: Declared(replace(topic, message_count=0)) for topic in described}
    for file, repeated in zip(files, repeated_topics(files), strict=True):
        counts = file.message_counts()
        seen: set[str] = set()
        for number, channel in file.channels.items():
            count = counts.get(number, 0)
            repetition = int(channel.topic in repeated and channel.topic not in seen and count > 0)
            seen |= {channel.topic} if count else set()
            declared = topics.setdefault(channel.topic, Declared(_information(file, number, None)))
            _add(declared, file, number, count, repetition)
    return topics


def repeated_topics(files: Sequence[BagFile]) -> list[frozenset[str]]:
    """Return for each file the topics that it repeats from the files before it, which are here."""
    return [_noted(file) if place else frozenset() for place, file in enumerate(files)]


def readable_definition(declared: Declared) -> tuple[Definition | None, str]:
    """Return the definition of a topic's messages, and a sentence where that of the recording is no use."""
    topic, schema = declared.information, declared.schema
    if topic.serialization_format != 'cdr':
        return None, f'its messages are encoded as {topic.serialization_format!r}, not as cdr'
    if schema is None or not schema.data.strip():
        definition = _installed(topic.type)
        missing = f'type {topic.type!r} is not installed and the recording does not define it'
        return definition, '' if definition else missing
    if schema.encoding != 'ros2msg':
        reason = f'its definition is written in {schema.encoding!r}, not in ros2msg'
    else:
        try:
            return text_definition(topic.type, schema.data.decode()), ''
        except (DefinitionError, UnicodeDecodeError) as error:
            reason = f'the definition of {topic.type} in the recording is not readable ({error})'
    definition = _installed(topic.type)
    return definition, reason if definition else f'{reason}, and the type is not installed'


def _installed(type_name: str) -> Definition | None:
    try:
        return installed_definition(type_name)
    except ValueError:
        return None


def _add(declared: Declared, file: BagFile, number: int, count: int, repetition: int) -> None:
    found = _information(file, number, declared.information)
    if not declared.channels:
        declared.information = replace(found, message_count=0)
        declared.schema = file.schemas.get(file.channels[number].schema_id)
    elif found.type != declared.information.type:
        declared.other_types = tuple(dict.fromkeys((*declared.other_types, found.type)))
        return
    declared.channels.append((file, number))
    declared.stored += count
    total = declared.information.message_count + count - repetition
    declared.information = replace(declared.information, message_count=total)


def _information(file: BagFile, number: int, known: TopicInformation | None) -> TopicInformation:
    channel: Channel = file.channels[number]
    offers = _offers(channel.metadata)
    return TopicInformation(
        name=channel.topic,
        type=file.topic_type(number) or (known.type if known else ''),
        message_count=0,
        serialization_format=channel.message_encoding,
        offered_qos=offers or (known.offered_qos if known else ()),
        type_hash=channel.metadata.get('topic_type_hash', '') or (known.type_hash if known else ''),
    )


def _offers(metadata: Mapping[str, str]) -> tuple[OfferedQos, ...]:
    try:
        return read_qos(metadata.get('offered_qos_profiles', ''))
    except QosError:
        return ()  # not needed to read the messages


def _noted(file: BagFile) -> frozenset[str]:
    try:
        names = yaml.safe_load(file.metadata.get(PIECE_RECORD, {}).get('repeated', '[]'))
        return frozenset(map(str, names))
    except (yaml.YAMLError, TypeError):
        return frozenset()
