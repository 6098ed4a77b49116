"""Which of the files in a store belong together as recordings."""

import hashlib
import os
import re
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from itertools import groupby

from mount_bags.bag.metadata import METADATA_NAME
from mount_signals.sources.local import local_path
from mount_signals.sources.source import Entry
from mount_signals.sources.stores import entries
from mount_signals.sources.uris import is_uri, scheme_of

_RECORDED = re.compile(r'(?P<stem>.+?)\.(mcap|db3)(\.(zstd|lz4|zst))?')
_PIECE = re.compile(r'(?P<name>.+)_\d+')


@dataclass(frozen=True)
class Place:
    """Where a recording lies, its name below what was given, and what changes when its files do."""

    uri: str
    recording: str
    size: int
    fingerprint: str


def places(uris: Iterable[str]) -> dict[str, Place]:
    """Return the recordings at or below `uris`, by URI in the order of these; raises `SourceError`."""
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


def below(uri: str, roots: Iterable[str]) -> bool:
    """Return whether `uri` is one of `roots` or lies below one."""
    return any(uri == root or uri.startswith(f'{root.rstrip("/")}/') for root in map(root_of, roots))


def _places(root: str) -> Iterator[Place]:
    relevant = [entry for entry in entries(root) if _is_part(_last(entry.uri))]
    for folder, group in groupby(
        sorted(relevant, key=_folder_and_name), key=lambda entry: _folder(entry.uri)
    ):
        files = list(group)
        if _is_one(folder, files):
            # of the folder itself its name is told, of one below it the way to it
            yield _place(folder, folder[len(root) :].strip('/') or _last(folder), files)
        else:
            for file in files:
                if _RECORDED.fullmatch(_last(file.uri)):
                    yield _place(file.uri, file.uri[len(root) :].strip('/') or _last(file.uri), [file])


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
