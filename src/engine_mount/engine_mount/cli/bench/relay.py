"""A chain of empty nodes: CAN frame -> topic -> topic -> CAN frame, and nothing computed.

What one would write with rclpy and python-can alone, with the same delivery and sizes as the graph: what this
chain costs is the price of middleware and bus. Run as a process, `ends` stands where the driver stands,
`middle` where the controller stands; `measure` stands where the electronics stand.
"""

import contextlib
import sys
import threading
import time
from collections.abc import Iterator

import rclpy
from rclpy.executors import ExternalShutdownException
from rclpy.node import Node
from rclpy.qos import QoSProfile, ReliabilityPolicy
from sensor_msgs.msg import JointState

from mount_driver.can_library import can

GROUP = '239.74.163.3'  # chosen: a multicast group beside that of the graph
_SAMPLE, _ANSWER = 0x100, 0x101  # chosen: identifiers of the two frames
_SAMPLE_LENGTH, _ANSWER_LENGTH = 24, 12  # bytes: of MountMeasurement and MountSetpoint
_QOS = QoSProfile(depth=100, reliability=ReliabilityPolicy.BEST_EFFORT)
_NUMBER = 4  # bytes of a frame that count the samples
_FIRST_WAIT = 30.0  # s, chosen: until the first answer must have come
_LOOK = 0.2  # s: how often a loop looks whether it shall end


def main(part: str, port: int) -> None:
    """Run the part that is named until SIGINT."""
    rclpy.init()
    node = Node(f'relay_{part}', namespace='bench_relay', enable_rosout=False)
    work = _relay(node) if part == 'middle' else _bridge(node, _bus(port, _SAMPLE))
    with work, contextlib.suppress(KeyboardInterrupt, ExternalShutdownException):
        rclpy.spin(node)
    rclpy.try_shutdown()


def measure(port: int, seconds: float, rate: float) -> tuple[int, list[float]]:
    """Send at `rate` (Hz) for `seconds`; return how many samples and the latencies (s) of their answers."""
    bus = _bus(port, _ANSWER)
    try:
        _wait_for_answer(bus)
        return _sent(bus, seconds, rate)
    finally:
        bus.shutdown()


def _bus(port: int, received: int) -> can.BusABC:
    filters = [{'can_id': received, 'can_mask': 0x7FF, 'extended': False}]
    return can.Bus(
        interface='udp_multicast', channel=GROUP, port=port, hop_limit=0, fd=True, can_filters=filters
    )


def _frame(identifier: int, number: int, length: int) -> can.Message:
    data = number.to_bytes(_NUMBER, 'little').ljust(length, b'\0')
    return can.Message(arbitration_id=identifier, data=data, is_fd=True, is_extended_id=False)


def _number(message: can.Message) -> int:
    return int.from_bytes(message.data[:_NUMBER], 'little')


def _relay(node: Node) -> contextlib.AbstractContextManager[None]:
    """Hand on each message of one topic on another."""
    publisher = node.create_publisher(JointState, 'answer', 100)
    node.create_subscription(JointState, 'sample', publisher.publish, _QOS)
    return contextlib.nullcontext()


@contextlib.contextmanager
def _bridge(node: Node, bus: can.BusABC) -> Iterator[None]:
    """Make a message of each frame and a frame of each message, until the end of the context."""
    publisher = node.create_publisher(JointState, 'sample', 100)
    ending = threading.Event()

    def receive() -> None:
        while not ending.is_set():
            frame = bus.recv(_LOOK)
            if frame is not None:
                message = JointState(name=['mount'], position=[float(_number(frame))])
                message.header.stamp = node.get_clock().now().to_msg()
                publisher.publish(message)

    def answer(message: JointState) -> None:
        bus.send(_frame(_ANSWER, int(message.position[0]), _ANSWER_LENGTH))

    node.create_subscription(JointState, 'answer', answer, _QOS)
    thread = threading.Thread(target=receive, daemon=True)
    thread.start()
    try:
        yield
    finally:
        ending.set()
        thread.join()
        bus.shutdown()


def _wait_for_answer(bus: can.BusABC) -> None:
    """Return when the chain answers, and all that is under way has come."""
    limit = time.monotonic() + _FIRST_WAIT
    while time.monotonic() < limit:
        bus.send(_frame(_SAMPLE, 0, _SAMPLE_LENGTH))
        if bus.recv(0.002) is not None:
            while bus.recv(_LOOK) is not None:
                pass
            return
    raise TimeoutError(f'no answer of the relay chain within {_FIRST_WAIT:g} s; is the machine busy?')


def _sent(bus: can.BusABC, seconds: float, rate: float) -> tuple[int, list[float]]:
    count = round(seconds * rate)
    left, late = [0.0] * (count + 1), []
    begin = time.monotonic()
    for number in range(1, count + 1):
        while (frame := bus.recv(0.0)) is not None:
            late.append(frame.timestamp - left[_number(frame)])
        left[number] = time.time()
        bus.send(_frame(_SAMPLE, number, _SAMPLE_LENGTH))
        time.sleep(max(0.0, begin + number / rate - time.monotonic()))
    while (frame := bus.recv(_LOOK)) is not None:
        late.append(frame.timestamp - left[_number(frame)])
    return count, late


if __name__ == '__main__':
    main(sys.argv[1], int(sys.argv[2]))
