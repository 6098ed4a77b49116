"""One graph, with one CAN bus, per ROS domain and namespace: a second one would drive the same coil."""

import contextlib
import os
import socket
import zlib
from collections.abc import Iterator, Sequence
from pathlib import Path

HIGHEST_DOMAIN = 101  # above, the ports of Fast DDS run into those of other programs on Linux

# A ROS domain has 250 UDP ports from 7400 on (RTPS 2.2, section 9.6.1.1), of which two for each participant
# are in use. The bus takes one behind them: higher up the kernel gives them to any process, and the bus
# would not open.
_FIRST_PORT, _PORTS_OF_DOMAIN = 7530, 250  # behind 59 participants
_PLACES = 119  # namespaces told apart by their ports

_PLACE = '\0engine_mount_port'  # the zero: a name of its own, no file
_SOCKETS = Path('/proc/net/unix')


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
    """Hold the place of the one graph of this machine in a domain and namespace, or raise `DomainError`.

    By a name among the sockets of Linux that stands in no file system: nothing is left behind, whatever ends
    the process.
    """
    port, name = can_port(domain, namespace), f'/{namespace.strip("/")}'
    with socket.socket(socket.AF_UNIX) as place, socket.socket(socket.AF_UNIX) as holder:
        try:
            place.bind(f'{_PLACE}_{port}')
        except OSError:
            raise DomainError(_occupied(domain, name, port)) from None
        holder.bind(f'{_PLACE}_{port} {os.getpid()} {name}')
        yield


@contextlib.contextmanager
def domain_locks(domain: int, namespace: str, mounts: Sequence[str]) -> Iterator[None]:
    """Hold the places of a graph and of each of its mounts, whose namespaces are within its own."""
    with contextlib.ExitStack() as held:
        for mount in ('', *mounts):
            held.enter_context(domain_lock(domain, f'{namespace}/{mount}'))
        yield


def _occupied(domain: int, name: str, port: int) -> str:
    begin = f'@{_PLACE[1:]}_{port} '  # so Linux lists such names
    names = (line.partition(begin)[2] for line in _SOCKETS.read_text().splitlines() if begin in line)
    process, _, other = next(names, 'unknown unknown').partition(' ')  # it has just ended
    running = f'a graph already runs in ROS domain {domain}, namespace {other} (process {process})'
    if other == name:
        return f'{running}; end it, or choose another domain with --domain or ROS_DOMAIN_ID'
    return f'{running}, whose CAN bus would have port {port} as that of {name}; choose another namespace'
