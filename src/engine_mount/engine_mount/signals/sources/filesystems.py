"""The file systems of fsspec behind the schemes, with this project's limits of time and trust."""

import importlib
import logging
from typing import Any
from urllib.parse import unquote, urlsplit

from engine_mount.signals.extras import required
from engine_mount.signals.sources.uris import checked, scheme_of, shown

_CONNECT = 10.0  # s, chosen: within it a server answers, or the connection counts as broken
_SILENCE = 30.0  # s, chosen: without a byte for so long, it counts as broken
_SSH = ('sftp', 'ssh')
_HTTP = ('http', 'https')
_OF_A_BROKEN_CONNECTION = ('Task exception was never retrieved', 'socket.send() raised exception')


def filesystem(uri: str) -> tuple[Any, str]:
    """Return the file system of fsspec for `uri`, connected where it needs that, and the path in it.

    Keys and passwords come from fsspec's configuration, from AWS's and Google's own files and variables,
    and from ssh's agent, keys and config. Raises `SourceError` on a URI that is refused, and whatever
    fsspec raises.
    """
    scheme = scheme_of(checked(uri))
    what = f'reading {shown(uri)}'
    fsspec = required('fsspec', what)
    logging.getLogger('asyncio').addFilter(_is_told_by_no_error)
    if scheme == 's3':
        required('s3fs', what)
    elif scheme == 'gs':
        required('gcsfs', what)
    elif scheme in _HTTP:
        required('aiohttp', what)
    elif scheme in _SSH:
        required('sshfs', what)
        return _ssh(scheme, uri, fsspec)
    kind = fsspec.get_filesystem_class(scheme)
    options = {**kind._get_kwargs_from_urls(uri), 'use_listings_cache': False, **_options(scheme, fsspec)}
    files = kind(**options)
    if scheme == 's3':
        files.retries = 1
    return files, kind._strip_protocol(uri)


def forget_connections(uri: str) -> None:
    """Make the next `filesystem(uri)` connect anew: a connection that broke stays broken."""
    fsspec = importlib.import_module('fsspec')
    scheme = scheme_of(uri)
    if scheme == 'memory':
        return
    kind = (
        importlib.import_module('sshfs').SSHFileSystem
        if scheme in _SSH
        else fsspec.get_filesystem_class(scheme)
    )
    kind.clear_instance_cache()


def _ssh(scheme: str, uri: str, fsspec: Any) -> tuple[Any, str]:
    """Return the SFTP of the host: sshfs itself trusts any host key and reads no configuration of fsspec."""
    parts = urlsplit(uri)
    options: dict[str, Any] = {
        'known_hosts': (),  # of the user, as ssh does; by itself sshfs trusts any host
        'connect_timeout': _CONNECT,
        'login_timeout': _SILENCE,
        'keepalive_interval': _CONNECT,
        'keepalive_count_max': 3,
        **fsspec.config.conf.get('ssh', {}),
        **fsspec.config.conf.get('sftp', {}),
        'host': parts.hostname or '',
    }
    if parts.port:
        options['port'] = parts.port
    if parts.username:
        options['username'] = unquote(parts.username)
    path = uri.partition('://')[2].partition('/')[2]
    return importlib.import_module('sshfs').SSHFileSystem(**options), f'/{path.rstrip("/")}'


def _is_told_by_no_error(record: logging.LogRecord) -> bool:
    """Return whether what asyncio logs is more than what a connection that broke raises as well.

    A file is read in parallel: the first error is raised, those of the other requests nothing takes up.
    """
    return not record.getMessage().startswith(_OF_A_BROKEN_CONNECTION)


def _options(scheme: str, fsspec: Any) -> dict[str, Any]:
    """Return limits of time; how often is tried again is told in one place for all stores, `patience.py`."""
    if scheme in _HTTP:
        aiohttp = importlib.import_module('aiohttp')
        timeout = aiohttp.ClientTimeout(total=None, sock_connect=_CONNECT, sock_read=_SILENCE)
        own = fsspec.config.conf.get(scheme, {}).get('client_kwargs', {})
        return {'client_kwargs': {'timeout': timeout, **own}}
    if scheme == 's3':
        once = {'connect_timeout': _CONNECT, 'read_timeout': _SILENCE, 'retries': {'total_max_attempts': 1}}
        return {'config_kwargs': {**once, **fsspec.config.conf.get('s3', {}).get('config_kwargs', {})}}
    return {}
