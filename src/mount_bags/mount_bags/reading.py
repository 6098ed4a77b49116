"""Opens recordings: those of this project and genuine rosbag2 bags, whole or in part."""

import os
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from mount_bags.mcap_file import MESSAGE_HEAD, PAYLOAD_LENGTH_OFFSET, Block, McapFile, McapFileError
from mount_bags.metadata import (
    METADATA_NAME,
    BagInformation,
    MetadataError,
    TopicInformation,
    read_metadata,
)
from mount_bags.offered_qos import OfferedQos, QosError, read_qos
from mount_bags.series import Payloads, Series


class ReadingError(ValueError):
    """A recording, or what was asked of it, cannot be read; the text says why."""


def open_recording(path: str | os.PathLike[str]) -> 'Recording':
    """Open a recording: its folder or a single MCAP file; raises `ReadingError` if nothing is readable.

    What is missing or damaged but does not prevent reading stands in `Recording.warnings`.
    """
    return Recording(Path(path))


class Recording:
    """The messages of a recording by topic; topics are found by full name or by their last part."""

    def __init__(self, path: Path):
        self.path = path
        self.warnings: list[str] = []
        self.information: BagInformation | None = None
        paths = self._read_folder() if path.is_dir() else [path]
        self._files = self._open(paths)
        if self.information is None:
            self._read_embedded()
        self.topics: dict[str, TopicInformation] = self._topics()
        self._compare_counts(len(paths))
        self._series: dict[str, Series] = {}

    @property
    def message_count(self) -> int:
        """How many messages the files hold."""
        return sum(topic.message_count for topic in self.topics.values())

    @property
    def time_range(self) -> tuple[int, int] | None:
        """The first and the last receive time in ns, None without messages."""
        ranges = [found for found in (file.time_range() for file in self._files) if found is not None]
        return (min(first for first, _ in ranges), max(last for _, last in ranges)) if ranges else None

    def __contains__(self, name: str) -> bool:
        return len(self._candidates(name)) == 1

    def __iter__(self) -> Iterator[str]:
        return iter(self.topics)

    def __getitem__(self, name: str) -> Series:
        """Return all messages of a topic; raises `ReadingError` with the known topics."""
        full_name = self.resolve(name)
        if full_name not in self._series:
            self._series[full_name] = self._load(full_name)
        return self._series[full_name]

    def latched(self, name: str) -> Any:
        """Return the last message of a topic, deserialised; raises `ReadingError` if there is none."""
        series = self[name]
        if not len(series):
            raise ReadingError(f'{series.topic} has no message in {self.path}')
        return series.message(len(series) - 1)

    def resolve(self, name: str) -> str:
        """Return the full name of the topic meant by `name`, which may lack its namespace."""
        candidates = self._candidates(name)
        if not candidates:
            raise ReadingError(
                f'{self.path} has no topic {name!r}; it has {", ".join(self.topics) or "none"}'
            )
        if len(candidates) > 1:
            raise ReadingError(f'{name!r} is ambiguous in {self.path}: {", ".join(candidates)}')
        return candidates[0]

    def _candidates(self, name: str) -> list[str]:
        for full_name in (name, f'/{name}'):
            if full_name in self.topics:
                return [full_name]
        return [full_name for full_name in self.topics if full_name.endswith(f'/{name}')]

    # Opening.

    def _read_folder(self) -> list[Path]:
        description = self.path / METADATA_NAME
        present = sorted(self.path.glob('*.mcap'), key=_piece_order)
        try:
            self.information = read_metadata(description.read_text(encoding='utf-8'))
        except FileNotFoundError:
            self.warnings.append(f'{METADATA_NAME} is missing; topics and counts are those of the files')
        except (OSError, UnicodeDecodeError, MetadataError) as error:
            self.warnings.append(f'{METADATA_NAME} is not readable ({error}); the files tell themselves')
        if self.information is None:
            return present
        self._refuse_foreign_storage(self.information)
        listed = [self.path / file.path for file in self.information.files]
        return self._without_missing(listed) or present

    def _refuse_foreign_storage(self, information: BagInformation) -> None:
        if information.storage != 'mcap':
            raise ReadingError(f'{self.path} is stored as {information.storage}; convert it to mcap')
        if information.compression_mode.lower() == 'file':
            raise ReadingError(
                f'{self.path} is compressed file by file ({information.compression_format}); unpack it first'
            )

    def _without_missing(self, listed: list[Path]) -> list[Path]:
        missing = [path.name for path in listed if not path.is_file()]
        if missing:
            self.warnings.append(
                f'{len(missing)} of {len(listed)} pieces are missing: {", ".join(missing)}; '
                'their messages are not here'
            )
        return [path for path in listed if path.is_file()]

    def _open(self, paths: list[Path]) -> list[McapFile]:
        files, reasons = [], []
        for path in paths:
            try:
                files.append(McapFile(path))
            except McapFileError as error:
                reasons.append(str(error))
        if not files:
            raise ReadingError('; '.join(reasons) or f'{self.path} holds no MCAP file')
        self.warnings += reasons
        for file in files:
            self.warnings += file.warnings
            file.warnings = self.warnings  # what is found later, while a topic is read, comes here too
        return files

    def _read_embedded(self) -> None:
        text = self._files[0].metadata.get('rosbag2', {}).get('serialized_metadata')
        if text:
            try:
                self.information = read_metadata(text)
            except MetadataError as error:
                self.warnings.append(f'{self._files[0].path.name}: {error}')

    # Topics.

    def _topics(self) -> dict[str, TopicInformation]:
        described = {topic.name: topic for topic in self.information.topics} if self.information else {}
        topics = {name: replace(topic, message_count=0) for name, topic in described.items()}
        for file in self._files:
            counts = file.message_counts()
            for number, channel in file.channels.items():
                known = topics.get(channel.topic) or self._from_channel(file, number)
                total = known.message_count + counts.get(number, 0)
                topics[channel.topic] = replace(known, message_count=total)
        return topics

    def _from_channel(self, file: McapFile, number: int) -> TopicInformation:
        channel = file.channels[number]
        return TopicInformation(
            name=channel.topic,
            type=file.topic_type(number),
            message_count=0,
            serialization_format=channel.message_encoding,
            offered_qos=_offers(channel.metadata.get('offered_qos_profiles', '')),
            type_hash=channel.metadata.get('topic_type_hash', ''),
        )

    def _compare_counts(self, file_count: int) -> None:
        information = self.information
        if information is None or file_count != len(information.files) or file_count != len(self._files):
            return  # a part of the recording, which was said already
        if information.message_count != self.message_count:
            self.warnings.append(
                f'{METADATA_NAME} tells of {information.message_count} messages, '
                f'the files hold {self.message_count}'
            )

    def _load(self, name: str) -> Series:
        information = self.topics[name]
        if information.serialization_format != 'cdr':
            self.warnings.append(f'{name} is encoded as {information.serialization_format}, not as cdr')
        heads, pieces = [], []
        for file in self._files:
            channels = {number for number, channel in file.channels.items() if channel.topic == name}
            for block in file.blocks(channels):
                heads.append(block.heads)
                pieces.append(_payloads(block))
        head = np.concatenate(heads) if heads else np.empty(0, MESSAGE_HEAD)
        log_times, publish_times = head['log_time'].astype(np.int64), head['publish_time'].astype(np.int64)
        return Series(name, information.type, Payloads(pieces), log_times, publish_times)


def _payloads(block: Block) -> NDArray[np.uint8] | list[bytes]:
    """Return the payloads of a block as rows if they have one length, else one by one."""
    begins = block.offsets + MESSAGE_HEAD.itemsize
    lengths = block.heads['length'].astype(np.int64) - PAYLOAD_LENGTH_OFFSET
    if (lengths == lengths[0]).all():
        return block.data[begins[:, None] + np.arange(lengths[0])]
    ends = begins + lengths
    return [block.data[begin:end].tobytes() for begin, end in zip(begins, ends, strict=True)]


def _piece_order(path: Path) -> tuple[int, str]:
    number = path.stem.rpartition('_')[2]
    return (int(number) if number.isdigit() else 0, path.name)


def _offers(text: str) -> tuple[OfferedQos, ...]:
    try:
        return read_qos(text)
    except QosError:
        return ()  # not needed to read the messages
