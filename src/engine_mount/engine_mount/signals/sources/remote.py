"""Stores that fsspec reaches: their files listed, and fetched whole into the local cache."""

import contextlib
import errno
import hashlib
import importlib
import logging
import random
import time
from collections.abc import Callable, Iterator
from functools import partial
from math import nan
from pathlib import Path, PurePosixPath
from typing import Any, TypeVar
from urllib.parse import unquote, urlsplit

from engine_mount.signals.signal import MissingLibraryError, required
from engine_mount.signals.sources.cache import cached_copy
from engine_mount.signals.sources.uris import (
    Entry,
    SourceError,
    StoreAwayError,
    checked,
    inside,
    name_of,
    scheme_of,
    shown,
)

T = TypeVar('T')
Progress = Callable[[int, int], None]
"""Takes how many bytes are here, and of how many."""

CONNECT = 10.0  # s, chosen: within it a server answers, or the connection counts as broken
SILENCE = 30.0  # s, chosen: without a byte for so long, it counts as broken
ATTEMPTS = 8  # chosen: with the pauses between them a store may be away for 20 s
FIRST_PAUSE, LONGEST_PAUSE = 0.5, 8.0  # s, chosen: doubled each time, shortened by chance by up to a quarter

_KEYS = {
    's3': "who reads stands in ~/.aws, in AWS_PROFILE or AWS_ACCESS_KEY_ID, or in fsspec's configuration",
    'gs': 'gcloud auth application-default login, or GOOGLE_APPLICATION_CREDENTIALS, says who reads',
    'ssh': 'ssh to this host must work without a question: a key in the agent or in ~/.ssh/config',
    'http': "what the server wants to know stands in fsspec's configuration, as client_kwargs of http",
}
_REFUSED = {  # exceptions of the libraries below fsspec, by name: they are not loaded here
    'DefaultCredentialsError', 'KeyEncryptionError', 'KeyImportError',
    'NoCredentialsError', 'PartialCredentialsError', 'PermissionDenied', 'ProfileNotFound',
    'ClientConnectorCertificateError', 'SFTPPermissionDenied', 'PermissionError',
}  # fmt: skip
_PASSING_STATUS = (408, 425, 429)  # HTTP: too slow, too early, too often
_OF_THIS_DISK = (errno.ENOSPC, errno.EDQUOT, errno.EFBIG, errno.EROFS)
_MARKS = ('ETag', 'etag', 'LastModified', 'mtime', 'updated', 'Last-Modified', 'created')


RemoteFile = tuple[Entry, PurePosixPath]
"""A file in a store, and its place in the folder that was listed; `.` for the file itself."""


def list_files(uri: str) -> list[RemoteFile]:
    """Return the file at `uri`, or those in that folder, without hidden ones; raises `SourceError`."""
    checked(uri)
    return _retry(uri, lambda: _list_files(uri))


@contextlib.contextmanager
def remote_copy(uri: str, progress: Progress) -> Iterator[Path]:
    """Give a whole local copy of the file or folder at `uri` as long as the block lasts.

    Raises `SourceError`, also where the store has other files or sizes after the transfer than before.
    """
    files = list_files(uri)
    if not files:
        raise SourceError(f'{shown(uri)}: an empty folder')
    name = name_of(uri)
    if name in ('', '.', '..') or '/' in name:
        name = 'recording'
    size = sum(entry.size for entry, _ in files)

    def fill(folder: Path) -> None:
        done = 0
        for entry, place in files:
            target = folder / name / place
            target.parent.mkdir(parents=True, exist_ok=True)
            _fetch(entry, target, done, size, progress)
            done += entry.size
        if list_files(uri) != files:
            raise SourceError(
                f'{shown(uri)} was changed while it was fetched; fetch it once its writer has ended'
            )

    # the same only while all files are as they are
    key = hashlib.sha256(repr(files).encode()).hexdigest()[:32]
    with cached_copy(key, name, size, fill) as path:
        yield path


def _list_files(uri: str) -> list[RemoteFile]:
    files, path = _filesystem(uri)
    if not uri.endswith('/') and (info := files.info(path))['type'] != 'directory':
        return [(_entry(uri, info), PurePosixPath('.'))]
    listed = files.find(path, detail=True)
    if not listed and not files.isdir(path):
        raise FileNotFoundError(uri)
    found = []
    for name, info in listed.items():
        place = PurePosixPath(name.removeprefix(path.rstrip('/')).lstrip('/'))
        if any(part.startswith('.') for part in place.parts):  # `..` would lead out of the folder
            continue
        if info['type'] == 'link' or info.get('size') is None:  # links of SFTP, all files by HTTP
            info = files.info(name)
        if info['type'] != 'directory':
            found.append((_entry(inside(uri, str(place)), info), place))
    return sorted(found, key=lambda file: file[0].uri)


def _entry(uri: str, info: dict[str, Any]) -> Entry:
    if info.get('size') is None:
        raise SourceError(
            f'{shown(uri)}: the server does not tell the size, without which half a file is a whole one'
        )
    mark = next((str(info[name]) for name in _MARKS if info.get(name)), '')
    return Entry(uri, int(info['size']), nan, mark.strip('"'))


def _fetch(entry: Entry, target: Path, done: int, size: int, progress: Progress) -> None:
    """Write a file of a store to `target`, behind `done` of `size` bytes of its folder.

    Raises `SourceError`, and `OSError` of this disk.
    """
    from fsspec.callbacks import Callback
    from fsspec.spec import AbstractFileSystem

    def work() -> None:
        files, path = _filesystem(entry.uri)
        # sshfs itself would copy a link as a link
        get_file = (
            partial(AbstractFileSystem.get_file, files) if _kind(entry.uri) == 'ssh' else files.get_file
        )
        hooks = {'bar': lambda total, value: progress(done + value, size)}
        get_file(path, str(target), callback=Callback(hooks=hooks))
        if target.stat().st_size != entry.size:
            raise ConnectionError(f'{target.stat().st_size} bytes came instead of {entry.size}')

    target.touch(mode=0o600)
    _retry(entry.uri, work)


def _retry(uri: str, work: Callable[[], T]) -> T:
    """Return what `work` returns, repeated where the connection breaks; raises `SourceError`."""
    begin, pause, reason = time.monotonic(), FIRST_PAUSE, ''
    for attempt in range(ATTEMPTS):
        if attempt:
            time.sleep(pause * random.uniform(0.75, 1.0))
            pause = min(LONGEST_PAUSE, 2.0 * pause)
            _filesystem_class(uri).clear_instance_cache()  # a connection that broke stays broken
        try:
            return work()
        except (SourceError, MissingLibraryError):
            raise
        except Exception as error:  # of any library below fsspec
            if isinstance(error, OSError) and error.errno in _OF_THIS_DISK:
                raise
            reason, remedy = _reason(error, uri)
            if remedy:
                raise SourceError(f'{shown(uri)}: {reason}; {remedy}') from error
    raise StoreAwayError(
        f'{shown(uri)}: {reason} ({ATTEMPTS} attempts within {time.monotonic() - begin:.0f} s); is the store '
        'reachable from here?'
    )


def _reason(error: BaseException, uri: str) -> tuple[str, str]:
    """Return the reason in one line, and the remedy where another attempt would fail as well, else ''."""
    cause = error.__cause__  # HTTP of fsspec calls `not found` whatever went wrong on the way
    missing = isinstance(error, FileNotFoundError)
    if missing and cause and (isinstance(cause, OSError) or type(cause).__module__.startswith('aiohttp')):
        error, missing = cause, isinstance(cause, FileNotFoundError)
    code = str(getattr(error, 'status', None) or getattr(error, 'code', None))
    status = int(code) if code.isdecimal() else 0
    classes = {kind.__name__ for kind in type(error).__mro__}
    words = f'{type(error).__name__}: {" ".join(str(error).split())}'.removesuffix(': ')
    if 'HostKeyNotVerifiable' in classes:
        return words, 'connect once with ssh, check the key of the host and keep it in ~/.ssh/known_hosts'
    if status in (401, 403) or classes & _REFUSED or str(error).startswith('Forbidden'):  # the last of gcsfs
        return words, _KEYS.get(_kind(uri), 'is this folder yours?')
    remedy = 'engine-mount ls lists a folder'
    if missing or status in (404, 410):
        return 'nothing of this name is there', remedy
    lasting = isinstance(error, NotADirectoryError | IsADirectoryError | ValueError | TypeError)
    return words, remedy if lasting or (400 <= status < 500 and status not in _PASSING_STATUS) else ''


def _kind(uri: str) -> str:
    return {'sftp': 'ssh', 'https': 'http'}.get(scheme_of(uri), scheme_of(uri))


def _filesystem_class(uri: str) -> Any:
    """Return the class of fsspec behind a scheme; raises `MissingLibraryError`."""
    kind, what = _kind(uri), f'reading {shown(uri)}'
    fsspec = required('fsspec', what)
    if kind == 'ssh':
        return required('sshfs', what).SSHFileSystem
    if kind == 's3':
        required('s3fs', what)
    elif kind == 'gs':
        required('gcsfs', what)
    elif kind == 'http':
        required('aiohttp', what)
    return fsspec.get_filesystem_class(scheme_of(uri))


def _filesystem(uri: str) -> tuple[Any, str]:
    """Return the file system of fsspec for `uri`, connected where it needs that, and the path in it.

    Keys and passwords come from fsspec's configuration, from AWS's and Google's own files and variables,
    and from ssh's agent, keys and config. Raises whatever fsspec raises.
    """
    kind, files = _kind(uri), _filesystem_class(uri)
    logging.getLogger('asyncio').addFilter(_is_new)
    own = importlib.import_module('fsspec').config.conf
    if kind == 'ssh':
        # sshfs itself reads no configuration of fsspec
        parts = urlsplit(uri)
        options = {
            'known_hosts': (),  # of the user, as ssh does; by itself sshfs trusts any host
            'connect_timeout': CONNECT,
            'login_timeout': SILENCE,
            'keepalive_interval': CONNECT,
            'keepalive_count_max': 3,
            **own.get('ssh', {}),
            **own.get('sftp', {}),
            'host': parts.hostname or '',
        }
        if parts.port:
            options['port'] = parts.port
        if parts.username:
            options['username'] = unquote(parts.username)
        path = uri.partition('://')[2].partition('/')[2]
        return files(**options), f'/{path.rstrip("/")}'
    options = {**files._get_kwargs_from_urls(uri), 'use_listings_cache': False}
    if kind == 'http':
        aiohttp = importlib.import_module('aiohttp')
        timeout = aiohttp.ClientTimeout(total=None, sock_connect=CONNECT, sock_read=SILENCE)
        plain = {'timeout': timeout, 'headers': {'Accept-Encoding': 'identity'}}
        options['client_kwargs'] = {**plain, **own.get(scheme_of(uri), {}).get('client_kwargs', {})}
    elif kind == 's3':
        once = {'connect_timeout': CONNECT, 'read_timeout': SILENCE, 'retries': {'total_max_attempts': 1}}
        options['config_kwargs'] = {**once, **own.get('s3', {}).get('config_kwargs', {})}
    made = files(**options)
    if kind == 's3':
        made.retries = 1
    return made, files._strip_protocol(uri)


def _is_new(record: logging.LogRecord) -> bool:
    """Return whether a line of asyncio says more than the error that a broken connection raises as well."""
    return not record.getMessage().startswith(('Task exception was never', 'socket.send() raised'))
