"""The description of a recording: topics, quality of service, units, losses of its recorder, its origin."""

import functools
import json
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from enum import Enum
from typing import Any, TypeVar

import yaml
from rosbags.interfaces import QosTime
from rosbags.rosbag2.metadata import parse_qos

from engine_mount.recordings.mcap_records import StoredTopic
from mount_models.plain_yaml import YamlError, plain_yaml
from mount_recorder.metadata import NANOSECONDS, ROOT, VERSION, OfferedQos

T = TypeVar('T')


class MetadataError(ValueError):
    """A description of a recording is not understood."""


@dataclass
class TopicInformation:
    """One topic of a recording."""

    name: str
    type: str
    message_count: int = 0
    serialization_format: str = 'cdr'
    offered_qos: tuple[OfferedQos, ...] = ()
    type_hash: str = ''
    units: Mapping[str, str] = field(default_factory=dict)
    """By field, where the channel tells them."""
    stored: StoredTopic | None = None
    """As the files declare it."""
    stored_count: int = 0
    """Messages in the files, repetitions included; `message_count` is without these."""
    places: dict[Any, list[int]] = field(default_factory=dict)
    """The files that hold it, and its numbers in each."""
    other_types: set[str] = field(default_factory=set)


@dataclass(frozen=True)
class BagInformation:
    """A whole recording."""

    topics: tuple[TopicInformation, ...]
    files: tuple[str, ...]  # their names
    message_count: int
    ros_distro: str = ''
    custom_data: Mapping[str, str] = field(default_factory=dict)
    version: int = VERSION
    storage: str = 'mcap'
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
    return BagInformation(
        topics=tuple(_topic(entry) for entry in document['topics_with_message_count'] or ()),
        files=tuple(_checked(path, str) for path in document['relative_file_paths']),
        message_count=_count(document),
        ros_distro=_checked(document.get('ros_distro') or '', str),
        custom_data={name: str(value) for name, value in (document.get('custom_data') or {}).items()},
        version=_checked(document['version'], int),
        storage=_checked(document['storage_identifier'], str),
        compression_mode=_checked(document.get('compression_mode') or '', str),
    )


def _topic(entry: Any) -> TopicInformation:
    details = entry['topic_metadata']
    return TopicInformation(
        name=_checked(details['name'], str),
        type=_checked(details['type'], str),
        message_count=_count(entry),
        serialization_format=_checked(details['serialization_format'], str),
        offered_qos=readable_qos(details.get('offered_qos_profiles')),
        type_hash=_checked(details.get('type_description_hash') or '', str),
    )


def _checked(value: T, kind: type[T]) -> T:
    if type(value) is not kind:
        wanted = 'a text' if kind is str else 'a whole number'
        raise TypeError(f'{wanted} is wanted; instead received {value!r:.60}')
    return value


def _count(entry: Any) -> int:
    count = _checked(entry['message_count'], int)
    if count < 0:
        raise ValueError(f'a count must be 0 or more; instead received {count}')
    return count


# The topics of a recording, and of many recordings, have the same few texts.
@functools.lru_cache(maxsize=64)
def _offers_in(text: str) -> tuple[OfferedQos, ...]:
    return _offers(plain_yaml(text))


def _offers(documents: Any) -> tuple[OfferedQos, ...]:
    return tuple(OfferedQos(*map(_plain, offer)) for offer in parse_qos(documents or []))


def _plain(value: Any) -> Any:
    if isinstance(value, Enum):
        return value.name.lower()
    return value.sec * NANOSECONDS + value.nsec if isinstance(value, QosTime) else value


def readable_qos(source: Any) -> tuple[OfferedQos, ...]:
    """Return the offers in `source`, YAML text or the list that it holds.

    None where they are not understood: no message needs them.
    """
    try:
        return _offers_in(source) if isinstance(source, str) else _offers(source)
    except (KeyError, TypeError, ValueError, AttributeError, IndexError, OverflowError):
        return ()


def read_statement(record: Mapping[str, str]) -> dict[str, dict[str, int]]:
    """Return {topic: {`received`, `kept`, `lost`, `missing`}} of the record; {} if it is not understood."""
    try:
        topics = plain_yaml(record['topics'])
        return {str(name): {key: int(count) for key, count in row.items()} for name, row in topics.items()}
    except (KeyError, TypeError, ValueError, AttributeError, OverflowError):
        return {}


# Where a recording was made from: a note in its `custom_data`, which rosbag2 keeps in its metadata. The
# messages themselves, `session` among them, stay as they were recorded.

_ORIGIN = 'made_from'
ZERO_KEY = 'zero_ns'
"""Key of a step: the zero of the time axis, for a piece keeps the time of what it was cut from."""


def origin(information: BagInformation | None) -> list[dict[str, Any]]:
    """Return the steps that led to a recording, oldest first; empty for an original."""
    text = information.custom_data.get(_ORIGIN, '') if information else ''
    try:
        steps = plain_yaml(text)
    except YamlError:
        return []
    return [step for step in steps if isinstance(step, dict)] if isinstance(steps, list) else []


def with_step(sources: Iterable[BagInformation | None], step: Mapping[str, Any]) -> dict[str, str]:
    """Return the custom data of a recording made of others: theirs, with one more step."""
    custom: dict[str, str] = {}
    steps: list[dict[str, Any]] = []
    for information in sources:
        custom.update(information.custom_data if information else {})
        steps += [earlier for earlier in origin(information) if earlier not in steps]
    return {**custom, _ORIGIN: yaml.safe_dump([*steps, dict(step)], sort_keys=False)}


# Units of fields in the metadata of an MCAP channel, for topics that no registry knows. rosbag2 keeps that
# metadata and passes over names that it does not know.

_UNITS = 'units'
"""Name of the entry: a JSON object of field and unit, as in {"force": "N"}."""


def units_text(units: Mapping[str, str]) -> dict[str, str]:
    """Return the entries of a channel's metadata with `units` by field; none where there are none."""
    return {_UNITS: json.dumps(dict(units), ensure_ascii=False)} if units else {}


def units_in(details: Mapping[str, str]) -> dict[str, str]:
    """Return the units by field that a channel's metadata have, {} where none is understood."""
    try:
        told = json.loads(details.get(_UNITS, '{}'))
    except json.JSONDecodeError:
        return {}
    return {str(name): str(unit) for name, unit in told.items()} if isinstance(told, dict) else {}
