"""One graph per ROS domain and namespace: a second one would drive the same coil."""

import contextlib
import fcntl
import os
import tempfile
from collections.abc import Iterator
from pathlib import Path

HIGHEST_DOMAIN = 101  # above, the ports of Fast DDS run into those of other programs on Linux


class DomainError(ValueError):
    """The ROS domain cannot be used; the text says why."""


def chosen_domain(wanted: int | None) -> int:
    """Return the domain asked for, else that of the environment, else 0, checked."""
    text = str(wanted) if wanted is not None else os.environ.get('ROS_DOMAIN_ID', '0') or '0'
    if not text.isdigit() or int(text) > HIGHEST_DOMAIN:
        raise DomainError(f'ROS domain {text!r} must be a whole number within 0 .. {HIGHEST_DOMAIN}')
    return int(text)


@contextlib.contextmanager
def domain_lock(domain: int, namespace: str) -> Iterator[None]:
    """Hold the place of the one graph of this machine in a domain and namespace, or raise `DomainError`."""
    place = namespace.strip('/').replace('/', '_') or 'root'
    path = Path(tempfile.gettempdir()) / f'engine_mount_domain_{domain}_{place}.lock'
    with open(path, 'a+', opener=_open_for_all) as file:
        try:
            fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except OSError:
            file.seek(0)
            owner = file.read().strip() or 'unknown'
            raise DomainError(
                f'a graph already runs in ROS domain {domain}, namespace {namespace or "/"} '
                f'(process {owner}); end it, or choose another domain with --domain or ROS_DOMAIN_ID'
            ) from None
        file.truncate(0)
        file.write(str(os.getpid()))
        file.flush()
        yield  # the lock ends with the file, so also with the process


def _open_for_all(path: str, flags: int) -> int:
    return os.open(path, flags, 0o666)
