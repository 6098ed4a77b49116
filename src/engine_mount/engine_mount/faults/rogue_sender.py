"""Sends what only the graph may send: `python -m engine_mount.faults.rogue_sender KIND DOMAIN NAMESPACE`.

It prints `ready` when it could begin, is no sender before the first line of its input, and ends with that.
"""

import itertools
import math
import select
import socket
import sys
import time
from collections import deque
from collections.abc import Callable, Iterator, Mapping
from contextlib import AbstractContextManager, contextmanager
from functools import partial

import numpy as np
from rcl_interfaces.srv import GetParameters
from rclpy.node import Node

from mount_bringup.graph.domain import can_port
from mount_driver.bus import MULTICAST_GROUP, Frame, open_bus
from mount_driver.can_library import can
from mount_driver.protocol import AliveCounter, Measurement, MountCodec, Setpoint
from mount_models.sampling import HIGHEST_CURRENT, SAMPLE_TIME, SAMPLE_TIME_NS
from mount_ros import topics
from mount_ros.data_path import DataPath
from mount_ros.environment import prepare_environment
from mount_ros.messages.cdr import string_message
from mount_ros.messages.force_table import table_message
from mount_ros.messages.scalars import ScalarsLayout, stamp_of
from mount_ros.nodes.process import ros_context
from mount_ros.nodes.shutdown import end_process

Step = Callable[[], object]
"""Sends what is due in one period."""

Begin = Callable[[], Step]
"""Becomes a sender: what a graph may detect by itself, before anything is sent."""

_FLOOD = 5  # events in each period
_MATCH_LIMIT = 5.0  # s, chosen: a graph that has detected the sender may be gone before it listens


@contextmanager
def _on_bus(step_of: Callable[[can.BusABC], Step], domain: int, namespace: str) -> Iterator[Begin]:
    bus = open_bus('udp_multicast', MULTICAST_GROUP, port=can_port(domain, namespace))
    try:
        yield partial(step_of, bus)
    finally:
        bus.shutdown()


def _second_host(bus: can.BusABC) -> Step:
    """Answer each sample with 3 A, with counters of its own."""
    codec, alive = MountCodec(), AliveCounter()

    def step() -> None:
        while (frame := bus.recv(0.0)) is not None:
            if frame.arbitration_id == codec.measurement.frame_id:
                counter = codec.decode_measurement(frame.data)[1].sample_counter
                data = codec.encode_setpoint(Setpoint(HIGHEST_CURRENT, counter, True), alive.next())
                bus.send(Frame(codec.setpoint.frame_id, data))

    return step


def _second_electronics(bus: can.BusABC) -> Step:
    """Send samples of a mount at rest, with counters of their own."""
    codec, alive, numbers = MountCodec(), AliveCounter(), itertools.count()

    def step() -> None:
        number = next(numbers)
        sample = Measurement(number & 0xFFFF, 1000 * number & 0xFFFFFFFF, 0.0, 0.0, math.nan, math.nan)
        bus.send(Frame(codec.measurement.frame_id, codec.encode_measurement(sample, alive.next())))

    return step


@contextmanager
def _datagrams(domain: int, namespace: str) -> Iterator[Begin]:
    """Another program sends datagrams to the group and port of the bus that are no frames."""
    draw = np.random.default_rng(1)
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as sender:
        sender.setsockopt(socket.IPPROTO_IP, socket.IP_MULTICAST_TTL, 0)
        sender.setsockopt(socket.IPPROTO_IP, socket.IP_MULTICAST_IF, socket.inet_aton('127.0.0.1'))
        place = (MULTICAST_GROUP, can_port(domain, namespace))
        yield lambda: lambda: sender.sendto(draw.bytes(int(draw.integers(0, 200))), place)


@contextmanager
def _node(domain: int, namespace: str) -> Iterator[Node]:
    with ros_context(domain) as context:
        node = Node('rogue_sender', namespace=namespace, context=context, start_parameter_services=False)
        try:
            yield node
        finally:
            node.destroy_node()


@contextmanager
def _requests(domain: int, namespace: str) -> Iterator[Begin]:
    """Request the parameters of mount_control every second millisecond."""
    with _node(domain, namespace) as node:
        client = node.create_client(GetParameters, 'mount_control/get_parameters')
        client.wait_for_service(10.0)
        turns = itertools.cycle((True, False))
        yield lambda: lambda: next(turns) and client.call_async(GetParameters.Request(names=['damper']))


@contextmanager
def _path(domain: int, namespace: str) -> Iterator[DataPath]:
    with _node(domain, namespace) as node:
        path = DataPath(node)
        try:
            yield path
        finally:
            path.stop()


def _sender(path: DataPath, topic: topics.Topic) -> Callable[[bytes], None]:
    """Return what publishes on a topic, once a node subscribes or `_MATCH_LIMIT` is over."""
    send, end = path.sender(topic), time.monotonic() + _MATCH_LIMIT
    while path.unmatched() and time.monotonic() < end:
        time.sleep(0.01)
    return send


@contextmanager
def _publisher(
    topic: topics.Topic, messages: Iterator[bytes], domain: int, namespace: str
) -> Iterator[Begin]:
    """Publish `messages`, a few in each period, until there are no more."""
    with _path(domain, namespace) as path:

        def begin() -> Step:
            send = _sender(path, topic)
            return lambda: [send(message) for message in itertools.islice(messages, _FLOOD)]

        yield begin


@contextmanager
def _replier(
    topic: topics.Topic, answer: Callable[[bytes], bytes | None], domain: int, namespace: str
) -> Iterator[Begin]:
    """Publish what `answer` makes of each displacement, if anything."""
    with _path(domain, namespace) as path:
        senders: list[Callable[[bytes], None]] = []

        def take(raw: bytes) -> None:
            for send in senders:
                if (message := answer(raw)) is not None:
                    send(message)

        def begin() -> Step:
            senders.append(_sender(path, topic))
            return lambda: None

        path.subscribe(topics.DISPLACEMENT, take)
        path.start()
        yield begin


def _setpoint(raw: bytes) -> bytes:
    """Return 3 A as the setpoint of a displacement."""
    return ScalarsLayout(topics.CURRENT_SETPOINT).pack(stamp_of(raw), (HIGHEST_CURRENT,))


_OWN_STAMPS: deque[int] = deque(maxlen=1000)  # of displacements, for they are received too


def _displacement(raw: bytes) -> bytes | None:
    """Return a displacement half a sample beside one of the driver."""
    if stamp_of(raw) in _OWN_STAMPS:
        return None
    _OWN_STAMPS.append(stamp_of(raw) + SAMPLE_TIME_NS // 2)
    return ScalarsLayout(topics.DISPLACEMENT).pack(_OWN_STAMPS[-1], (0.003,))


def _air_gap() -> Iterator[bytes]:
    """Yield other gaps, as if they had been measured now."""
    yield ScalarsLayout(topics.AIR_GAP).pack(time.time_ns(), (5e-4, 3e-4, 1e-6, 1e-6, 60.0, 0.5))


def _table(currents: tuple[float, ...], forces: tuple[float, ...], stamp: int = 0) -> Iterator[bytes]:
    """Yield a current-force table with a stamp (ns), by default that of now."""
    sound = table_message(stamp or time.time_ns(), np.array([sorted(currents), forces]))
    numbers = np.array([currents, forces]).tobytes()  # also what our own code would not send
    yield sound[: -len(numbers)] + numbers


_EVENT = string_message('flood ' + 'x' * 100)
_TABLE = (0.0, 1.0, 3.0), (0.0, 500.0, 1000.0)  # A, N
_FALLING = (0.0, 2.0, 1.0), (0.0, 300.0, 500.0)

KINDS: Mapping[str, Callable[[int, str], AbstractContextManager[Begin]]] = {
    'can_host': partial(_on_bus, _second_host),
    'can_electronics': partial(_on_bus, _second_electronics),
    'can_garbage': _datagrams,
    'current_setpoint': partial(_replier, topics.CURRENT_SETPOINT, _setpoint),
    'displacement': partial(_replier, topics.DISPLACEMENT, _displacement),
    'air_gap': partial(_publisher, topics.AIR_GAP, _air_gap()),
    'table': partial(_publisher, topics.CURRENT_FORCE_TABLE, _table(*_TABLE)),
    'table_old': partial(_publisher, topics.CURRENT_FORCE_TABLE, _table(*_TABLE, 1_000_000_000)),
    'table_not_monotone': partial(_publisher, topics.CURRENT_FORCE_TABLE, _table(*_FALLING)),
    'flood_topic': partial(_publisher, topics.EVENT, itertools.repeat(_EVENT)),
    'flood_service': _requests,
}
"""{kind: context that gives the beginning of the sender}, of a domain and a namespace."""


def main() -> None:
    """Send as the command line says, from the first line of the input to its end."""
    prepare_environment()
    kind, domain, namespace = sys.argv[1:]
    with KINDS[kind](int(domain), namespace) as begin:
        print('ready', flush=True)
        sys.stdin.readline()
        step = begin()
        while not select.select([sys.stdin], [], [], SAMPLE_TIME)[0]:
            step()
    end_process(0)


if __name__ == '__main__':
    main()
