"""The description of a recording that stands in `metadata.yaml` and, as text, inside the MCAP file.

Written in version 9, the one of rosbag2 0.26 (ROS 2 Jazzy).
"""

from collections.abc import Iterable, Mapping, Sequence
from typing import Any, NamedTuple

import yaml

from mount_recorder.mcap_writer import McapWriter

METADATA_NAME = 'metadata.yaml'
ROOT = 'rosbag2_bagfile_information'
VERSION = 9
_NO_TIME = (1 << 63) - 1  # ns: the starting time of a recording without messages, as rosbag2 writes it

Offers = Sequence[Mapping[str, Any]]
"""What each publisher of a topic offers: the policies of its quality of service as rosbag2 writes them."""


class TopicEntry(NamedTuple):
    """One topic of a recording."""

    name: str
    type: str
    message_count: int
    offered_qos: Offers = ()
    type_hash: str = ''
    encoding: str = 'cdr'


def bag_description(
    topics: Iterable[TopicEntry],
    files: Sequence[McapWriter],
    ros_distro: str,
    custom_data: Mapping[str, str] | None = None,
) -> dict[str, Any]:
    """Return the description without its root, as plain data in the order of rosbag2's fields."""
    start, duration = _time_span(files)
    return {
        'version': VERSION,
        'storage_identifier': 'mcap',
        'duration': duration,
        'starting_time': start,
        'message_count': sum(file.message_counts.total() for file in files),
        'topics_with_message_count': [
            {
                'topic_metadata': {
                    'name': topic.name,
                    'type': topic.type,
                    'serialization_format': topic.encoding,
                    'offered_qos_profiles': list(topic.offered_qos),
                    'type_description_hash': topic.type_hash,
                },
                'message_count': topic.message_count,
            }
            for topic in topics
        ],
        'compression_format': '',
        'compression_mode': '',
        'relative_file_paths': [file.file.path.name for file in files],
        'files': [
            {
                'path': file.file.path.name,
                'starting_time': start,
                'duration': duration,
                'message_count': file.message_counts.total(),
            }
            for file in files
            for start, duration in [_time_span([file])]
        ],
        'custom_data': dict(custom_data) if custom_data else None,
        'ros_distro': ros_distro,
    }


def embedded_record(description: Mapping[str, Any]) -> dict[str, dict[str, str]]:
    """Return the metadata record of the MCAP file, by its name."""
    return {'rosbag2': {'serialized_metadata': _yaml(description)}}


def metadata_text(description: Mapping[str, Any]) -> str:
    """Return the text of `metadata.yaml`."""
    return _yaml({ROOT: description})


def qos_text(offers: Offers) -> str:
    """Return the YAML list of offers that stands in a channel's metadata; `[]` without offers."""
    return _yaml(list(offers)).rstrip('\n')


class _PlainDumper(getattr(yaml, 'CSafeDumper', yaml.SafeDumper)):  # type: ignore[misc]
    """Repeats equal parts instead of referring to them: rosbag2's reader knows no aliases."""

    def ignore_aliases(self, data: Any) -> bool:
        return True


def _yaml(document: Any) -> str:
    return yaml.dump(document, Dumper=_PlainDumper, sort_keys=False, width=1 << 20)


def _time_span(files: Sequence[McapWriter]) -> tuple[dict[str, int], dict[str, int]]:
    """Return starting time and duration of the messages in `files`."""
    starts = [start for file in files if (start := file.start_time) is not None]
    first = min(starts, default=_NO_TIME)
    last = max((file.end_time or 0 for file in files), default=0) if starts else first
    return {'nanoseconds_since_epoch': first}, {'nanoseconds': last - first}
