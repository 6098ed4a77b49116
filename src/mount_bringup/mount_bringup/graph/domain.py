"""One graph, with one CAN bus, per ROS domain and namespace: a second one would drive the same coil."""

import contextlib
import os
import socket
import zlib
from collections.abc import Iterator, Sequence

from mount_models.quantity import ParameterError

HIGHEST_DOMAIN = 101  # above, the ports of Fast DDS run into those of other programs on Linux

# A ROS domain has 250 UDP ports from 7400 on (RTPS 2.2, section 9.6.1.1), of which two for each participant
# are in use. The bus takes one behind them: higher up the kernel gives them to any process, and the bus
# would not open.
_FIRST_PORT, _PORTS_OF_DOMAIN = 7530, 250  # behind 59 participants
_PLACES = 119  # namespaces told apart by their ports

_PLACE = '\0engine_mount_port'  # the zero: a name of its own, no file


def chosen_domain(wanted: int | None) -> int:
    """Return the domain asked for, else that of the environment, else 0, checked."""
    text = str(wanted) if wanted is not None else os.environ.get('ROS_DOMAIN_ID', '0') or '0'
    if not text.isdigit() or int(text) > HIGHEST_DOMAIN:
        raise ParameterError(f'ROS domain {text!r} must be a whole number within 0 .. {HIGHEST_DOMAIN}')
    return int(text)


def can_port(domain: int, namespace: str) -> int:
    """Return the UDP port of the simulated CAN bus: one for each domain and namespace.

    Two of very many namespaces may share one; `domain_lock` keeps them from running at the same time.
    """
    name = namespace.strip('/')
    place = 1 + zlib.crc32(name.encode()) % _PLACES if name else 0
    return _FIRST_PORT + _PORTS_OF_DOMAIN * domain + place


@contextlib.contextmanager
def domain_lock(domain: int, namespace: str, mounts: Sequence[str] = ()) -> Iterator[None]:
    """Hold the places of the one graph of this machine in a domain and namespace, and of its mounts in it.

    By a name among the sockets of Linux that stands in no file system: nothing is left behind, whatever ends
    the process. Raises `ParameterError` where another graph holds one of them.
    """
    with contextlib.ExitStack() as held:
        for mount in {'', *mounts}:
            name = f'/{namespace}/{mount}'.replace('//', '/').rstrip('/') or '/'
            port = can_port(domain, name)
            place = held.enter_context(socket.socket(socket.AF_UNIX))
            try:
                place.bind(f'{_PLACE}_{port}')
            except OSError:
                raise ParameterError(
                    f'a graph already runs in ROS domain {domain}, namespace {name}, or in one whose CAN bus '
                    f'would have port {port} too; end it, or choose another domain with --domain or '
                    'ROS_DOMAIN_ID'
                ) from None
        yield
