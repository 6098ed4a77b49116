"""Recordings by URI: listed, and fetched whole; how places are written and shown, and the errors of stores.

A plain path is used unchanged, without loading a library.
"""

import atexit
import contextlib
import os
import re
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import NamedTuple
from urllib.parse import parse_qsl, unquote, urlsplit, urlunsplit

SCHEMES = ('file', 's3', 'sftp', 'ssh', 'gs', 'http', 'https', 'memory')
"""What can be fetched; `memory` holds what the same process put there, for tests."""
_URI = re.compile(r'([a-zA-Z][a-zA-Z0-9+.-]*)://')
_WITH_QUERY = ('http', 'https', 's3')  # elsewhere a question mark is a letter of a name
_SECRET = re.compile(r'(.*[-_])?((aws)?(api|access)?key(id)?|password|secret|sig|signature|token|credential)')
"""Names of query parameters, in small letters, that hold what permits reading."""
_kept: dict[Path, str] = {}
"""The copies that this process keeps, with their URIs."""
_held = contextlib.ExitStack()
atexit.register(_held.close)


class SourceError(OSError):
    """A recording cannot be fetched; the text says from where, why, and what would help."""


class StoreAwayError(SourceError):
    """A store did not answer in any attempt; the text says how many there were."""


class Entry(NamedTuple):
    """A file in a store: its URI, size in bytes, and what changes when its content does.

    `modified` is in s since 1970 on a disk, else NaN; `etag` is the store's own mark, or its time of change.
    """

    uri: str
    size: int
    modified: float
    etag: str


def entries(uri: str) -> Iterator[Entry]:
    """Yield every file at or below `uri`, sorted by URI, hidden ones left out; raises `SourceError`."""
    if not is_local(uri):
        from engine_mount.signals.sources.remote import list_files

        yield from (entry for entry, _ in list_files(uri))
        return
    place = local_path(uri)
    found = (file for file in place.rglob('*') if not file.is_dir()) if place.is_dir() else [place]
    for path in sorted(found):
        if any(part.startswith('.') for part in path.relative_to(place).parts):
            continue
        try:
            status = path.stat()
        except OSError as error:
            raise SourceError(f'{path}: {error.strerror}') from None
        yield Entry(str(path), status.st_size, status.st_mtime, '')


def fetched(uri: str, progress: Callable[[int, int], None] = lambda done, of: None) -> Path:
    """Return a whole local copy of the file or folder at `uri`, kept until this process ends.

    A plain path and file:// are returned where they lie; `progress` takes how many bytes are here, and of
    how many. A loop over many recordings uses `local_copy`, whose copy can be removed. Raises `SourceError`.
    """
    path = _held.enter_context(local_copy(uri, progress))
    if not is_local(uri):
        _kept[path] = uri
    return path


@contextlib.contextmanager
def local_copy(uri: str, progress: Callable[[int, int], None] = lambda done, of: None) -> Iterator[Path]:
    """Give a whole local copy of the file or folder at `uri` for as long as the block lasts.

    Within the block nothing removes it; afterwards it stays in the cache until the room is needed.
    Raises `SourceError`.
    """
    if is_local(uri):
        place = local_path(uri)
        if not place.exists():
            raise SourceError(f'{place}: no such file or folder')
        yield place
        return
    from engine_mount.signals.sources.remote import remote_copy

    with remote_copy(uri, progress) as path:
        yield path


def uri_of(path: str | os.PathLike[str]) -> str:
    """Return the URI that `fetched` got the local `path` from, or what it lies in; '' for any other path."""
    return next((_kept[place] for place in (Path(path), *Path(path).parents) if place in _kept), '')


def is_uri(text: str) -> bool:
    """Return whether `text` is a URI, such as s3://bucket/drive.mcap; anything else is a path."""
    return _URI.match(text) is not None


def is_local(uri: str) -> bool:
    """Return whether `uri` is a path or file://; raises `SourceError` for an unknown scheme."""
    return not is_uri(uri) or scheme_of(uri) == 'file'


def local_path(uri: str) -> Path:
    """Return what a file:// URI or a plain path means; raises `SourceError` for another machine's."""
    if not is_uri(uri):
        return Path(uri)
    machine = urlsplit(uri).netloc
    if machine not in ('', 'localhost'):
        raise SourceError(
            f'{uri} names the machine {machine}; a path of this machine has three slashes, '
            'as in file:///data/a.mcap'
        )
    return Path(unquote(uri.partition('://')[2].removeprefix(machine)))


def scheme_of(uri: str) -> str:
    """Return the scheme of a URI in small letters; raises `SourceError` for one that is not supported."""
    match = _URI.match(uri)
    scheme = match[1].lower() if match else ''
    if scheme not in SCHEMES:
        known = ', '.join(f'{name}://' for name in SCHEMES if name != 'memory')
        raise SourceError(
            f'{shown(uri)}: nothing is fetched by {scheme or "no scheme"}://; known are {known}'
        )
    return scheme


def checked(uri: str) -> str:
    """Return `uri`; raises `SourceError` where its scheme is unknown or it holds a secret."""
    parts = urlsplit(uri)
    query = parse_qsl(parts.query) if scheme_of(uri) in _WITH_QUERY else []
    secrets = [f'what permits reading ({name})' for name, _ in query if _SECRET.fullmatch(name.lower())]
    if parts.password is not None:
        secrets.append('a password')
    if secrets:
        raise SourceError(
            f'{shown(uri)} holds {secrets[-1]}, which the history of the shell and the list of processes '
            'show to others; leave it out: keys belong in the configuration of fsspec, of AWS or of ssh '
            '(README of engine_mount.signals)'
        )
    return uri


def shown(uri: str) -> str:
    """Return `uri` for messages: without password, and of a query without values."""
    match = _URI.match(uri)
    if match is None:
        return uri
    authority, slash, path = uri[match.end() :].partition('/')
    user, at, host = authority.rpartition('@')
    if match[1].lower() in _WITH_QUERY and '?' in path:
        path = path.partition('?')[0] + '?...'
    return f'{match[1]}://{user.partition(":")[0]}{at}{host}{slash}{path}'


def name_of(uri: str) -> str:
    """Return the last part of a path, or of the path of a URI: the name of a local copy."""
    if not is_uri(uri):
        return Path(uri).name or uri
    scheme = scheme_of(uri)
    path = uri.partition('://')[2]
    if scheme in _WITH_QUERY:
        path = path.partition('?')[0]
    last = path.rstrip('/').rpartition('/')[2]
    return unquote(last) if scheme in ('http', 'https', 'file') else last


def inside(uri: str, relative: str) -> str:
    """Return the URI of what lies at `relative` below `uri`."""
    parts = urlsplit(uri)
    if parts.scheme.lower() in ('http', 'https') and parts.query:
        return urlunsplit(parts._replace(path=f'{parts.path.rstrip("/")}/{relative}'))
    return f'{uri.rstrip("/")}/{relative}'
