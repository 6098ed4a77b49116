"""Bytes out of a store, counted: a stretch of a file, or a file from somewhere on to its end."""

import threading
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

from engine_mount.signals.sources.filesystems import filesystem
from engine_mount.signals.sources.source import SourceError
from engine_mount.signals.sources.uris import scheme_of, shown

BLOCK = 16 << 20  # bytes, chosen: of one request
_PART = 1 << 20  # bytes, chosen: taken at once from a stream
_PARTIAL = 206  # status of HTTP: only the part that was asked for


@dataclass(frozen=True)
class Traffic:
    """What this process took from stores: bytes and requests; local files are none."""

    bytes: int
    requests: int


_taken = Traffic(0, 0)
_one_at_a_time = threading.Lock()


def traffic() -> Traffic:
    """Return what this process took from stores so far."""
    return _taken


def count(size: int, requests: int = 0) -> None:
    """Add to what this process took from stores."""
    global _taken
    with _one_at_a_time:
        _taken = Traffic(_taken.bytes + size, _taken.requests + requests)


def stretch(uri: str, begin: int, end: int) -> bytes:
    """Return the bytes from `begin` to `end` of a file; raises whatever the store raises."""
    if end <= begin:
        return b''
    files, path = filesystem(uri)
    count(0, 1)
    if scheme_of(uri) in ('sftp', 'ssh'):
        with files.open(path, 'rb') as file:
            file.seek(begin)
            found = bytes(file.read(end - begin))
    else:
        found = bytes(files.cat_file(path, start=begin, end=end))
    count(len(found))
    if len(found) > end - begin:  # a server that knows no stretches sends all
        found = found[begin:end]
    if len(found) != end - begin:
        raise ConnectionError(f'{len(found)} bytes came instead of {end - begin}')
    return found


def blocks(uri: str, begin: int, size: int) -> Iterator[bytes]:
    """Yield a file of `size` bytes from `begin` on, over one connection; raises what the store raises."""
    files, path = filesystem(uri)
    scheme = scheme_of(uri)
    if scheme in ('http', 'https'):
        parts = _streamed(files, path, begin, size)
    elif scheme in ('sftp', 'ssh'):
        parts = _read_on(files, path, begin, size)
    else:
        parts = (stretch(uri, place, min(place + BLOCK, size)) for place in range(begin, size, BLOCK))
    for part in parts:
        begin += len(part)
        yield part
    if begin < size:
        raise ConnectionError(f'the connection ended after {begin} of {size} bytes')


def _read_on(files: Any, path: str, begin: int, size: int) -> Iterator[bytes]:
    count(0, 1)
    with files.open(path, 'rb') as file:
        file.seek(begin)
        while begin < size and (part := bytes(file.read(min(BLOCK, size - begin)))):
            begin += len(part)
            count(len(part))
            yield part


def _streamed(files: Any, path: str, begin: int, size: int) -> Iterator[bytes]:
    """Yield what one answer of a server sends; one that knows no stretches sends again what came before."""
    headers = {**files.kwargs.get('headers', {}), 'Accept-Encoding': 'identity'}
    if begin:
        headers['Range'] = f'bytes={begin}-'
    count(0, 1)
    with files.open(path, 'rb', block_size=0, size=size, headers=headers) as stream:
        skip = begin if stream.r.status != _PARTIAL else 0
        left = size - begin + skip
        while left > 0 and (part := bytes(stream.read(_PART))):
            count(len(part))
            left -= len(part)
            if left < 0:
                raise SourceError(f'{shown(path)}: more than the {size} bytes came that the server told of')
            kept = part[min(skip, len(part)) :]
            skip -= len(part) - len(kept)
            if kept:
                yield kept
