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
from collections.abc import Callable, Iterator
from contextlib import ExitStack

import numpy as np
from rcl_interfaces.srv import GetParameters
from rclpy.node import Node

from mount_bringup.graph.domain import can_port
from mount_driver.bus import MULTICAST_GROUP, Frame, open_bus
from mount_driver.can_library import can
from mount_driver.can_messages import Measurement, Setpoint
from mount_driver.protocol import AliveCounter, MountCodec
from mount_models.sampling import HIGHEST_CURRENT, SAMPLE_TIME, SAMPLE_TIME_NS
from mount_ros import topics
from mount_ros.data_path import DataPath
from mount_ros.environment import prepare_environment
from mount_ros.messages.cdr import string_message
from mount_ros.messages.force_table import table_message
from mount_ros.messages.scalars import ScalarsLayout, stamp_of
from mount_ros.nodes.process import ros_context
from mount_ros.nodes.shutdown import end_process

Reply = Callable[[bytes], bytes | None]
Step = Callable[[], object]
"""Sends what is due in one period."""

_AT_ONCE = 5  # messages in each period
_MATCH_LIMIT = 5.0  # s, chosen: a graph that has detected the sender may be gone before it listens


def second_host(bus: can.BusABC) -> Step:
    """Answer each sample with 3 A, with counters of its own."""
    codec, alive = MountCodec(), AliveCounter()

    def step() -> None:
        while (frame := bus.recv(0.0)) is not None:
            if frame.arbitration_id == codec.measurement.frame_id:
                counter = codec.measurement.decode(frame.data)[1].sample_counter
                data = codec.encode_setpoint(Setpoint(HIGHEST_CURRENT, counter, True), alive.next())
                bus.send(Frame(codec.setpoint.frame_id, data))

    return step


def second_electronics(bus: can.BusABC) -> Step:
    """Send samples of a mount at rest, with counters of their own."""
    codec, alive, numbers = MountCodec(), AliveCounter(), itertools.count()

    def step() -> None:
        number = next(numbers)
        sample = Measurement(number & 0xFFFF, 1000 * number & 0xFFFFFFFF, 0.0, 0.0, math.nan, math.nan)
        bus.send(Frame(codec.measurement.frame_id, codec.encode_measurement(sample, alive.next())))

    return step


def garbage(port: int) -> Step:
    """Send datagrams to the group and port of the bus that are no frames."""
    draw = np.random.default_rng(1)
    sender = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
    sender.setsockopt(socket.IPPROTO_IP, socket.IP_MULTICAST_TTL, 0)
    sender.setsockopt(socket.IPPROTO_IP, socket.IP_MULTICAST_IF, socket.inet_aton('127.0.0.1'))
    return lambda: sender.sendto(draw.bytes(int(draw.integers(0, 200))), (MULTICAST_GROUP, port))


def setpoint(raw: bytes) -> bytes:
    """Return 3 A as the setpoint of a displacement."""
    return ScalarsLayout(topics.CURRENT_SETPOINT).pack(stamp_of(raw), (HIGHEST_CURRENT,))


_OWN_STAMPS: deque[int] = deque(maxlen=1000)  # of displacements, for they are received too


def displacement(raw: bytes) -> bytes | None:
    """Return a displacement half a sample beside one of the driver."""
    if stamp_of(raw) in _OWN_STAMPS:
        return None
    _OWN_STAMPS.append(stamp_of(raw) + SAMPLE_TIME_NS // 2)
    return ScalarsLayout(topics.DISPLACEMENT).pack(_OWN_STAMPS[-1], (0.003,))


def air_gap() -> Iterator[bytes]:
    """Yield other gaps, as if they had been measured now."""
    yield ScalarsLayout(topics.AIR_GAP).pack(time.time_ns(), (5e-4, 3e-4, 1e-6, 1e-6, 60.0, 0.5))


def table(currents: tuple[float, ...], forces: tuple[float, ...], stamp: int = 0) -> Iterator[bytes]:
    """Yield a current-force table (A, N) with a stamp (ns), by default that of now."""
    sound = table_message(stamp or time.time_ns(), np.array([sorted(currents), forces]))
    numbers = np.array([currents, forces]).tobytes()  # also what our own code would not send
    yield sound[: -len(numbers)] + numbers


def engine_speed(raw: bytes) -> bytes:
    """Return the speed of another engine at the time of a displacement."""
    return ScalarsLayout(topics.ENGINE_SPEED).pack(stamp_of(raw), (math.nan,), (100.0,))


_SOUND = (0.0, 1.0, 3.0), (0.0, 500.0, 1000.0)
_EVENT = string_message('flood ' + 'x' * 100)

ON_BUS = {'can_host': second_host, 'can_electronics': second_electronics}
MESSAGES: dict[str, tuple[topics.Topic, Reply | Iterator[bytes]]] = {
    'current_setpoint': (topics.CURRENT_SETPOINT, setpoint),
    'displacement': (topics.DISPLACEMENT, displacement),
    'engine_speed': (topics.ENGINE_SPEED, engine_speed),
    'air_gap': (topics.AIR_GAP, air_gap()),
    'table': (topics.CURRENT_FORCE_TABLE, table(*_SOUND)),
    'table_old': (topics.CURRENT_FORCE_TABLE, table(*_SOUND, 1_000_000_000)),
    'table_not_monotone': (topics.CURRENT_FORCE_TABLE, table((0.0, 2.0, 1.0), (0.0, 300.0, 500.0))),
    'flood_topic': (topics.EVENT, itertools.repeat(_EVENT)),
}
"""{kind: topic, and what is published of each displacement, or messages, a few in each period}."""


def _bus_step(kind: str, port: int, stack: ExitStack) -> Callable[[], Step]:
    if kind == 'can_garbage':
        return lambda: garbage(port)
    bus = open_bus('udp_multicast', MULTICAST_GROUP, port=port)
    stack.callback(bus.shutdown)
    return lambda: ON_BUS[kind](bus)


def _node_step(kind: str, domain: int, namespace: str, stack: ExitStack) -> Callable[[], Step]:
    context = stack.enter_context(ros_context(domain))
    node = Node('rogue_sender', namespace=namespace, context=context, start_parameter_services=False)
    stack.callback(node.destroy_node)
    if kind == 'flood_service':  # every second millisecond
        client = node.create_client(GetParameters, 'mount_control/get_parameters')
        client.wait_for_service(10.0)
        turns = itertools.cycle((True, False))
        return lambda: lambda: next(turns) and client.call_async(GetParameters.Request(names=['damper']))
    path = DataPath(node)
    stack.callback(path.stop)
    topic, sent = MESSAGES[kind]
    reply, messages = (sent, iter(())) if callable(sent) else (None, sent)
    senders: list[Callable[[bytes], None]] = []

    def send_reply(raw: bytes) -> None:
        for send in senders:
            if reply and (message := reply(raw)) is not None:
                send(message)

    if reply:
        path.subscribe(topics.DISPLACEMENT, send_reply)
        path.start()

    def begin() -> Step:
        """Publish once a node subscribes, or `_MATCH_LIMIT` is over."""
        send, end = path.sender(topic), time.monotonic() + _MATCH_LIMIT
        while path.unmatched() and time.monotonic() < end:
            time.sleep(0.01)
        senders.append(send)
        return lambda: [send(message) for message in itertools.islice(messages, _AT_ONCE)]

    return begin


def main() -> None:
    """Send as the command line says, from the first line of the input to its end."""
    prepare_environment()
    kind, domain, namespace = sys.argv[1], int(sys.argv[2]), sys.argv[3]
    with ExitStack() as stack:
        if kind.startswith('can_'):
            begin = _bus_step(kind, can_port(domain, namespace), stack)
        else:
            begin = _node_step(kind, domain, namespace, stack)
        print('ready', flush=True)
        sys.stdin.readline()
        step = begin()
        while not select.select([sys.stdin], [], [], SAMPLE_TIME)[0]:
            step()
    end_process(0)


if __name__ == '__main__':
    main()
