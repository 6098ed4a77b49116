"""The description of a recording, read from `metadata.yaml` or from the MCAP file; all versions are read."""

from typing import Any

from engine_mount.recordings.bag.offered_qos import QosError, read_qos
from mount_models.plain_yaml import plain_yaml
from mount_recorder.metadata import ROOT, BagInformation, FileInformation, TopicInformation


class MetadataError(ValueError):
    """A description of a recording is not understood."""


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
