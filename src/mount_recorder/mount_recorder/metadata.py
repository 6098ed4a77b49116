"""The description of a recording that stands in `metadata.yaml` and, as text, inside the MCAP file.

Written in version 9, the one of rosbag2 0.26 (ROS 2 Jazzy).
"""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

import yaml

METADATA_NAME = 'metadata.yaml'
ROOT = 'rosbag2_bagfile_information'
VERSION = 9
NO_TIME = (1 << 63) - 1  # ns: the starting time of a recording without messages, as rosbag2 writes it
INFINITE = (1 << 63) - 1  # ns: the duration without end, 9223372036 s and 854775807 ns
NANOSECONDS = 1_000_000_000


@dataclass(frozen=True)
class OfferedQos:
    """What one publisher offers; durations in ns. Discovery tells neither history nor depth."""

    history: str = 'unknown'
    depth: int = 0
    reliability: str = 'reliable'
    durability: str = 'volatile'
    deadline: int = INFINITE
    lifespan: int = INFINITE
    liveliness: str = 'automatic'
    liveliness_lease_duration: int = INFINITE
    avoid_ros_namespace_conventions: bool = False


class TopicEntry(NamedTuple):
    """One topic of a recording."""

    name: str
    type: str
    message_count: int
    offered_qos: Sequence[OfferedQos] = ()
    type_hash: str = ''
    encoding: str = 'cdr'


class FileEntry(NamedTuple):
    """One file of a recording: its name, its first and last log time in ns, None without messages."""

    name: str
    start: int | None
    end: int | None
    message_count: int


def bag_description(
    topics: Iterable[TopicEntry],
    files: Sequence[FileEntry],
    custom_data: Mapping[str, str],
    ros_distro: str,
) -> dict[str, Any]:
    """Return the description without its root, as plain data in the order of rosbag2's fields."""
    starts = [file.start for file in files if file.start is not None]
    ends = [file.end for file in files if file.end is not None]
    return {
        'version': VERSION,
        'storage_identifier': 'mcap',
        **_time_span(min(starts, default=None), max(ends, default=None)),
        'message_count': sum(file.message_count for file in files),
        'topics_with_message_count': [_topic_document(topic) for topic in topics],
        'compression_format': '',
        'compression_mode': '',
        'relative_file_paths': [file.name for file in files],
        'files': [
            {
                'path': file.name,
                **dict(reversed(_time_span(file.start, file.end).items())),
                'message_count': file.message_count,
            }
            for file in files
        ],
        'custom_data': dict(custom_data) or None,
        'ros_distro': ros_distro,
    }


def embedded_record(description: Mapping[str, Any]) -> dict[str, dict[str, str]]:
    """Return the metadata record of the MCAP file, by its name."""
    return {'rosbag2': {'serialized_metadata': _yaml(description)}}


def metadata_text(description: Mapping[str, Any]) -> str:
    """Return the text of `metadata.yaml`."""
    return _yaml({ROOT: description})


def qos_text(offers: Sequence[OfferedQos]) -> str:
    """Return the YAML list of offers that stands in a channel's metadata; `[]` without offers."""
    return yaml.safe_dump(_qos_documents(offers), sort_keys=False).rstrip('\n')


class _PlainDumper(getattr(yaml, 'CSafeDumper', yaml.SafeDumper)):  # type: ignore[misc]
    """Repeats equal parts instead of referring to them: rosbag2's reader knows no aliases."""

    def ignore_aliases(self, data: Any) -> bool:
        return True


def _yaml(document: Any) -> str:
    return yaml.dump(document, Dumper=_PlainDumper, sort_keys=False, width=1 << 20)


def _time_span(start: int | None, end: int | None) -> dict[str, dict[str, int]]:
    if start is None or end is None:
        start = end = NO_TIME
    return {
        'duration': {'nanoseconds': end - start},
        'starting_time': {'nanoseconds_since_epoch': start},
    }


def _topic_document(topic: TopicEntry) -> dict[str, Any]:
    return {
        'topic_metadata': {
            'name': topic.name,
            'type': topic.type,
            'serialization_format': topic.encoding,
            'offered_qos_profiles': _qos_documents(topic.offered_qos),
            'type_description_hash': topic.type_hash,
        },
        'message_count': topic.message_count,
    }


def _qos_documents(offers: Sequence[OfferedQos]) -> list[dict[str, Any]]:
    """Return the offers as plain data in the order of rosbag2's fields, which is that of `OfferedQos`."""
    durations = ('deadline', 'lifespan', 'liveliness_lease_duration')
    return [
        {name: _duration(value) if name in durations else value for name, value in vars(offer).items()}
        for offer in offers
    ]


def _duration(nanoseconds: int) -> dict[str, int]:
    seconds, rest = divmod(nanoseconds, NANOSECONDS)
    return {'sec': seconds, 'nsec': rest}
