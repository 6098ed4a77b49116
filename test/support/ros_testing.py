"""For tests of nodes: ROS domains of their own, one context, one way to wait; a plugin of pytest.

A participant that was killed stays in its domain's graph for some seconds, and other tests may run at
the same time; so tests take domains that no other process on this machine holds. Creating and removing DDS
participants by the hundred is slow and now and then stalls within the middleware; so the nodes of all
tests of a process live in one context, one after the other. A test that starts processes has a domain and a
context of its own: what those leave behind in the middleware when they end is none of the next test's.
"""

import contextlib
import fcntl
import gc
import os
import random
import tempfile
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeVar

import pytest

if TYPE_CHECKING:
    from rclpy.context import Context
    from rclpy.node import Node

    from mount_ros.data_path import DataPath

LIMIT = 30.0  # s: what has not happened by then does not happen
_HIGHEST_DOMAIN = 101

Found = TypeVar('Found')


@contextlib.contextmanager
def free_domain() -> Iterator[int]:
    """Hold a ROS domain within 1 .. 101 that no other process holds; raises `OSError` if none is free."""
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


def serialised(message: Any) -> bytes:
    """Return the CDR bytes of a message, without those that the middleware leaves behind its end."""
    from rclpy.serialization import serialize_message
    from rosbags.serde import SerdeError
    from rosbags.typesys import Stores, get_typestore

    raw, store = serialize_message(message), get_typestore(Stores.ROS2_JAZZY)
    kind = f'{type(message).__module__.partition(".")[0]}/msg/{type(message).__name__}'
    for end in range(len(raw), 0, -1):
        with contextlib.suppress(SerdeError):  # of bytes behind the end
            return bytes(store.serialize_cdr(store.deserialize_cdr(raw[:end], kind), kind))
    raise AssertionError(f'{kind} is not readable')


def mutated(content: bytes, seed: int) -> bytes:
    """Return `content` with one to five bits, bytes or stretches changed, moved or cut, as `seed` decides."""
    draw = random.Random(seed)
    made = bytearray(content)
    for _ in range(draw.choice((1, 1, 1, 2, 5))):
        first, other, length = draw.randrange(len(made)), draw.randrange(len(made)), draw.randrange(1, 100)
        match draw.randrange(7):
            case 0 | 1:
                made[first] ^= 1 << draw.randrange(8)
            case 2:
                made[first] = draw.randrange(256)
            case 3:
                made[first], made[other] = made[other], made[first]
            case 4:
                made[first : first + length] = made[other : other + length]
            case 5:
                made[first : first + 8] = draw.choice((bytes(8), b'\xff' * 8, bytes(7) + b'\x80'))
            case 6:
                del made[first : draw.choice((first + length, len(made)))]
        made = made or bytearray(1)
    return bytes(made)


def wait_until(condition: Callable[[], Found], what: str, limit: float = LIMIT) -> Found:
    """Return the first true value of `condition`; fails saying `what` did not happen within `limit` (s)."""
    end = time.monotonic() + limit
    while not (found := condition()):
        if time.monotonic() >= end:
            pytest.fail(f'{what} did not happen within {limit:g} s')
        time.sleep(0.002)
    return found


def compiled_so_far() -> set[tuple[str, str]]:
    """Return name and argument types of all that numba has compiled or loaded in this process."""
    from numba.core.dispatcher import Dispatcher

    found = [each for each in gc.get_objects() if isinstance(each, Dispatcher)]
    return {(each.py_func.__qualname__, str(kinds)) for each in found for kinds in each.overloads}


@pytest.fixture
def domain() -> Iterator[int]:
    """Hold a ROS domain for one test and the processes that it starts."""
    with free_domain() as number:
        yield number


def present_nodes(seen_by: 'Node') -> list[tuple[str, str]]:
    """Return name and namespace of every node that `seen_by` sees, itself included.

    The list of names that rclpy gives keeps for ever those of a process whose last words were read after its
    end was known: rmw_dds_common 3.2, `GraphCache::update_participant_entities`, makes an unknown participant
    known. So the publishers that each node has on `/parameter_events` are counted instead.
    """
    infos = seen_by.get_publishers_info_by_topic('/parameter_events')
    return [(info.node_name, info.node_namespace) for info in infos]


@pytest.fixture
def context(_observer: 'Node') -> Iterator['Context']:
    """Return the context of this process's tests; fails if a test leaves a node behind."""
    yield _observer.context
    alone = [(_observer.get_name(), _observer.get_namespace())]
    wait_until(
        lambda: present_nodes(_observer) == alone,
        f'that only {alone} is left of {present_nodes(_observer)}',
    )


@pytest.fixture
def domain_context(domain: int) -> Iterator['Context']:
    """Return a context of one test, in the domain of the processes that it starts."""
    with _context(domain) as made:
        yield made


@pytest.fixture
def source(context: 'Context') -> Iterator['DataPath']:
    """Return a data path whose node publishes, beside the node that is tested."""
    with _source(context) as path:
        yield path


@pytest.fixture
def domain_source(domain_context: 'Context') -> Iterator['DataPath']:
    """Return a data path whose node publishes, beside the processes that a test starts."""
    with _source(domain_context) as path:
        yield path


@pytest.fixture
def make_node(context: 'Context') -> Iterator[Callable[..., Any]]:
    """Return a function that makes a node of a class with parameters; it is closed at the end of the test."""
    from rclpy.parameter import Parameter

    made: list[Any] = []

    def make(kind: type, *arguments: Any, **parameters: Any) -> Any:
        overrides = [Parameter(name, value=value) for name, value in parameters.items()]
        made.append(kind(*arguments, context=context, parameter_overrides=overrides))
        return made[-1]

    yield make
    while made:  # a node that is held stays in the graph
        node = made.pop()
        if hasattr(node, 'close'):
            node.close()
        node.destroy_node()


@contextlib.contextmanager
def _source(context: 'Context') -> Iterator['DataPath']:
    from rclpy.node import Node

    from mount_ros.data_path import DataPath

    node = Node('source', context=context)
    path = DataPath(node)
    yield path
    path.start()
    path.stop()
    node.destroy_node()


@contextlib.contextmanager
def _context(domain: int) -> Iterator['Context']:
    import rclpy

    from mount_ros.environment import prepare_environment

    prepare_environment()
    context = rclpy.Context()
    rclpy.init(context=context, domain_id=domain)
    yield context
    rclpy.try_shutdown(context=context)


@pytest.fixture(scope='session')
def _observer() -> Iterator['Node']:
    """A node in a context and domain of this process that sees which others are there."""
    from rclpy.node import Node

    with free_domain() as number, _context(number) as context:
        node = Node('observer', context=context, namespace='test', enable_rosout=False)
        yield node
        node.destroy_node()
