"""What a recording says of itself: its description, quality of service, losses of its recorder."""

import functools
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

from mount_models.plain_yaml import plain_yaml
from mount_recorder.metadata import NANOSECONDS, NO_TIME, ROOT, VERSION, OfferedQos


class MetadataError(ValueError):
    """A description of a recording is not understood."""


@dataclass(frozen=True)
class TopicInformation:
    """One topic of a recording."""

    name: str
    type: str
    message_count: int
    serialization_format: str = 'cdr'
    offered_qos: tuple[OfferedQos, ...] = ()
    type_hash: str = ''
    units: Mapping[str, str] = field(default_factory=dict)  # by field, where the channel tells them


@dataclass(frozen=True)
class FileInformation:
    """One file of a recording; times in ns."""

    path: str
    starting_time: int = NO_TIME
    duration: int = 0
    message_count: int = 0


@dataclass(frozen=True)
class BagInformation:
    """A whole recording; times in ns."""

    topics: tuple[TopicInformation, ...]
    files: tuple[FileInformation, ...]
    starting_time: int
    duration: int
    message_count: int
    ros_distro: str = ''
    custom_data: Mapping[str, str] = field(default_factory=dict)
    version: int = VERSION
    storage: str = 'mcap'
    compression_format: str = ''
    compression_mode: str = ''


def read_metadata(text: str) -> BagInformation:
    """Return what `metadata.yaml` or a metadata record says; raises `MetadataError`."""
    try:
        document = plain_yaml(text)
        return _bag(document.get(ROOT, document))
    except (KeyError, TypeError, ValueError, AttributeError) as error:
        reason = str(error) or type(error).__name__
        raise MetadataError(f'description of the recording not understood: {reason}') from None


def _bag(document: Any) -> BagInformation:
    paths = [_text(path) for path in document['relative_file_paths']]
    files = [_file(entry) for entry in document.get('files') or ()]
    return BagInformation(
        topics=tuple(_topic(entry) for entry in document['topics_with_message_count'] or ()),
        files=tuple(files) or tuple(FileInformation(path) for path in paths),
        starting_time=_whole(document['starting_time']['nanoseconds_since_epoch']),
        duration=_whole(document['duration']['nanoseconds']),
        message_count=_count(document['message_count']),
        ros_distro=_text(document.get('ros_distro') or ''),
        custom_data={name: str(value) for name, value in (document.get('custom_data') or {}).items()},
        version=_whole(document['version']),
        storage=_text(document['storage_identifier']),
        compression_format=_text(document.get('compression_format') or ''),
        compression_mode=_text(document.get('compression_mode') or ''),
    )


def _file(entry: Any) -> FileInformation:
    return FileInformation(
        path=_text(entry['path']),
        starting_time=_whole(entry['starting_time']['nanoseconds_since_epoch']),
        duration=_whole(entry['duration']['nanoseconds']),
        message_count=_count(entry['message_count']),
    )


def _topic(entry: Any) -> TopicInformation:
    details = entry['topic_metadata']
    try:
        offers = read_qos(details.get('offered_qos_profiles'))
    except QosError:
        offers = ()  # not needed to read the messages
    return TopicInformation(
        name=_text(details['name']),
        type=_text(details['type']),
        message_count=_count(entry['message_count']),
        serialization_format=_text(details['serialization_format']),
        offered_qos=offers,
        type_hash=_text(details.get('type_description_hash') or ''),
    )


def _text(value: Any) -> str:
    if not isinstance(value, str):
        raise TypeError(f'a text is wanted; instead received {value!r:.60}')
    return value


def _whole(value: Any) -> int:
    if type(value) is not int:
        raise TypeError(f'a whole number is wanted; instead received {value!r:.60}')
    return value


def _count(value: Any) -> int:
    if _whole(value) < 0:
        raise ValueError(f'a count must be 0 or more; instead received {value}')
    return int(value)


# The position of a word is its number in rmw/types.h.
_HISTORY = ('system_default', 'keep_last', 'keep_all', 'unknown')
_RELIABILITY = ('system_default', 'reliable', 'best_effort', 'unknown', 'best_available')
_DURABILITY = ('system_default', 'transient_local', 'volatile', 'unknown', 'best_available')
_LIVELINESS = (
    'system_default',
    'automatic',
    'manual_by_node',
    'manual_by_topic',
    'unknown',
    'best_available',
)


class QosError(ValueError):
    """The quality of service in a bag is not understood."""


def read_qos(source: Any) -> tuple[OfferedQos, ...]:
    """Return the offers in `source`: YAML text or the list that it holds; raises `QosError`."""
    try:
        return _offers_in(source) if isinstance(source, str) else _offers(source)
    except (KeyError, TypeError, ValueError, AttributeError, IndexError, OverflowError) as error:
        reason = str(error).splitlines()[0] if str(error) else type(error).__name__
        raise QosError(f'offered quality of service not understood: {reason}') from None


# The topics of a recording, and of many recordings, have the same few texts.
@functools.lru_cache(maxsize=64)
def _offers_in(text: str) -> tuple[OfferedQos, ...]:
    return _offers(plain_yaml(text))


def _offers(documents: Any) -> tuple[OfferedQos, ...]:
    return tuple(_offer(document) for document in documents or ())


def _offer(document: Any) -> OfferedQos:
    return OfferedQos(
        history=_word(document['history'], _HISTORY),
        depth=int(document['depth']),
        reliability=_word(document['reliability'], _RELIABILITY),
        durability=_word(document['durability'], _DURABILITY),
        deadline=_nanoseconds(document['deadline']),
        lifespan=_nanoseconds(document['lifespan']),
        liveliness=_word(document['liveliness'], _LIVELINESS),
        liveliness_lease_duration=_nanoseconds(document['liveliness_lease_duration']),
        avoid_ros_namespace_conventions=bool(document['avoid_ros_namespace_conventions']),
    )


def _word(value: Any, words: tuple[str, ...]) -> str:
    if isinstance(value, int):
        if not 0 <= value < len(words):
            raise ValueError(f'policy {value} is none of {", ".join(words)}')
        return words[value]
    return str(value)


def _nanoseconds(document: Any) -> int:
    return int(document['sec']) * NANOSECONDS + int(document['nsec'])


def read_statement(record: Mapping[str, str]) -> dict[str, dict[str, int]]:
    """Return {topic: {`received`, `kept`, `lost`, `missing`}} of the record; {} if it is not understood."""
    try:
        topics = plain_yaml(record['topics'])
        return {str(name): {key: int(count) for key, count in row.items()} for name, row in topics.items()}
    except (KeyError, TypeError, ValueError, AttributeError, OverflowError):
        return {}
