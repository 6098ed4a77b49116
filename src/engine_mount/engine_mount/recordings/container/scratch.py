"""Long arrays that lie in files without a name, so that those not looked at just now need no memory.

The files are in the folder for temporary files and vanish with the arrays. Where there is no room for one,
its array is in memory.
"""

import mmap
import os
import tempfile
import weakref
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

from engine_mount.recordings.container.free_memory import give_back

Kind = TypeVar('Kind', np.float64, np.int64)

LONG = 1 << 20  # numbers, chosen: 17 min at 1 kHz; shorter arrays are in memory
_files: 'weakref.WeakSet[mmap.mmap]' = weakref.WeakSet()


def room(count: int, kind: type[Kind]) -> NDArray[Kind]:
    """Return an array for `count` numbers, whatever they are."""
    if count < LONG:
        return np.empty(count, kind)
    try:
        with tempfile.TemporaryFile(prefix='engine_mount_') as file:
            os.posix_fallocate(file.fileno(), 0, count * np.dtype(kind).itemsize)
            mapped = mmap.mmap(file.fileno(), 0)
    except OSError:
        return np.empty(count, kind)
    _files.add(mapped)
    return np.frombuffer(mapped, kind)


def kept(numbers: NDArray[Kind]) -> NDArray[Kind]:
    """Return numbers (n,), where they are many in a file."""
    if len(numbers) < LONG:
        return numbers
    copy = room(len(numbers), numbers.dtype.type)
    copy[:] = numbers
    put_away()
    return copy


def put_away() -> None:
    """Let the system take back the memory of all such arrays, and what was freed since.

    They are read from their files where they are needed.
    """
    for mapped in list(_files):
        mapped.madvise(mmap.MADV_DONTNEED)
    if _files:
        give_back()
