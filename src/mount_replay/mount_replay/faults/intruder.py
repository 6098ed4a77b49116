"""Sends what only the graph may send: `python -m mount_replay.faults.intruder KIND DOMAIN NAMESPACE`.

It says `ready` when it knows the graph, sends from the first line of its input on, and ends with its input.
"""

import itertools
import math
import select
import socket
import sys
import threading
import time
from collections import deque
from collections.abc import Callable, Iterator
from contextlib import contextmanager

import numpy as np
from rcl_interfaces.srv import GetParameters
from rclpy.node import Node
from std_msgs.msg import String

from mount_bringup.graph.domain import can_port
from mount_driver.bus import MULTICAST_GROUP, open_bus
from mount_driver.can_library import can
from mount_driver.codec import Measurement, MountCodec, Setpoint
from mount_driver.e2e_receiver import AliveCounter
from mount_driver.frame import Frame
from mount_models.sampling import HIGHEST_CURRENT, SAMPLE_TIME, SAMPLE_TIME_NS
from mount_ros import topics
from mount_ros.data_path import DataPath
from mount_ros.environment import prepare_environment
from mount_ros.messages.cdr import serialised
from mount_ros.messages.force_table import to_message
from mount_ros.messages.scalars import ScalarsLayout, stamp_of
from mount_ros.nodes.hosting import ros_context
from mount_ros.nodes.leaving import end_process

Step = Callable[[], object]
"""Sends what is due in one period."""

_EVENTS = 5  # of a flood, in each period


@contextmanager
def _bus(domain: int, namespace: str) -> Iterator[can.BusABC]:
    bus = open_bus('udp_multicast', MULTICAST_GROUP, port=can_port(domain, namespace))
    try:
        yield bus
    finally:
        bus.shutdown()


@contextmanager
def _can_host(domain: int, namespace: str) -> Iterator[Step]:
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

        yield step


@contextmanager
def _can_electronics(domain: int, namespace: str) -> Iterator[Step]:
    """Second electronics send samples of a mount at rest, with counters of their own."""
    codec, alive, numbers = MountCodec(), AliveCounter(), iter(range(10**9))
    with _bus(domain, namespace) as bus:

        def step() -> None:
            number = next(numbers)
            sample = Measurement(number & 0xFFFF, 1000 * number & 0xFFFFFFFF, 0.0, 0.0, math.nan, math.nan)
            bus.send(Frame(codec.measurement.frame_id, codec.encode_measurement(sample, alive.next())))

        yield step


@contextmanager
def _can_garbage(domain: int, namespace: str) -> Iterator[Step]:
    """Another program sends datagrams to the group and port of the bus that are no frames."""
    draw = np.random.default_rng(1)
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as sender:
        sender.setsockopt(socket.IPPROTO_IP, socket.IP_MULTICAST_TTL, 0)
        sender.setsockopt(socket.IPPROTO_IP, socket.IP_MULTICAST_IF, socket.inet_aton('127.0.0.1'))
        place = (MULTICAST_GROUP, can_port(domain, namespace))
        yield lambda: sender.sendto(draw.bytes(int(draw.integers(0, 200))), place)


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


@contextmanager
def _current_setpoint(domain: int, namespace: str) -> Iterator[Step]:
    """A second node answers each sample with 3 A."""
    layout, sending = ScalarsLayout(topics.CURRENT_SETPOINT), threading.Event()
    with _path(domain, namespace) as path:
        send = path.sender(topics.CURRENT_SETPOINT)

        def answer(raw: bytes) -> None:
            if sending.is_set():
                send(layout.pack(stamp_of(raw), (HIGHEST_CURRENT,)))

        path.subscribe(topics.DISPLACEMENT, answer)
        path.start()
        _wait_for_matches(path)
        yield sending.set


@contextmanager
def _displacement(domain: int, namespace: str) -> Iterator[Step]:
    """A second node sends displacements half a sample beside those of the driver."""
    layout, sending = ScalarsLayout(topics.DISPLACEMENT), threading.Event()
    with _path(domain, namespace) as path:
        send = path.sender(topics.DISPLACEMENT)

        own: deque[int] = deque(maxlen=1000)  # its stamps, for it receives them too

        def beside(raw: bytes) -> None:
            if sending.is_set() and stamp_of(raw) not in own:
                own.append(stamp_of(raw) + SAMPLE_TIME_NS // 2)
                send(layout.pack(own[-1], (0.003,)))

        path.subscribe(topics.DISPLACEMENT, beside)
        path.start()
        _wait_for_matches(path)
        yield sending.set


@contextmanager
def _air_gap(domain: int, namespace: str) -> Iterator[Step]:
    """A second node tells other gaps, as if it had measured them now."""
    layout = ScalarsLayout(topics.AIR_GAP)
    with _path(domain, namespace) as path:
        send = path.sender(topics.AIR_GAP)
        _wait_for_matches(path)
        yield _once(lambda: send(layout.pack(time.time_ns(), (5e-4, 3e-4, 1e-6, 1e-6, 60.0, 0.5))))


def _table(stamp: Callable[[], int], currents: tuple[float, ...], forces: tuple[float, ...]):
    @contextmanager
    def sender(domain: int, namespace: str) -> Iterator[Step]:
        """A second node sends a current-force table."""
        with _path(domain, namespace) as path:
            send = path.sender(topics.CURRENT_FORCE_TABLE)
            _wait_for_matches(path)
            message = to_message(stamp(), np.array([sorted(currents), forces]))
            message.data = [*currents, *forces]  # also what our own code would not send
            yield _once(lambda: send(serialised(message)))

    return sender


@contextmanager
def _flood_topic(domain: int, namespace: str) -> Iterator[Step]:
    """Somebody sends many events."""
    with _path(domain, namespace) as path:
        send = path.sender(topics.EVENT)
        text = serialised(String(data='flood ' + 'x' * 100))
        yield lambda: [send(text) for _ in range(_EVENTS)]


@contextmanager
def _flood_service(domain: int, namespace: str) -> Iterator[Step]:
    """Somebody asks mount_control for its parameters, every second millisecond."""
    with ros_context(domain) as context:
        node = Node('intruder', namespace=namespace, context=context, start_parameter_services=False)
        client = node.create_client(GetParameters, 'mount_control/get_parameters')
        client.wait_for_service(10.0)
        turns = itertools.cycle((True, False))
        yield lambda: next(turns) and client.call_async(GetParameters.Request(names=['damper']))
        node.destroy_node()


def _wait_for_matches(path: DataPath) -> None:
    while path.unmatched():
        time.sleep(0.01)


def _once(send: Step) -> Step:
    left = [send]
    return lambda: left.pop()() if left else None


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
    with KINDS[kind](int(domain), namespace) as step:
        print('ready', flush=True)
        sys.stdin.readline()
        while not select.select([sys.stdin], [], [], SAMPLE_TIME)[0]:
            step()
    end_process(0)


if __name__ == '__main__':
    main()
