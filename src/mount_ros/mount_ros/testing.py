"""For tests of nodes: a ROS domain of their own.

A participant that was killed stays in its domain's graph for some seconds, and other tests may run at
the same time; so each test takes a domain that nobody else on this machine holds.
"""

import contextlib
import fcntl
import os
import tempfile
from collections.abc import Iterator
from pathlib import Path

_HIGHEST_DOMAIN = 101


@contextlib.contextmanager
def free_domain() -> Iterator[int]:
    """Hold a ROS domain within 1 .. 101 that nobody else holds; raises `OSError` if none is free."""
    folder = Path(tempfile.gettempdir()) / 'engine_mount_domains'
    folder.mkdir(exist_ok=True)
    for number in range(1, _HIGHEST_DOMAIN + 1):
        handle = os.open(folder / str(number), os.O_RDWR | os.O_CREAT, 0o666)
        try:
            fcntl.flock(handle, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except OSError:
            os.close(handle)
            continue
        try:
            yield number
        finally:
            os.close(handle)
        return
    raise OSError(f'all {_HIGHEST_DOMAIN} ROS domains are held by other tests')
