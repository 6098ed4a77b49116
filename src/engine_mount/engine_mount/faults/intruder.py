"""Sends what only the graph may send: `python -m engine_mount.faults.intruder KIND DOMAIN NAMESPACE`.

It says `ready` when it could begin, is no sender before the first line of its input, and ends with its input.
"""

import itertools
import math
import select
import socket
import sys
import time
from collections import deque
from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, contextmanager
from functools import partial

import numpy as np
from rcl_interfaces.srv import GetParameters
from rclpy.node import Node
from std_msgs.msg import String

from mount_bringup.graph.domain import can_port
from mount_driver.bus import MULTICAST_GROUP, Frame, open_bus
from mount_driver.can_library import can
from mount_driver.protocol import AliveCounter, Measurement, MountCodec, Setpoint
from mount_models.sampling import HIGHEST_CURRENT, SAMPLE_TIME, SAMPLE_TIME_NS
from mount_ros import topics
from mount_ros.data_path import DataPath
from mount_ros.environment import prepare_environment
from mount_ros.messages.cdr import serialised
from mount_ros.messages.force_table import to_message
from mount_ros.messages.scalars import ScalarsLayout, stamp_of
from mount_ros.nodes.process import ros_context
from mount_ros.nodes.shutdown import end_process

Step = Callable[[], None]
"""Sends what is due in one period."""

Begin = Callable[[], Step]
"""Becomes a sender: what a graph may detect by itself, before anything is sent."""

_EVENTS = 5  # of a flood, in each period
_MATCH_LIMIT = 5.0  # s, chosen: a graph that has detected the sender may be gone before it listens


@contextmanager
def _bus(domain: int, namespace: str) -> Iterator[can.BusABC]:
    bus = open_bus('udp_multicast', MULTICAST_GROUP, port=can_port(domain, namespace))
    try:
        yield bus
    finally:
        bus.shutdown()


@contextmanager
def _can_host(domain: int, namespace: str) -> Iterator[Begin]:
    """A second host asks for 3 A in answer to each sample, with counters of its own."""
    codec, alive = MountCodec(), AliveCounter()
    with _bus(domain, namespace) as bus:

        def step() -> None:
            frame = bus.recv(0.0)
            while frame is not None:
                if frame.arbitration_id == codec.measurement.frame_id:
                    counter = codec.decode_measurement(frame.data)[1].sample_counter
                    data = codec.encode_setpoint(Setpoint(HIGHEST_CURRENT, counter, True), alive.next())
                    bus.send(Frame(codec.setpoint.frame_id, data))
                frame = bus.recv(0.0)

        yield lambda: step


@contextmanager
def _can_electronics(domain: int, namespace: str) -> Iterator[Begin]:
    """Second electronics send samples of a mount at rest, with counters of their own."""
    codec, alive, numbers = MountCodec(), AliveCounter(), iter(range(10**9))
    with _bus(domain, namespace) as bus:

        def step() -> None:
            number = next(numbers)
            sample = Measurement(number & 0xFFFF, 1000 * number & 0xFFFFFFFF, 0.0, 0.0, math.nan, math.nan)
            bus.send(Frame(codec.measurement.frame_id, codec.encode_measurement(sample, alive.next())))

        yield lambda: step


@contextmanager
def _can_garbage(domain: int, namespace: str) -> Iterator[Begin]:
    """Another program sends datagrams to the group and port of the bus that are no frames."""
    draw = np.random.default_rng(1)
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as sender:
        sender.setsockopt(socket.IPPROTO_IP, socket.IP_MULTICAST_TTL, 0)
        sender.setsockopt(socket.IPPROTO_IP, socket.IP_MULTICAST_IF, socket.inet_aton('127.0.0.1'))
        place = (MULTICAST_GROUP, can_port(domain, namespace))

        def step() -> None:
            sender.sendto(draw.bytes(int(draw.integers(0, 200))), place)

        yield lambda: step


@contextmanager
def _path(domain: int, namespace: str) -> Iterator[DataPath]:
    with ros_context(domain) as context:
        owner = Node('intruder', namespace=namespace, context=context, start_parameter_services=False)
        path = DataPath(owner)
        try:
            yield path
        finally:
            path.stop()
            owner.destroy_node()


def _sender(path: DataPath, topic: topics.Topic) -> Callable[[bytes], None]:
    """Return what publishes on a topic, once somebody listens or `_MATCH_LIMIT` is over."""
    send, end = path.sender(topic), time.monotonic() + _MATCH_LIMIT
    while path.unmatched() and time.monotonic() < end:
        time.sleep(0.01)
    return send


@contextmanager
def _beside(
    domain: int, namespace: str, topic: topics.Topic, answer: Callable[[bytes], bytes | None]
) -> Iterator[Begin]:
    """A second node publishes what `answer` makes of each displacement, if anything."""
    with _path(domain, namespace) as path:
        senders: list[Callable[[bytes], None]] = []

        def take(raw: bytes) -> None:
            for send in senders:
                message = answer(raw)
                if message is not None:
                    send(message)

        def begin() -> Step:
            senders.append(_sender(path, topic))
            return lambda: None

        path.subscribe(topics.DISPLACEMENT, take)
        path.start()
        yield begin


def _current_setpoint(domain: int, namespace: str) -> AbstractContextManager[Begin]:
    """A second node answers each sample with 3 A."""
    topic, layout = topics.CURRENT_SETPOINT, ScalarsLayout(topics.CURRENT_SETPOINT)
    return _beside(domain, namespace, topic, lambda raw: layout.pack(stamp_of(raw), (HIGHEST_CURRENT,)))


def _displacement(domain: int, namespace: str) -> AbstractContextManager[Begin]:
    """A second node sends displacements half a sample beside those of the driver."""
    layout = ScalarsLayout(topics.DISPLACEMENT)
    own: deque[int] = deque(maxlen=1000)  # its stamps, for it receives them too

    def beside(raw: bytes) -> bytes | None:
        if stamp_of(raw) in own:
            return None
        own.append(stamp_of(raw) + SAMPLE_TIME_NS // 2)
        return layout.pack(own[-1], (0.003,))

    return _beside(domain, namespace, topics.DISPLACEMENT, beside)


@contextmanager
def _publisher(
    domain: int, namespace: str, topic: topics.Topic, step_of: Callable[[Callable[[bytes], None]], Step]
) -> Iterator[Begin]:
    """A second node publishes on a topic; `step_of` makes the step of what sends."""
    with _path(domain, namespace) as path:
        yield lambda: step_of(_sender(path, topic))


def _air_gap(domain: int, namespace: str) -> AbstractContextManager[Begin]:
    """A second node tells other gaps, as if it had measured them now."""
    layout = ScalarsLayout(topics.AIR_GAP)

    def message() -> bytes:
        return layout.pack(time.time_ns(), (5e-4, 3e-4, 1e-6, 1e-6, 60.0, 0.5))

    return _publisher(domain, namespace, topics.AIR_GAP, partial(_once, message))


def _table(stamp: Callable[[], int], currents: tuple[float, ...], forces: tuple[float, ...]):
    def message() -> bytes:
        table = to_message(stamp(), np.array([sorted(currents), forces]))
        table.data = [*currents, *forces]  # also what our own code would not send
        return serialised(table)

    def sender(domain: int, namespace: str) -> AbstractContextManager[Begin]:
        """A second node sends a current-force table."""
        return _publisher(domain, namespace, topics.CURRENT_FORCE_TABLE, partial(_once, message))

    return sender


def _flood_topic(domain: int, namespace: str) -> AbstractContextManager[Begin]:
    """Somebody sends many events."""
    text = serialised(String(data='flood ' + 'x' * 100))

    def flood(send: Callable[[bytes], None]) -> Step:
        def step() -> None:
            for _ in range(_EVENTS):
                send(text)

        return step

    return _publisher(domain, namespace, topics.EVENT, flood)


@contextmanager
def _flood_service(domain: int, namespace: str) -> Iterator[Begin]:
    """Somebody asks mount_control for its parameters, every second millisecond."""
    with ros_context(domain) as context:
        node = Node('intruder', namespace=namespace, context=context, start_parameter_services=False)
        client = node.create_client(GetParameters, 'mount_control/get_parameters')
        client.wait_for_service(10.0)
        turns = itertools.cycle((True, False))

        def step() -> None:
            if next(turns):
                client.call_async(GetParameters.Request(names=['damper']))

        yield lambda: step
        node.destroy_node()


def _once(message: Callable[[], bytes], send: Callable[[bytes], None]) -> Step:
    left = [message]

    def step() -> None:
        if left:
            send(left.pop()())

    return step


KINDS = {
    'can_host': _can_host,
    'can_electronics': _can_electronics,
    'can_garbage': _can_garbage,
    'current_setpoint': _current_setpoint,
    'displacement': _displacement,
    'air_gap': _air_gap,
    'table': _table(time.time_ns, (0.0, 1.0, 3.0), (0.0, 500.0, 1000.0)),
    'table_old': _table(lambda: 1_000_000_000, (0.0, 1.0, 3.0), (0.0, 500.0, 1000.0)),
    'table_not_monotone': _table(time.time_ns, (0.0, 2.0, 1.0), (0.0, 300.0, 500.0)),
    'flood_topic': _flood_topic,
    'flood_service': _flood_service,
}
"""{kind: what it makes}."""


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
