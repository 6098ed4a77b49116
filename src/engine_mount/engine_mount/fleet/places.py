"""The recordings at and below folders and URIs, and those of catalogues."""

import hashlib
import os
import re
from collections import defaultdict
from collections.abc import Iterable, Iterator, Sequence
from pathlib import Path
from typing import NamedTuple

from engine_mount.signals.signal import required
from engine_mount.signals.sources.stores import entries
from engine_mount.signals.sources.uris import Entry, SourceError, is_uri, local_path, scheme_of, shown
from mount_recorder.metadata import METADATA_NAME

NEEDED_FOR = 'a table of a fleet'
"""What a missing library is needed for."""
_RECORDED = re.compile(r'(?P<stem>.+?)\.(mcap|db3)(\.(zstd|lz4|zst))?')
_PIECE = re.compile(r'(?P<name>.+)_\d+')


class SelectionError(ValueError):
    """Places hold no recording, or one name means two; the text says which."""


class Place(NamedTuple):
    """Where a recording lies, its name below that place, its size (bytes), and a mark of its files."""

    uri: str
    recording: str
    size_bytes: int
    fingerprint: str


def places(uris: Iterable[str]) -> dict[str, Place]:
    """Return the recordings at or below `uris`, {URI: place} in the order of these; raises `SourceError`."""
    found: dict[str, Place] = {}
    for root in map(root_of, uris):
        for place in _places(root):
            found.setdefault(place.uri, place)
    return dict(sorted(found.items()))


def root_of(uri: str) -> str:
    """Return a place as a catalogue names it: on this machine its whole path, wherever it is named from."""
    if is_uri(uri) and scheme_of(uri) != 'file':
        return uri.rstrip('/')
    return os.path.abspath(local_path(uri))


def select_recordings(sources: Sequence[str]) -> list[Place]:
    """Return the recordings of catalogues and below URIs or paths, by their names.

    A catalogue is the folder of `engine-mount fleet index`, or its table recordings.parquet; it tells of
    files as they were when it was made. Raises `SelectionError`, or `SourceError` for a place that cannot be
    listed.
    """
    found: dict[str, Place] = {}
    for source in sources:
        table = Path(source) / 'recordings.parquet' if Path(source).is_dir() else Path(source)
        is_catalogue = table.suffix == '.parquet' and table.is_file()
        for place in _of_catalogue(table) if is_catalogue else places([source]).values():
            other = found.setdefault(place.recording, place)
            if other.uri != place.uri:
                raise SelectionError(
                    f'{place.recording} means two recordings: {shown(other.uri)} and {shown(place.uri)}; '
                    'name a folder that holds both'
                )
    if not found:
        raise SelectionError(f'no recording at {" or ".join(map(shown, sources))}')
    return [found[name] for name in sorted(found)]


def _of_catalogue(table: Path) -> list[Place]:
    parquet = required('pyarrow.parquet', NEEDED_FOR)
    columns = parquet.read_table(table, columns=['uri', 'recording', 'size_bytes', 'fingerprint']).to_pydict()
    rows = zip(*columns.values(), strict=True)  # one for each mount
    return list(dict.fromkeys(Place(uri, name, size or 0, mark or '') for uri, name, size, mark in rows))


def _places(root: str) -> Iterator[Place]:
    folders = defaultdict(list)
    for entry in (every := list(entries(root))):
        folder, name = _split(entry.uri)
        if name == METADATA_NAME or _RECORDED.fullmatch(name):
            folders[folder].append(entry)
    if not folders and every and every[0].uri == root:
        raise SourceError(
            f'{shown(root)} is no recording (*.mcap, *.db3, or a folder of these); engine-mount import makes '
            'one of a foreign file'
        )
    for folder, files in folders.items():
        if _is_one(_split(folder)[1], [_split(file.uri)[1] for file in files]):
            yield _place(folder, root, files)
            continue
        for file in files:
            yield _place(file.uri, root, [file])


def _is_one(folder: str, names: Sequence[str]) -> bool:
    """Return whether the files of a folder are one recording: described as such, or named as its pieces."""
    if METADATA_NAME in names:
        return True
    stems = [match['stem'] for name in names if (match := _RECORDED.fullmatch(name))]
    return {match['name'] if (match := _PIECE.fullmatch(stem)) else '' for stem in stems} == {folder}


def _place(uri: str, root: str, files: Sequence[Entry]) -> Place:
    described = '\n'.join(
        f'{_split(file.uri)[1]} {file.size} {file.modified!r} {file.etag}' for file in files
    )
    mark = hashlib.sha256(described.encode()).hexdigest()[:32]
    name = uri[len(root) :].strip('/') or _split(uri)[1]
    return Place(uri, name, sum(file.size for file in files), mark)


def _split(uri: str) -> tuple[str, str]:
    """Return the folder of a file, and its name."""
    folder, _, name = uri.rpartition('/')
    return folder, name
