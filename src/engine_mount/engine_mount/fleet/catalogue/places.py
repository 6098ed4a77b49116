"""Which of the files in a store belong together as recordings, and which are files of others."""

import hashlib
import os
import re
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from itertools import groupby

from engine_mount.signals.sources.source import Entry
from engine_mount.signals.sources.stores import entries
from engine_mount.signals.sources.uris import is_uri, local_path, scheme_of
from mount_recorder.metadata import METADATA_NAME

_RECORDED = re.compile(r'(?P<stem>.+?)\.(mcap|db3)(\.(zstd|lz4|zst))?')
_OF_OTHERS = (
    '.csv', '.txt', '.tsv', '.dat', '.json', '.jsonl', '.ndjson', '.npy', '.npz', '.parquet', '.mat', '.h5',
    '.hdf5', '.xlsx', '.mf4', '.mdf', '.blf', '.asc', '.trc', '.log',
)  # fmt: skip
"""How the names of files end that `engine_mount.signals.formats` reads, beside recordings."""
_TIMES = '_t.npy'  # of the file `_value.npy` beside it
_ARRAYS = ({'t', 'value'}, {'times', 'values'}, {'t.npy', 'value.npy'})
"""Files of a folder that is read as a whole."""
_PIECE = re.compile(r'(?P<name>.+)_\d+')


_TABLES = ('recordings.parquet', 'result.parquet', 'order.json')
"""Files of a catalogue or result: nothing beside or below them is a recording of others."""


@dataclass(frozen=True)
class Place:
    """Where a recording lies, its name below what was given, and what changes when its files do."""

    uri: str
    recording: str
    size: int
    fingerprint: str


def places(uris: Iterable[str], *, others: bool = False) -> dict[str, Place]:
    """Return the recordings at or below `uris`, by URI in the order of these; raises `SourceError`.

    A file that is itself named is one, whatever it is; with `others` so are all below `uris` that may be of
    others, but those in the folder of a run or of the tables of a fleet.
    """
    found: dict[str, Place] = {}
    for root in map(root_of, uris):
        for place in _places(root, others):
            found.setdefault(place.uri, place)
    return dict(sorted(found.items()))


def root_of(uri: str) -> str:
    """Return a place as a catalogue names it: on this machine its whole path, wherever it is named from."""
    if is_uri(uri) and scheme_of(uri) != 'file':
        return uri.rstrip('/')
    return os.path.abspath(local_path(uri))


def below(uri: str, roots: Iterable[str]) -> bool:
    """Return whether `uri` is one of `roots` or lies below one."""
    return any(uri == root or uri.startswith(f'{root.rstrip("/")}/') for root in map(root_of, roots))


def _places(root: str, others: bool) -> Iterator[Place]:
    every = list(entries(root))
    relevant = [entry for entry in every if _is_part(_last(entry.uri))]
    whole = set()
    for folder, group in groupby(
        sorted(relevant, key=_folder_and_name), key=lambda entry: _folder(entry.uri)
    ):
        files = list(group)
        if _is_one(folder, files):
            yield _place(folder, _below_root(folder, root), files)
            whole.add(folder if _last(folder) != 'recording' else _folder(folder))
        else:
            for file in files:
                if _RECORDED.fullmatch(_last(file.uri)):
                    yield _place(file.uri, _below_root(file.uri, root), [file])
    if every and not relevant and every[0].uri == root:
        yield _place(root, _last(root), every)
    elif others:
        yield from _of_others(root, every, whole)


def _of_others(root: str, every: list[Entry], recordings: set[str]) -> Iterator[Place]:
    """Yield the files that may be of others, and folders of arrays, outside the folders of `recordings`."""
    tables = {_folder(entry.uri) for entry in every if _last(entry.uri) in _TABLES}
    for folder, group in groupby(sorted(every, key=_folder_and_name), key=lambda entry: _folder(entry.uri)):
        files = list(group)
        if _is_within(folder, recordings | tables, root):
            continue
        if any(pair <= {_last(file.uri) for file in files} for pair in _ARRAYS):
            yield _place(folder, _below_root(folder, root), files)
            continue
        for file in files:
            name = _last(file.uri).lower()
            if name.endswith(_OF_OTHERS) and not name.endswith(_TIMES):
                yield _place(file.uri, _below_root(file.uri, root), [file])


def _is_within(folder: str, others: set[str], root: str) -> bool:
    """Return whether a folder, or one above it up to `root`, is among others."""
    while len(folder) >= len(root):
        if folder in others:
            return True
        folder = _folder(folder)
    return False


def _below_root(uri: str, root: str) -> str:
    """Return the way from `root` to `uri`, of `root` itself its name."""
    return uri[len(root) :].strip('/') or _last(uri)


def _is_one(folder: str, files: list[Entry]) -> bool:
    """Return whether the files of a folder are one recording: described as such, or named as its pieces."""
    names = [_last(file.uri) for file in files]
    if METADATA_NAME in names:
        return True
    stems = {match['stem'] for name in names if (match := _RECORDED.fullmatch(name))}
    pieces = {match['name'] if (match := _PIECE.fullmatch(stem)) else '' for stem in stems}
    return pieces == {_last(folder)}


def _place(uri: str, recording: str, files: list[Entry]) -> Place:
    told = '\n'.join(f'{_last(file.uri)} {file.size} {file.modified!r} {file.etag}' for file in files)
    mark = hashlib.sha256(told.encode()).hexdigest()[:32]
    return Place(uri, recording, sum(file.size for file in files), mark)


def _is_part(name: str) -> bool:
    return name == METADATA_NAME or _RECORDED.fullmatch(name) is not None


def _folder_and_name(entry: Entry) -> tuple[str, str]:
    return _folder(entry.uri), _last(entry.uri)


def _folder(uri: str) -> str:
    return uri.rpartition('/')[0]


def _last(uri: str) -> str:
    return uri.rpartition('/')[2]
