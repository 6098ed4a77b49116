"""Local copies of fetched recordings: whole, of limited size, the one used longest ago removed first.

A copy is a folder `KEY-BYTES`; it gets this name when it is whole. A process that uses one holds a shared
lock on the folder, which ends with the process.
"""

import contextlib
import errno
import fcntl
import os
import shutil
import tempfile
from collections.abc import Callable, Iterator
from pathlib import Path

from engine_mount.settings.options import size_in_bytes
from engine_mount.signals.sources.uris import SourceError

FOLDER_VARIABLE, LIMIT_VARIABLE = 'ENGINE_MOUNT_CACHE', 'ENGINE_MOUNT_CACHE_LIMIT'
LIMIT = '20GB'  # chosen: about a hundred hours of one mount


def cache_folder() -> Path:
    """Return `ENGINE_MOUNT_CACHE`, else `engine_mount/recordings` in the user's cache."""
    base = os.environ.get('XDG_CACHE_HOME') or str(Path.home() / '.cache')
    return Path(os.environ.get(FOLDER_VARIABLE) or Path(base) / 'engine_mount' / 'recordings')


@contextlib.contextmanager
def cached_copy(key: str, name: str, size: int, fill: Callable[[Path], None]) -> Iterator[Path]:
    """Give the copy `name` of `size` bytes, which nothing removes within the block.

    `fill` writes `name` into the folder that it gets, where there is no copy with this `key`. Raises
    `SourceError` without room, and what `fill` raises; then nothing of the copy is left.
    """
    folder = cache_folder()
    place = folder / f'{key}-{size}'
    try:
        folder.mkdir(parents=True, exist_ok=True, mode=0o700)
        while (handle := _lock(place, fcntl.LOCK_SH)) is None:
            _make_room(folder, name, size)
            _make_copy(place, size, fill)
        os.utime(place)
    except SourceError:
        raise
    except OSError as error:
        raise SourceError(
            f'{name}: {folder} cannot be written: {error.strerror or error}; {FOLDER_VARIABLE} chooses '
            'another folder'
        ) from error
    try:
        yield place / name
    finally:
        os.close(handle)


def _make_copy(place: Path, size: int, fill: Callable[[Path], None]) -> None:
    """Fill a folder and name it `place`, unless another process was first."""
    part = Path(tempfile.mkdtemp(prefix='.part-', suffix=f'-{size}', dir=place.parent))
    handle = _lock(part, fcntl.LOCK_SH)
    try:
        fill(part)
        part.rename(place)
    except OSError as error:
        if error.errno not in (errno.ENOTEMPTY, errno.EEXIST):
            raise
    finally:
        shutil.rmtree(part, ignore_errors=True)
        if handle is not None:
            os.close(handle)


def _make_room(folder: Path, name: str, size: int) -> None:
    """Remove unused copies, the oldest first, until `size` bytes have room; raises `SourceError`."""
    limit = size_in_bytes(os.environ.get(LIMIT_VARIABLE) or LIMIT)
    copies = []
    for place in folder.iterdir():
        with contextlib.suppress(FileNotFoundError, ValueError):  # removed by another process, or no copy
            copies.append((place.stat().st_mtime, int(place.name.rpartition('-')[2]), place))
    used = sum(bytes_ for _, bytes_, _ in copies)
    for _, bytes_, place in sorted(copies):
        if used + size > limit:
            used -= bytes_ * _remove(place)
    if used + size > limit:
        raise SourceError(
            f'{name}: {size / 1e6:g} MB are needed in {folder}, which may hold {limit / 1e6:g} MB and has '
            f'{used / 1e6:g} MB in use; make room, or choose another limit or folder by {LIMIT_VARIABLE} or '
            f'{FOLDER_VARIABLE}'
        )


def _remove(place: Path) -> bool:
    """Remove a copy; False where it is in use. Half removed it is not taken for whole: it is renamed."""
    handle = _lock(place, fcntl.LOCK_EX | fcntl.LOCK_NB)
    if handle is None:
        return False
    try:
        old = place.rename(place.with_name(f'.old-{place.name}'))
        shutil.rmtree(old, ignore_errors=True)
    finally:
        os.close(handle)
    return True


def _lock(place: Path, kind: int) -> int | None:
    """Return a handle with a lock on a folder; None where it is not there, or locked by another process."""
    try:
        handle = os.open(place, os.O_RDONLY | os.O_DIRECTORY)
    except FileNotFoundError:
        return None
    with contextlib.suppress(OSError):  # locked, or removed meanwhile
        fcntl.flock(handle, kind)
        if os.path.samestat(os.fstat(handle), place.stat()):
            return handle
    os.close(handle)
    return None
