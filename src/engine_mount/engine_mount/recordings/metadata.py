"""The description of a recording: topics, quality of service, units, losses of its recorder, its origin."""

import functools
import json
from collections.abc import Mapping
from dataclasses import dataclass, field
from enum import Enum
from typing import Any, TypeVar

import yaml
from pydantic import BaseModel, NonNegativeInt, ValidationError
from rosbags.interfaces import QosTime
from rosbags.rosbag2.metadata import parse_qos

from engine_mount.recordings.mcap_records import StoredTopic
from mount_models.plain_yaml import YamlError, plain_yaml
from mount_recorder.metadata import ROOT, Offers
from mount_ros.topics import RACK_TOPICS, SHADOW_TOPICS, TOPICS, Topic

T = TypeVar('T')


class MetadataError(ValueError):
    """A description of a recording is not understood."""


# Recordings have the same few names, and of each it is asked again and again.
@functools.lru_cache(maxsize=1024)
def registered_topic(name: str, type_name: str) -> Topic | None:
    """Return the registered topic behind a full name with any namespace, None if there is none.

    A topic of another type than `type_name` is a foreign one, whatever its name.
    """
    known = TOPICS + SHADOW_TOPICS + RACK_TOPICS
    fitting = [topic for topic in known if f'/{name}'.endswith('/' + topic.name.lstrip('/'))]
    found = max(fitting, key=lambda topic: len(topic.name), default=None)
    return found if found is not None and found.type == type_name else None


@dataclass
class TopicInformation:
    """One topic of a recording."""

    name: str
    type: str
    message_count: int = 0
    serialization_format: str = 'cdr'
    offered_qos: Offers = ()
    type_hash: str = ''
    units: Mapping[str, str] = field(default_factory=dict)
    """By field, where the channel tells them."""
    stored: StoredTopic | None = None
    """As the files declare it."""
    places: dict[Any, list[int]] = field(default_factory=dict)
    """The files that hold it, and its numbers in each."""
    other_types: set[str] = field(default_factory=set)


class _Topic(BaseModel, strict=True):
    name: str
    type: str
    serialization_format: str
    offered_qos_profiles: Any = None
    type_description_hash: str | None = None


class _Counted(BaseModel, strict=True):
    topic_metadata: _Topic
    message_count: NonNegativeInt


class BagInformation(BaseModel, strict=True):
    """A whole recording, by the names of rosbag2."""

    version: int
    storage_identifier: str
    relative_file_paths: list[str]
    message_count: NonNegativeInt
    topics_with_message_count: list[_Counted] | None
    compression_mode: str | None = None
    ros_distro: str | None = None
    custom_data: dict[str, Any] | None = None

    @property
    def topics(self) -> list[TopicInformation]:
        """The topics that it lists."""
        return [
            TopicInformation(
                name=topic.name,
                type=topic.type,
                message_count=entry.message_count,
                serialization_format=topic.serialization_format,
                offered_qos=readable_qos(topic.offered_qos_profiles),
                type_hash=topic.type_description_hash or '',
            )
            for entry in self.topics_with_message_count or ()
            for topic in [entry.topic_metadata]
        ]


def read_metadata(text: str) -> BagInformation:
    """Return what `metadata.yaml` or a metadata record says; raises `MetadataError`."""
    try:
        document = plain_yaml(text)
        return BagInformation.model_validate(document.get(ROOT, document))
    except ValidationError as error:
        first = error.errors()[0]
        reason = (
            f'{".".join(map(str, first["loc"]))}: {first["msg"]}; instead received {first["input"]!r:.60}'
        )
    except (ValueError, AttributeError) as error:
        reason = str(error)
    raise MetadataError(f'description of the recording not understood: {reason}')


# The topics of a recording, and of many recordings, have the same few texts.
_cached_yaml = functools.lru_cache(maxsize=64)(plain_yaml)


def readable_qos(source: Any) -> Offers:
    """Return the offers in `source`, YAML text or the list that it holds, as rosbag2 writes them now.

    None where they are not understood: no message needs them.
    """
    try:
        offers = parse_qos((_cached_yaml(source) if isinstance(source, str) else source) or [])
    except (KeyError, TypeError, ValueError, AttributeError, IndexError, OverflowError):
        return []
    return [{name: _plain(value) for name, value in offer._asdict().items()} for offer in offers]


def _plain(value: Any) -> Any:
    if isinstance(value, QosTime):
        return value._asdict()
    return value.name.lower() if isinstance(value, Enum) else value


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


def custom_data(information: BagInformation | None) -> dict[str, str]:
    """Return the notes of the writer; none where there is no description."""
    found = information.custom_data if information else None
    return {name: str(value) for name, value in (found or {}).items()}


def origin(information: BagInformation | None) -> list[dict[str, Any]]:
    """Return the steps that led to a recording, oldest first; empty for an original."""
    try:
        steps = plain_yaml(str(custom_data(information).get(_ORIGIN, '')))
    except YamlError:
        return []
    return [step for step in steps if isinstance(step, dict)] if isinstance(steps, list) else []


def with_step(information: BagInformation | None, step: Mapping[str, Any]) -> dict[str, str]:
    """Return the custom data of a recording made of another: its own, with one more step."""
    steps = yaml.safe_dump([*origin(information), dict(step)], sort_keys=False)
    return {**custom_data(information), _ORIGIN: steps}


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
