"""One graph, with one CAN bus, per ROS domain and namespace: a second one would drive the same coil."""

import contextlib
import fcntl
import os
import tempfile
import zlib
from collections.abc import Iterator
from pathlib import Path

HIGHEST_DOMAIN = 101  # above, the ports of Fast DDS run into those of other programs on Linux

# A ROS domain has 250 UDP ports from 7400 on (RTPS 2.2, section 9.6.1.1), of which two for each participant
# are in use. The bus takes one behind them: higher up the kernel gives them to any process, and the bus
# would not open.
_FIRST_PORT, _PORTS_OF_DOMAIN = 7530, 250  # behind 59 participants
_PLACES = 119  # namespaces told apart by their ports


class DomainError(ValueError):
    """The ROS domain cannot be used; the text says why."""


def chosen_domain(wanted: int | None) -> int:
    """Return the domain asked for, else that of the environment, else 0, checked."""
    text = str(wanted) if wanted is not None else os.environ.get('ROS_DOMAIN_ID', '0') or '0'
    if not text.isdigit() or int(text) > HIGHEST_DOMAIN:
        raise DomainError(f'ROS domain {text!r} must be a whole number within 0 .. {HIGHEST_DOMAIN}')
    return int(text)


def can_port(domain: int, namespace: str) -> int:
    """Return the UDP port of the simulated CAN bus: one for each domain and namespace.

    Two of very many namespaces may share one; `domain_lock` keeps them from running at the same time.
    """
    name = namespace.strip('/')
    place = 1 + zlib.crc32(name.encode()) % _PLACES if name else 0
    return _FIRST_PORT + _PORTS_OF_DOMAIN * domain + place


@contextlib.contextmanager
def domain_lock(domain: int, namespace: str) -> Iterator[None]:
    """Hold the place of the one graph of this machine in a domain and namespace, or raise `DomainError`."""
    port, name = can_port(domain, namespace), f'/{namespace.strip("/")}'
    path = Path(tempfile.gettempdir()) / f'engine_mount_port_{port}.lock'
    with open(path, 'a+', opener=_open_for_all) as file:
        try:
            fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except OSError:
            file.seek(0)
            process, _, other = (file.read().strip() or f'unknown {name}').partition(' ')
            raise DomainError(_occupied(domain, name, process, other, port)) from None
        file.truncate(0)
        file.write(f'{os.getpid()} {name}')
        file.flush()
        yield  # the lock ends with the file, so also with the process


def _occupied(domain: int, name: str, process: str, other: str, port: int) -> str:
    running = f'a graph already runs in ROS domain {domain}, namespace {other} (process {process})'
    if other == name:
        return f'{running}; end it, or choose another domain with --domain or ROS_DOMAIN_ID'
    return f'{running}, whose CAN bus would have port {port} as that of {name}; choose another namespace'


def _open_for_all(path: str, flags: int) -> int:
    return os.open(path, flags, 0o666)
