"""What `mcap` finds in a recording, record by record, also in a file without an end."""

import contextlib
from io import BytesIO
from pathlib import Path
from typing import NamedTuple

import yaml
from mcap.exceptions import EndOfFile
from mcap.records import Channel, Message, Metadata
from mcap.stream_reader import StreamReader
from mcap.writer import MCAP0_MAGIC
from rosbags.typesys import Stores, get_typestore

STORE = get_typestore(Stores.ROS2_JAZZY)


class Kept(NamedTuple):
    """One message with its times in ns."""

    topic: str
    raw: bytes
    log_time: int
    publish_time: int


def pieces_of(folder: Path) -> list[Path]:
    """Return the files of a recording in their order."""
    return sorted(folder.glob('*.mcap'), key=lambda path: int(path.stem.rpartition('_')[2]))


def records_of(path: Path) -> list:
    """Return the records of a file, as far as they are whole; checksums hold."""
    found, data = [], whole_records(path.read_bytes())
    with contextlib.suppress(EndOfFile):
        for record in StreamReader(BytesIO(data), validate_crcs=True).records if data else ():
            found.append(record)  # noqa: PERF402 - those before the end of the file are kept
    return found


def whole_records(data: bytes) -> bytes:
    """Return the content of a file without a record that is cut off."""
    end = len(MCAP0_MAGIC)
    while (behind := end + 9 + int.from_bytes(data[end + 1 : end + 9], 'little')) <= len(data):
        end = behind
    return data if data[end:] == MCAP0_MAGIC else data[:end] if len(data) >= end else b''


def messages_in(path: Path) -> list[Kept]:
    """Return the messages of a file."""
    channels, found = {}, []
    for record in records_of(path):
        if isinstance(record, Channel):
            channels[record.id] = record.topic
        elif isinstance(record, Message):
            found.append(Kept(channels[record.channel_id], record.data, record.log_time, record.publish_time))
    return found


def read_back(folder: Path, topic: str | None = None) -> list[Kept]:
    """Return the messages of a whole recording, of all topics or of one."""
    found = [kept for path in pieces_of(folder) for kept in messages_in(path)]
    return found if topic is None else [kept for kept in found if kept.topic == topic]


def description(folder: Path) -> dict:
    """Return the content of `metadata.yaml`."""
    return yaml.safe_load((folder / 'metadata.yaml').read_text())['rosbag2_bagfile_information']


def loss_statement(folder: Path) -> dict:
    """Return what the recorder says of each topic at the end of the last file."""
    metadata = [record for record in records_of(pieces_of(folder)[-1]) if isinstance(record, Metadata)]
    (text,) = [record.metadata['topics'] for record in metadata if record.name == 'engine_mount_recorder']
    return yaml.safe_load(text)


def text_in(raw: bytes) -> str:
    """Return the text of a serialised `std_msgs/String`."""
    return STORE.deserialize_cdr(raw, 'std_msgs/msg/String').data
