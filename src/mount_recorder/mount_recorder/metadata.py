"""The description of a recording that stands in `metadata.yaml` and, as text, inside the MCAP file.

Written in version 9, the one of rosbag2 0.26 (ROS 2 Jazzy).
"""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import yaml

from mount_recorder.offered_qos import OfferedQos, qos_documents

METADATA_NAME = 'metadata.yaml'
ROOT = 'rosbag2_bagfile_information'
VERSION = 9
NO_TIME = (1 << 63) - 1  # ns: the starting time of a recording without messages, as rosbag2 writes it


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


def bag_document(bag: BagInformation) -> dict[str, Any]:
    """Return the description without its root, as plain data in the order of rosbag2's fields."""
    return {
        'version': bag.version,
        'storage_identifier': bag.storage,
        'duration': {'nanoseconds': bag.duration},
        'starting_time': {'nanoseconds_since_epoch': bag.starting_time},
        'message_count': bag.message_count,
        'topics_with_message_count': [_topic_document(topic) for topic in bag.topics],
        'compression_format': bag.compression_format,
        'compression_mode': bag.compression_mode,
        'relative_file_paths': [file.path for file in bag.files],
        'files': [
            {
                'path': file.path,
                'starting_time': {'nanoseconds_since_epoch': file.starting_time},
                'duration': {'nanoseconds': file.duration},
                'message_count': file.message_count,
            }
            for file in bag.files
        ],
        'custom_data': dict(bag.custom_data) or None,
        'ros_distro': bag.ros_distro,
    }


def embedded_text(bag: BagInformation) -> str:
    """Return the text of the MCAP file's own metadata record."""
    return _yaml(bag_document(bag))


def metadata_text(bag: BagInformation) -> str:
    """Return the text of `metadata.yaml`."""
    return _yaml({ROOT: bag_document(bag)})


class _PlainDumper(getattr(yaml, 'CSafeDumper', yaml.SafeDumper)):  # type: ignore[misc]
    """Repeats equal parts instead of referring to them: rosbag2's reader knows no aliases."""

    def ignore_aliases(self, data: Any) -> bool:
        return True


def _yaml(document: Any) -> str:
    return yaml.dump(document, Dumper=_PlainDumper, sort_keys=False, width=1 << 20)


def _topic_document(topic: TopicInformation) -> dict[str, Any]:
    return {
        'topic_metadata': {
            'name': topic.name,
            'type': topic.type,
            'serialization_format': topic.serialization_format,
            'offered_qos_profiles': qos_documents(topic.offered_qos),
            'type_description_hash': topic.type_hash,
        },
        'message_count': topic.message_count,
    }
