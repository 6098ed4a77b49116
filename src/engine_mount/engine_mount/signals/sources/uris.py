"""Addresses of recordings: what is a URI and what a path; one that holds a secret is refused."""

import re
from urllib.parse import parse_qsl, unquote, urlsplit, urlunsplit

from engine_mount.signals.sources.source import SourceError

SCHEMES = ('file', 's3', 'sftp', 'ssh', 'gs', 'http', 'https', 'memory')
"""What can be fetched; `memory` holds what the same process put there, for tests."""
_URI = re.compile(r'([a-zA-Z][a-zA-Z0-9+.-]*)://')
_WITH_QUERY = ('http', 'https', 's3')  # elsewhere a question mark is a letter of a name
_SECRETS = {  # names of query parameters, in small letters, that hold what permits reading
    'access_token', 'api_key', 'apikey', 'awsaccesskeyid', 'key', 'password', 'secret', 'sig',
    'signature', 'token', 'x-amz-credential', 'x-amz-security-token', 'x-amz-signature',
    'x-goog-credential', 'x-goog-signature',
}  # fmt: skip


def is_uri(text: str) -> bool:
    """Return whether `text` is a URI, such as s3://bucket/drive.mcap; anything else is a path."""
    return _URI.match(text) is not None


def scheme_of(uri: str) -> str:
    """Return the scheme of a URI in small letters; raises `SourceError` where nothing is fetched by it."""
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
    scheme = scheme_of(uri)
    parts = urlsplit(uri)
    inside = 'a password' if parts.password is not None else ''
    if scheme in _WITH_QUERY and (
        found := [name for name, _ in parse_qsl(parts.query) if name.lower() in _SECRETS]
    ):
        inside = f'what permits reading ({found[0]})'
    if inside:
        raise SourceError(
            f'{shown(uri)} holds {inside}, which the history of the shell and the list of processes '
            'tell others; leave it out: keys belong in the configuration of fsspec, of AWS or of ssh '
            '(README of engine_mount.signals)'
        )
    return uri


def shown(uri: str) -> str:
    """Return `uri` as it may be told: without password, and of a query without values."""
    match = _URI.match(uri)
    if match is None:
        return uri
    scheme, rest = match[1].lower(), uri[match.end() :]
    authority, slash, path = rest.partition('/')
    user, at, host = authority.rpartition('@')
    authority = f'{user.partition(":")[0]}{at}{host}'
    if scheme in _WITH_QUERY and '?' in path:
        path = path.partition('?')[0] + '?...'
    return f'{match[1]}://{authority}{slash}{path}'


def name_of(uri: str) -> str:
    """Return the last part of a path: what a local copy is called."""
    scheme = scheme_of(uri)
    path = uri.partition('://')[2].rstrip('/')
    if scheme in _WITH_QUERY:
        path = path.partition('?')[0].rstrip('/')
    last = path.rpartition('/')[2]
    return unquote(last) if scheme in ('http', 'https', 'file') else last


def inside(uri: str, relative: str) -> str:
    """Return the URI of what lies at `relative` below `uri`."""
    parts = urlsplit(uri)
    if parts.scheme.lower() in ('http', 'https') and parts.query:
        return urlunsplit(parts._replace(path=f'{parts.path.rstrip("/")}/{relative}'))
    return f'{uri.rstrip("/")}/{relative}'
