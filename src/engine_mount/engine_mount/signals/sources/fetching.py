"""One file out of a store: block by block, gone on with where a connection broke, then checked."""

import os
from collections.abc import Callable, Iterator
from pathlib import Path

from engine_mount.signals.sources.checksums import hash_of
from engine_mount.signals.sources.looking import Found, changed, look, same, with_digest
from engine_mount.signals.sources.patience import Attempts, Patience, persistent
from engine_mount.signals.sources.reading import blocks
from engine_mount.signals.sources.source import SourceError
from engine_mount.signals.sources.uris import shown

_TRIALS = 2  # chosen: of a file whose checksum is wrong


def reserve(found: Found, target: Path) -> None:
    """Make the file at `target` with all the room that it needs; raises `OSError` on a full disk."""
    target.parent.mkdir(parents=True, exist_ok=True)
    handle = os.open(target, os.O_WRONLY | os.O_CREAT | os.O_CLOEXEC, 0o600)
    try:
        if found.entry.size:
            os.posix_fallocate(handle, 0, found.entry.size)
    finally:
        os.close(handle)


def fetch_file(found: Found, target: Path, patience: Patience, tell: Callable[[int], None]) -> None:
    """Write a file of a store to `target`, which `reserve` made; `tell` takes how many bytes came each time.

    Where the checksum is wrong it is fetched once more. Raises `SourceError` where the store gives it not, or
    other bytes than it told of, and `OSError` of this disk.
    """
    found = persistent(found.entry.uri, lambda: with_digest(found), patience)
    if found.digest is None:
        _bring(found, target, patience, tell)
        _check_unchanged(found, patience)
        return
    for _ in range(_TRIALS):
        if _bring(found, target, patience, tell) == found.digest.value:
            return
        _check_unchanged(found, patience)
        tell(-found.entry.size)
    raise SourceError(
        f'{shown(found.entry.uri)}: what came, {_TRIALS} times, has another checksum '
        f'({found.digest.algorithm}) than the store tells; the file there, or the way to it, is damaged'
    )


def _bring(found: Found, target: Path, patience: Patience, tell: Callable[[int], None]) -> str:
    """Write the file, and return its checksum by the algorithm that the store uses, '' where it has none."""
    uri, size, place = found.entry.uri, found.entry.size, 0
    attempts = Attempts(uri, patience)
    digest = hash_of(found.digest.algorithm) if found.digest else None
    with target.open('r+b', buffering=0) as file:
        while place < size:
            for block in _until_it_breaks(uri, place, size, attempts):
                write_whole(file.fileno(), block, place)
                if digest is not None:
                    digest.update(block)
                place += len(block)
                tell(len(block))
        os.fsync(file.fileno())
    return digest.hexdigest() if digest is not None else ''


def write_whole(handle: int, data: bytes, place: int) -> None:
    """Write all of `data` at `place` of an open file; raises `OSError`."""
    rest = memoryview(data)
    while rest:
        done = os.pwrite(handle, rest, place)
        rest, place = rest[done:], place + done


def _until_it_breaks(uri: str, begin: int, size: int, attempts: Attempts) -> Iterator[bytes]:
    """Yield blocks; where the connection breaks, wait and end, so that it is gone on with from there."""
    stream = blocks(uri, begin, size)
    while True:
        try:
            block = next(stream, None)
        except Exception as error:  # of any library below fsspec
            attempts.failed(error)
            return
        if block is None:
            return
        attempts.progress()
        yield block


def _check_unchanged(found: Found, patience: Patience) -> None:
    now = persistent(found.entry.uri, lambda: look(found.entry.uri), patience)
    if now is None or not same(now.entry, found.entry):
        raise changed(found.entry.uri)
