"""The topics of a recording, put together from its files and its description.

What the files say counts more: there it is under checksums.
"""

from collections.abc import Sequence
from dataclasses import dataclass, field, replace

from engine_mount.recordings.bag.metadata import BagInformation, QosError, TopicInformation, read_qos
from engine_mount.recordings.bag.told_units import units_in
from engine_mount.recordings.container.stored import StoredFile, StoredTopic
from engine_mount.recordings.messages.definitions import (
    Definition,
    DefinitionError,
    installed_definition,
    text_definition,
)
from mount_models.plain_yaml import YamlError, plain_yaml
from mount_recorder.bag_writer import PIECE_RECORD
from mount_recorder.metadata import OfferedQos


@dataclass
class Declared:
    """A topic as the files declare it: counted without repetitions, `stored` with them."""

    information: TopicInformation
    stored: int = 0
    definition: bytes = b''
    definition_encoding: str = ''
    other_types: tuple[str, ...] = ()
    places: list[tuple[StoredFile, int]] = field(default_factory=list)

    def numbers_in(self, file: StoredFile) -> list[int]:
        """Return the topic's numbers in one of the files."""
        return [number for owner, number in self.places if owner is file]


def declared_topics(files: Sequence[StoredFile], information: BagInformation | None) -> dict[str, Declared]:
    """Return the topics by name, those of the description first and in its order."""
    described = information.topics if information else ()
    topics = {topic.name: Declared(replace(topic, message_count=0)) for topic in described}
    for file, repeated in zip(files, repeated_topics(files), strict=True):
        counts = file.message_counts()
        seen: set[str] = set()
        for number, topic in file.topics.items():
            count = counts.get(number, 0)
            repetition = int(topic.name in repeated and topic.name not in seen and count > 0)
            seen |= {topic.name} if count else set()
            declared = topics.setdefault(topic.name, Declared(_information(topic, None)))
            _add(declared, file, number, count, repetition)
    return topics


def repeated_topics(files: Sequence[StoredFile]) -> list[frozenset[str]]:
    """Return for each file the topics that it repeats from the files before it, which are here."""
    return [_noted(file) if place else frozenset() for place, file in enumerate(files)]


def readable_definition(declared: Declared) -> tuple[Definition | None, str]:
    """Return the definition of a topic's messages, and a sentence where that of the recording is no use."""
    topic = declared.information
    if topic.serialization_format != 'cdr':
        return None, f'its messages are encoded as {topic.serialization_format!r}, not as cdr'
    if not declared.definition.strip():
        definition = _installed(topic.type)
        missing = f'type {topic.type!r} is not installed and the recording does not define it'
        return definition, '' if definition else missing
    if declared.definition_encoding != 'ros2msg':
        reason = f'its definition is written in {declared.definition_encoding!r}, not in ros2msg'
    else:
        try:
            return text_definition(topic.type, declared.definition.decode()), ''
        except (DefinitionError, UnicodeDecodeError) as error:
            reason = f'the definition of {topic.type} in the recording is not readable ({error})'
    definition = _installed(topic.type)
    return definition, reason if definition else f'{reason}, and the type is not installed'


def _installed(type_name: str) -> Definition | None:
    try:
        return installed_definition(type_name)
    except ValueError:
        return None


def _add(declared: Declared, file: StoredFile, number: int, count: int, repetition: int) -> None:
    topic = file.topics[number]
    found = _information(topic, declared.information)
    if not declared.places:
        declared.information = replace(found, message_count=0)
        declared.definition, declared.definition_encoding = topic.definition, topic.definition_encoding
    elif found.type != declared.information.type:
        declared.other_types = tuple(dict.fromkeys((*declared.other_types, found.type)))
        return
    declared.places.append((file, number))
    declared.stored += count
    total = declared.information.message_count + count - repetition
    declared.information = replace(declared.information, message_count=total)


def _information(topic: StoredTopic, known: TopicInformation | None) -> TopicInformation:
    offers = offers_of(topic)
    return TopicInformation(
        name=topic.name,
        type=topic.type or (known.type if known else ''),
        message_count=0,
        serialization_format=topic.encoding,
        offered_qos=offers or (known.offered_qos if known else ()),
        type_hash=topic.details.get('topic_type_hash', '') or (known.type_hash if known else ''),
        units=units_in(topic.details) or (known.units if known else {}),
    )


def offers_of(topic: StoredTopic) -> tuple[OfferedQos, ...]:
    """Return the quality of service of a topic's publishers, none where it is not understood."""
    try:
        return read_qos(topic.details.get('offered_qos_profiles', ''))
    except QosError:
        return ()  # not needed to read the messages


def _noted(file: StoredFile) -> frozenset[str]:
    try:
        names = plain_yaml(file.metadata.get(PIECE_RECORD, {}).get('repeated', '[]'))
        return frozenset(map(str, names))
    except (YamlError, TypeError):
        return frozenset()
