"""Local copies of what was fetched: bounded, safe for several processes, never a part for the whole.

Each copy has a folder `<key>-<bytes>` with `lock`, `part` while it is fetched, and `copy` from when it is
whole. Who reads it holds the lock shared, who fetches or removes it holds it alone; the system gives a lock
free when its process ends, however it ends. The time of the lock's file is when the copy was last taken: the
oldest goes first.
"""

import contextlib
import errno
import fcntl
import os
import shutil
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path

from engine_mount.settings.amounts import size_in_bytes
from engine_mount.signals.sources.source import SourceError

FOLDER_VARIABLE, LIMIT_VARIABLE = 'ENGINE_MOUNT_CACHE', 'ENGINE_MOUNT_CACHE_LIMIT'
LIMIT = '20GB'  # chosen: about a hundred hours of one mount
_SPARE = 1 << 20  # bytes, chosen: left free on the disk beside what is fetched
_LOCK, _PART, _COPY, _ROOM = 'lock', 'part', 'copy', '.room'

Fill = Callable[[Path], None]
"""Writes files into a folder."""


@dataclass
class Held:
    """A copy that nothing removes until it is given free, or this process ends."""

    path: Path
    _handle: int

    def release(self) -> None:
        """Give it free; safe to call twice."""
        handle, self._handle = self._handle, -1
        if handle >= 0:
            os.close(handle)


def default_folder() -> Path:
    """Return where copies go: `ENGINE_MOUNT_CACHE`, else `engine_mount/recordings` in the user's cache."""
    base = os.environ.get('XDG_CACHE_HOME') or str(Path.home() / '.cache')
    return Path(os.environ.get(FOLDER_VARIABLE) or Path(base) / 'engine_mount' / 'recordings')


def default_limit() -> int:
    """Return how many bytes all copies may have; raises `ParameterError` where the variable holds no size."""
    return size_in_bytes(os.environ.get(LIMIT_VARIABLE) or LIMIT)


class Cache:
    """The copies in one folder, of at most `limit` bytes together."""

    def __init__(self, folder: Path, limit: int):
        self.folder = folder
        self.limit = limit

    def hold(self, key: str, name: str, size: int, reserve: Fill, fill: Fill) -> Held:
        """Return the copy called `name`, of `size` bytes, fetched by `fill` if it is not there.

        `reserve` takes the room on the disk for it before others do. Raises `SourceError` without room, and
        what `fill` raises; then nothing of it is left.
        """
        place = self.folder / f'{key}-{size}'
        with self._room_needed(name, size):
            while True:
                handle = _locked(place, fcntl.LOCK_SH)
                if (place / _COPY).is_dir():
                    os.utime(place / _LOCK)
                    return Held(place / _COPY / name, handle)
                os.close(handle)
                self._fill(place, name, size, reserve, fill)

    def _fill(self, place: Path, name: str, size: int, reserve: Fill, fill: Fill) -> None:
        """Make the copy, unless another process did meanwhile."""
        handle = _locked(place, fcntl.LOCK_EX)
        try:
            if (place / _COPY).is_dir():
                return
            part = place / _PART
            shutil.rmtree(part, ignore_errors=True)  # of a process that was killed
            with self._alone():
                self._make_room(place, name, size)
                part.mkdir()
                reserve(part)
            fill(part)
            part.rename(place / _COPY)
        except BaseException:
            shutil.rmtree(place, ignore_errors=True)
            raise
        finally:
            os.close(handle)

    def _make_room(self, wanted: Path, name: str, size: int) -> None:
        """Remove what was used longest ago and is not in use, until `size` bytes have room."""
        others = sorted(self._others(wanted))
        used = sum(bytes_ for _, bytes_, _ in others)
        for _, bytes_, place in others:
            if used + size <= self.limit and self._free() >= size + _SPARE:
                break
            if _remove(place):
                used -= bytes_
        if used + size > self.limit:
            raise SourceError(
                f'{name}: {_amount(size)} are needed in {self.folder}, which may hold {_amount(self.limit)} '
                f'and has {_amount(used)} in use; {LIMIT_VARIABLE} sets how much it may hold'
            )
        if self._free() < size + _SPARE:
            raise SourceError(self._full(name, size))

    def _others(self, wanted: Path) -> Iterator[tuple[float, int, Path]]:
        """Yield when a copy was last used, its bytes and its folder."""
        for place in self.folder.iterdir():
            key, _, size = place.name.rpartition('-')
            with contextlib.suppress(OSError):  # removed by another process
                if key and size.isdigit() and place != wanted:
                    yield (place / _LOCK).stat().st_mtime, int(size), place

    @contextlib.contextmanager
    def _alone(self) -> Iterator[None]:
        """Let no other process make room at the same time."""
        handle = os.open(self.folder / _ROOM, os.O_RDWR | os.O_CREAT | os.O_CLOEXEC, 0o600)
        try:
            fcntl.flock(handle, fcntl.LOCK_EX)
            yield
        finally:
            os.close(handle)

    @contextlib.contextmanager
    def _room_needed(self, name: str, size: int) -> Iterator[None]:
        """Tell a disk that is full or cannot be written in a sentence."""
        try:
            self.folder.mkdir(parents=True, exist_ok=True, mode=0o700)
            yield
        except SourceError:
            raise
        except OSError as error:
            if error.errno in (errno.ENOSPC, errno.EDQUOT):
                raise SourceError(self._full(name, size)) from error
            raise SourceError(
                f'{self.folder} cannot be written: {error.strerror or error}; '
                f'{FOLDER_VARIABLE} chooses another folder'
            ) from error

    def _full(self, name: str, size: int) -> str:
        return (
            f'{name}: {_amount(size)} are needed in {self.folder}, {_amount(self._free())} are free on its '
            f'disk; make room, or choose another folder by {FOLDER_VARIABLE}'
        )

    def _free(self) -> int:
        return shutil.disk_usage(self.folder).free


def _locked(place: Path, kind: int) -> int:
    """Return the open lock file of a copy, its folder made where there is none; waits for others."""
    while True:
        place.mkdir(exist_ok=True)
        with contextlib.suppress(FileNotFoundError):  # removed in between
            handle = os.open(place / _LOCK, os.O_RDWR | os.O_CREAT | os.O_CLOEXEC, 0o600)
            fcntl.flock(handle, kind)
            if _is_at(handle, place / _LOCK):
                return handle
            os.close(handle)


def _remove(place: Path) -> bool:
    """Remove a copy; False where it is in use or being fetched."""
    try:
        handle = os.open(place / _LOCK, os.O_RDWR | os.O_CLOEXEC)
    except OSError:
        return False
    try:
        fcntl.flock(handle, fcntl.LOCK_EX | fcntl.LOCK_NB)
        if not _is_at(handle, place / _LOCK):
            return False
        if (place / _COPY).is_dir():
            (place / _COPY).rename(place / _PART)  # what is left half removed is no copy
        shutil.rmtree(place)
    except OSError:
        return False
    finally:
        os.close(handle)
    return True


def _is_at(handle: int, path: Path) -> bool:
    """Return whether an open file still is the one at `path`: another process may have removed it."""
    try:
        return os.path.samestat(os.fstat(handle), path.stat())
    except FileNotFoundError:
        return False


def _amount(size: int) -> str:
    for unit, bytes_ in (('GB', 1e9), ('MB', 1e6)):
        if size >= bytes_:
            return f'{size / bytes_:.1f} {unit}'
    return f'{size / 1e3:.1f} kB'
