"""The files of a recording, and the topics in these.

The declarations in the files count more than the description beside them: there they are under checksums.
"""

import re
import tempfile
from collections.abc import Iterable, Sequence
from dataclasses import replace
from pathlib import Path
from typing import NamedTuple

from rosbags.convert.converter import ConverterError, convert
from rosbags.typesys import Stores, get_typestore

from engine_mount.recordings.layout import (
    Definition,
    DefinitionError,
    installed_definition,
    text_definition,
)
from engine_mount.recordings.mcap_file import McapFile
from engine_mount.recordings.mcap_records import ReadingError
from engine_mount.recordings.metadata import (
    BagInformation,
    TopicInformation,
    read_metadata,
    readable_qos,
    units_in,
)
from mount_models.plain_yaml import YamlError, text_of_file
from mount_recorder.metadata import METADATA_NAME

_PIECE = re.compile(r'([^.].*?)(?:_(\d+))?\.(mcap|db3)')


class Pieces(NamedTuple):
    """The files of a recording in their order; `complete` if none is known to be missing."""

    paths: Sequence[Path]
    information: BagInformation | None = None
    warnings: tuple[str, ...] = ()
    complete: bool = True


def find_pieces(path: Path) -> Pieces:
    """Return the files of a recording that is a folder or a single file; raises `ReadingError`."""
    if not path.is_dir():
        return Pieces([path])
    matches = {file: match for file in path.iterdir() if (match := _PIECE.fullmatch(file.name))}
    numbers = {file: int(match[2] or 0) for file, match in matches.items()}
    kind = '.mcap' if any(file.suffix == '.mcap' for file in numbers) else '.db3'
    present = sorted(
        (file for file in numbers if file.suffix == kind), key=lambda file: (numbers[file], file.name)
    )
    if not (path / METADATA_NAME).exists():
        information, obstacle = None, f'{METADATA_NAME} is missing'
    else:
        try:
            information, obstacle = read_metadata(text_of_file(path / METADATA_NAME)), ''
        except (YamlError, ReadingError) as error:
            information, obstacle = None, f'{METADATA_NAME} is not readable ({error})'
    if information is None:
        if not present:
            raise ReadingError(f'{path} holds no MCAP file')
        complete = [numbers[file] for file in present] == list(range(len(present)))
        return Pieces(present, None, (f'{obstacle}; topics and times are those in the files',), complete)
    if information.storage_identifier == 'sqlite3' or (
        (information.compression_mode or 'none').lower() != 'none'
    ):
        return Pieces([path], information)
    if information.storage_identifier != 'mcap':
        raise ReadingError(f'{path} is stored as {information.storage_identifier}; convert it to mcap')
    listed = [path / Path(file).name for file in information.relative_file_paths]
    missing = [file.name for file in listed if not file.is_file()]
    here = [file for file in listed if file.is_file()] or present
    if missing:
        count = f'{len(missing)} of {len(listed)} pieces are missing'
        warning = f'{count}: {", ".join(missing)}; their messages are not here'
        return Pieces(here, information, (warning,), complete=False)
    known = {matches[file][1]: numbers[file] for file in here if file in numbers}
    further = [file for file in present if numbers[file] > known.get(matches[file][1], numbers[file])]
    names = ', '.join(file.name for file in further)
    warning = f'{METADATA_NAME} does not know {names}, as after a crash; read all the same'
    return Pieces([*here, *further], information, (warning,) if further else ())


def open_piece(path: Path) -> McapFile:
    """Open one file of a recording; raises `ReadingError`.

    What is no MCAP file of plain messages is read from a copy: files and folders of bags in sqlite3 and of
    compressed ones.
    """
    if path.suffix in ('.zstd', '.zst'):
        raise ReadingError(f'{path} is compressed as a whole; unpack it by zstd -d first')
    if path.suffix != '.db3' and not path.is_dir():
        return McapFile(path)
    folder = path if path.is_dir() else path.parent
    logs = [log.name for log in folder.glob('*.db3-*') if log.stat().st_size]
    if logs:
        raise ReadingError(
            f'{path} was not closed by its writer, messages stand in {logs[0]}: close a copy by '
            f"sqlite3 {logs[0].rpartition('-')[0]} 'PRAGMA journal_mode=DELETE' and read that"
        )
    with tempfile.TemporaryDirectory(prefix='engine_mount_') as copy:
        store = get_typestore(Stores.ROS2_JAZZY)
        try:
            convert([path], Path(copy, 'bag'), 'mcap', 9, None, 'file', store, None, (), (), (), ())
        except ConverterError as error:
            raise ReadingError(f'{path} cannot be converted to MCAP: {error}') from None
        file = McapFile(Path(copy, 'bag', 'bag.mcap'))  # it stays open
    file.path = path
    return file


def declared_topics(
    files: Iterable[McapFile], described: Iterable[TopicInformation]
) -> dict[str, TopicInformation]:
    """Return the topics by name, those of the description first and in its order."""
    topics = {topic.name: replace(topic, message_count=0) for topic in described}
    for file in files:
        for number, stored in file.topics.items():
            topic = topics.setdefault(stored.name, TopicInformation(stored.name, stored.type))
            if topic.stored is None:
                topic.stored, topic.serialization_format = stored, stored.encoding
                topic.type = stored.type or topic.type
                offers = readable_qos(stored.details.get('offered_qos_profiles', ''))
                topic.offered_qos = offers or topic.offered_qos
                topic.type_hash = stored.details.get('topic_type_hash', '') or topic.type_hash
                topic.units = units_in(stored.details)
            elif stored.type not in ('', topic.type):
                topic.other_types.add(stored.type)
                continue
            topic.places.setdefault(file, []).append(number)
            topic.message_count += file.message_counts[number]
    return topics


def definition_of(topic: TopicInformation) -> tuple[Definition | None, str]:
    """Return the definition of the messages, and a sentence where that of the recording is no use."""
    if topic.serialization_format != 'cdr':
        return None, f'its messages are encoded as {topic.serialization_format!r}, not as cdr'
    text = topic.stored.definition if topic.stored else b''
    try:
        if text.strip() and topic.stored and topic.stored.definition_encoding == 'ros2msg':
            return text_definition(topic.type, text.decode()), ''
        foreign = 'its definition is not written in ros2msg' if text.strip() else ''
        return installed_definition(topic.type), foreign
    except (DefinitionError, UnicodeDecodeError) as error:
        return None, f'the definition of {topic.type} in the recording is not readable ({error})'
    except ValueError:
        return None, f'the recording does not define its type, and type {topic.type!r} is not installed'
