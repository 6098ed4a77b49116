"""Shared memory of Fast DDS that belongs to no living process any more is removed.

Measured: each participant makes a segment, whether or not anything goes by it. One that ends in order removes
it and the lock of its port, not the port itself; one that is killed leaves all of it. An owner holds its lock
file (`_el`, `_sl`) as long as it lives, so what can be locked, and a port without a lock, belongs to nobody.
`fastdds shm clean` does the same but for such ports.
"""

import contextlib
import fcntl
import os
import re
import time
from pathlib import Path

SHARED_MEMORY = Path('/dev/shm')

_YOUNGEST = 2.0  # s, chosen: who makes such files has locked them by then
_LOCK = re.compile(r'(fastrtps_(?:[0-9a-f]{16}|port\d{1,5}))_[es]l')
_PORT = re.compile(r'fastrtps_port\d{1,5}')


def remove_abandoned(folder: Path = SHARED_MEMORY, youngest: float = _YOUNGEST) -> list[str]:
    """Remove what dead participants have left in `folder`; return the names of these files, sorted.

    What is younger than `youngest` (s), and what cannot be removed, such as another user's, is left.
    """
    removed: list[str] = []
    with contextlib.suppress(OSError):
        names = sorted(os.listdir(folder))
        old = [name for name in names if _age(folder / name) >= youngest]
        for name in old:
            if found := _LOCK.fullmatch(name):
                removed += _remove_if_free(folder, name, found[1])
        for name in old:
            if _PORT.fullmatch(name) and not {f'{name}_el', f'{name}_sl'} & set(names):
                removed += _remove(folder, name, f'sem.{name}_mutex')
    return sorted(removed)


def remove_abandoned_of_the_dead() -> list[str]:
    """Do the same for those who have just died: once what they had made last is old enough."""
    time.sleep(_YOUNGEST)
    return remove_abandoned()


def _remove_if_free(folder: Path, lock: str, content: str) -> list[str]:
    """Remove the files of `content` unless a process holds their `lock`, which is held meanwhile."""
    with contextlib.suppress(OSError), open(folder / lock, 'rb') as file:
        fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
        return _remove(folder, content, f'sem.{content}_mutex', lock)
    return []


def _remove(folder: Path, *names: str) -> list[str]:
    removed = []
    for name in names:
        with contextlib.suppress(OSError):
            (folder / name).unlink()
            removed.append(name)
    return removed


def _age(path: Path) -> float:
    """Return how long ago (s) a file was written, negative where it is gone."""
    try:
        return time.time() - path.stat().st_mtime
    except OSError:
        return -1.0
