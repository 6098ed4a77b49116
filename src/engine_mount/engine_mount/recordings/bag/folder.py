"""Which files a recording consists of, and what its description says of them."""

import re
from dataclasses import dataclass
from pathlib import Path

from engine_mount.recordings.bag.metadata import BagInformation, MetadataError, read_metadata
from engine_mount.recordings.container.mcap_reading.mcap_file import McapFile
from engine_mount.recordings.container.sqlite_file import SqliteFile
from engine_mount.recordings.container.stored import StoredFile
from engine_mount.recordings.container.unpacking import COMPRESSED_SUFFIXES
from mount_models.plain_yaml import YamlError, text_of_file
from mount_recorder.metadata import METADATA_NAME

_STORAGES = {'mcap': '.mcap', 'sqlite3': '.db3'}
_NUMBER = re.compile(r'(.*)_(\d+)')


class BagFolderError(ValueError):
    """A folder holds no recording that can be read; the text says why."""


@dataclass(frozen=True)
class Found:
    """The files of a recording in their order; `complete` if none is known to be missing."""

    paths: tuple[Path, ...]
    information: BagInformation | None = None
    warnings: tuple[str, ...] = ()
    complete: bool = True


def find_pieces(path: Path) -> Found:
    """Return the files of a recording that is a folder or a single file; raises `BagFolderError`."""
    if not path.is_dir():
        return Found((path,))
    present = _present(path)
    if not (path / METADATA_NAME).exists():
        return _undescribed(path, present, f'{METADATA_NAME} is missing; the files tell themselves')
    try:
        information = read_metadata(text_of_file(path / METADATA_NAME))
    except (YamlError, MetadataError) as error:
        return _undescribed(
            path, present, f'{METADATA_NAME} is not readable ({error}); the files tell themselves'
        )
    if information.storage not in _STORAGES:
        raise BagFolderError(f'{path} is stored as {information.storage}; convert it to mcap')
    return _described(path, information, present)


def open_piece(path: Path) -> StoredFile:
    """Open one file of a recording; raises `StorageError`."""
    return SqliteFile(path) if '.db3' in path.suffixes else McapFile(path)


def _undescribed(path: Path, present: list[Path], sentence: str) -> Found:
    if not present:
        inner = path / 'recording'
        hint = f'; the recording of this run is {inner}' if inner.is_dir() else ''
        raise BagFolderError(f'{path} holds no MCAP file{hint}')
    return Found(tuple(present), None, (sentence,), _is_contiguous(present))


def _described(path: Path, information: BagInformation, present: list[Path]) -> Found:
    listed = [path / Path(file.path).name for file in information.files]
    missing = [file.name for file in listed if not file.is_file()]
    warnings = []
    if missing:
        count = f'{len(missing)} of {len(listed)} pieces are missing'
        warnings.append(f'{count}: {", ".join(missing)}; their messages are not here')
    here = [file for file in listed if file.is_file()] or present
    further = _further(here, present)
    if further and not missing:
        names = ', '.join(file.name for file in further)
        warnings.append(f'{METADATA_NAME} does not know {names}, as after a crash; read all the same')
        here += further
    if not here:
        raise BagFolderError(f'{path} holds no MCAP file; {"; ".join(warnings)}')
    return Found(tuple(here), information, tuple(warnings), not missing)


def _further(here: list[Path], present: list[Path]) -> list[Path]:
    """Return the files that go on where the known ones end, by their names."""
    matches = [_NUMBER.fullmatch(_stem(file)) for file in here]
    known = {(match[1], int(match[2])) for match in matches if match}
    further = []
    for file in present:
        match = _NUMBER.fullmatch(_stem(file))
        if match and file not in here and (match[1], int(match[2]) - 1) in known:
            further.append(file)
            known.add((match[1], int(match[2])))
    return further


def _present(path: Path) -> list[Path]:
    """Return the files of a recording in `path`, those of MCAP if there are any."""
    for suffix in _STORAGES.values():
        names = [suffix, *(suffix + packed for packed in COMPRESSED_SUFFIXES)]
        found = [file for file in path.iterdir() if any(file.name.endswith(name) for name in names)]
        found = [file for file in found if file.is_file() and not file.name.startswith('.')]
        if found:
            return sorted(found, key=_order)
    return []


def _is_contiguous(paths: list[Path]) -> bool:
    numbers = [_order(path)[0] for path in paths]
    return numbers == list(range(len(numbers)))


def _order(path: Path) -> tuple[int, str]:
    match = _NUMBER.fullmatch(_stem(path))
    return (int(match[2]) if match else 0, path.name)


def _stem(path: Path) -> str:
    return path.name.split('.')[0] if path.suffix in COMPRESSED_SUFFIXES else path.stem
