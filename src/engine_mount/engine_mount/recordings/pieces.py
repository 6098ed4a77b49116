"""The files of a recording, and the topics in these.

The declarations in the files count more than the description beside them: there they are under checksums.
"""

import re
import tempfile
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path

from rosbags.convert.converter import ConverterError, convert
from rosbags.typesys import Stores, get_typestore

from engine_mount.recordings.layout import Definition, definition_of
from engine_mount.recordings.mcap_file import McapFile
from engine_mount.recordings.mcap_records import StorageError, StoredTopic
from engine_mount.recordings.metadata import (
    BagInformation,
    MetadataError,
    TopicInformation,
    read_metadata,
    readable_qos,
    units_in,
)
from mount_models.plain_yaml import YamlError, plain_yaml, text_of_file
from mount_recorder.bag_writer import PIECE_RECORD
from mount_recorder.metadata import METADATA_NAME

_PIECE = re.compile(r'([^.].*?)(?:_(\d+))?\.(mcap|db3)')


@dataclass(frozen=True)
class Pieces:
    """The files of a recording in their order; `complete` if none is known to be missing."""

    paths: tuple[Path, ...]
    information: BagInformation | None = None
    warnings: tuple[str, ...] = ()
    complete: bool = True


def find_pieces(path: Path) -> Pieces:
    """Return the files of a recording that is a folder or a single file; raises `StorageError`."""
    if not path.is_dir():
        return Pieces((path,))
    matches = {file: match for file in path.iterdir() if (match := _PIECE.fullmatch(file.name))}
    numbers = {file: int(match[2] or 0) for file, match in matches.items() if file.is_file()}
    kind = 'mcap' if any(matches[file][3] == 'mcap' for file in numbers) else 'db3'
    present = [file for file in numbers if matches[file][3] == kind]
    present.sort(key=lambda file: (numbers[file], file.name))
    information, obstacle = _description(path)
    if information is None:
        if not present:
            inner = path / 'recording'
            hint = f'; the recording of this run is {inner}' if inner.is_dir() else ''
            raise StorageError(f'{path} holds no MCAP file{hint}')
        complete = [numbers[file] for file in present] == list(range(len(present)))
        return Pieces(
            tuple(present), None, (f'{obstacle}; topics and times are those in the files',), complete
        )
    if information.storage == 'sqlite3' or information.compression_mode.lower() not in ('', 'none'):
        return Pieces((path,), information)
    if information.storage != 'mcap':
        raise StorageError(f'{path} is stored as {information.storage}; convert it to mcap')
    listed = [path / Path(file).name for file in information.files]
    missing = [file.name for file in listed if not file.is_file()]
    here = [file for file in listed if file.is_file()] or present
    warnings = []
    if missing:
        count = f'{len(missing)} of {len(listed)} pieces are missing'
        warnings.append(f'{count}: {", ".join(missing)}; their messages are not here')
    else:
        known = {matches[file][1]: numbers[file] for file in here if file in numbers}
        further = [file for file in present if numbers[file] > known.get(matches[file][1], numbers[file])]
        if further:
            names = ', '.join(file.name for file in further)
            warnings.append(f'{METADATA_NAME} does not know {names}, as after a crash; read all the same')
            here += further
    if not here:
        raise StorageError(f'{path} holds no MCAP file; {"; ".join(warnings)}')
    return Pieces(tuple(here), information, tuple(warnings), not missing)


def open_piece(path: Path) -> McapFile:
    """Open one file of a recording; raises `StorageError`.

    What is no MCAP file of plain messages is read from a copy: files and folders of bags in sqlite3 and of
    compressed ones.
    """
    if path.suffix in ('.zstd', '.zst'):
        raise StorageError(f'{path} is compressed as a whole; unpack it by zstd -d first')
    if path.suffix != '.db3' and not path.is_dir():
        return McapFile(path)
    folder = path if path.is_dir() else path.parent
    logs = [log.name for log in folder.glob('*.db3-*') if log.stat().st_size]
    if logs:
        raise StorageError(
            f'{path} was not closed by its writer, messages stand in {logs[0]}: close a copy by '
            f"sqlite3 {logs[0].rpartition('-')[0]} 'PRAGMA journal_mode=DELETE' and read that"
        )
    with tempfile.TemporaryDirectory(prefix='engine_mount_') as copy:
        store = get_typestore(Stores.ROS2_JAZZY)
        try:
            convert([path], Path(copy, 'bag'), 'mcap', 9, None, 'file', store, None, (), (), (), ())
        except ConverterError as error:
            raise StorageError(f'{path} cannot be converted to MCAP: {error}') from None
        file = McapFile(Path(copy, 'bag', 'bag.mcap'))  # it stays open
    file.path = path
    return file


def _description(folder: Path) -> tuple[BagInformation | None, str]:
    """Return the description of a recording, or None and the obstacle."""
    if not (folder / METADATA_NAME).exists():
        return None, f'{METADATA_NAME} is missing'
    try:
        return read_metadata(text_of_file(folder / METADATA_NAME)), ''
    except (YamlError, MetadataError) as error:
        return None, f'{METADATA_NAME} is not readable ({error})'


@dataclass
class Declared:
    """A topic as the files declare it: counted without repetitions, `stored` with them."""

    information: TopicInformation
    stored: int = 0
    topic: StoredTopic | None = None
    other_types: set[str] = field(default_factory=set)
    places: list[tuple[McapFile, int]] = field(default_factory=list)
    """The files that hold it, and its number in each."""

    def definition(self) -> tuple[Definition | None, str]:
        """Return the definition of the messages, and a sentence where that of the recording is no use."""
        topic = self.information
        if topic.serialization_format != 'cdr':
            return None, f'its messages are encoded as {topic.serialization_format!r}, not as cdr'
        if self.topic is None:
            return definition_of(topic.type, b'', '')
        return definition_of(topic.type, self.topic.definition, self.topic.definition_encoding)


def declared_topics(files: Sequence[McapFile], information: BagInformation | None) -> dict[str, Declared]:
    """Return the topics by name, those of the description first and in its order."""
    described = information.topics if information else ()
    topics = {topic.name: Declared(replace(topic, message_count=0)) for topic in described}
    for file in files:
        unseen = set(repeated_topics(file)) if file is not files[0] else set()
        for number, topic in file.topics.items():
            count = file.message_counts.get(number, 0)
            repetition = int(topic.name in unseen and count > 0)
            unseen -= {topic.name} if repetition else set()
            known = topics.get(topic.name)
            found = _information(topic, known.information if known else None)
            if known is None or known.topic is None:
                known = topics[topic.name] = Declared(found, topic=topic)
            elif found.type != known.information.type:
                known.other_types.add(found.type)
                continue
            known.places.append((file, number))
            known.stored += count
            total = known.information.message_count + count - repetition
            known.information = replace(known.information, message_count=total)
    return topics


def repeated_topics(file: McapFile) -> frozenset[str]:
    """Return the topics of which a file repeats the last message of the file before it."""
    try:
        names = plain_yaml(file.metadata.get(PIECE_RECORD, {}).get('repeated', '[]'))
        return frozenset(map(str, names))
    except (YamlError, TypeError):
        return frozenset()


def _information(topic: StoredTopic, known: TopicInformation | None) -> TopicInformation:
    known = known or TopicInformation(topic.name, '', 0)
    return TopicInformation(
        name=topic.name,
        type=topic.type or known.type,
        message_count=0,
        serialization_format=topic.encoding,
        offered_qos=readable_qos(topic.details.get('offered_qos_profiles', '')) or known.offered_qos,
        type_hash=topic.details.get('topic_type_hash', '') or known.type_hash,
        units=units_in(topic.details) or known.units,
    )
