"""Places by URI: how they are written and shown, a file in a store, and the errors of stores."""

import re
from pathlib import Path
from typing import NamedTuple
from urllib.parse import parse_qsl, unquote, urlsplit, urlunsplit


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


SCHEMES = ('file', 's3', 'sftp', 'ssh', 'gs', 'http', 'https', 'memory')
"""What can be fetched; `memory` holds what the same process put there, for tests."""
_URI = re.compile(r'([a-zA-Z][a-zA-Z0-9+.-]*)://')
_WITH_QUERY = ('http', 'https', 's3')  # elsewhere a question mark is a letter of a name
_SECRET = re.compile(r'(.*[-_])?((aws)?(api|access)?key(id)?|password|secret|sig|signature|token|credential)')
"""Names of query parameters, in small letters, that hold what permits reading."""


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
