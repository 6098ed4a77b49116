"""What can be seen of a running graph from outside: the CAN bus, the simulated truth, `/diagnostics`.

None of it asks the graph: it is another participant of the bus, and another subscriber. Times are on the
steady clock, s; those of frames are the kernel's.
"""

import bisect
import threading
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from operator import attrgetter
from typing import NamedTuple, TypeVar

from rclpy.context import Context
from rclpy.node import Node

from mount_bringup.graph.nodes import DRIVER
from mount_driver.bus import MULTICAST_GROUP, Reception, open_bus
from mount_driver.protocol import MountCodec
from mount_ros.data_path import DataPath
from mount_ros.messages.scalars import ScalarsLayout
from mount_ros.messages.verdicts import verdicts_of
from mount_ros.nodes.diagnostics import Level
from mount_ros.topics import AIR_GAP, DIAGNOSTICS, SIM_TRUTH

_REPEATED = 3.0  # s, chosen: each node repeats its verdict once a second
_LOOK_PERIOD = 0.1  # s: how often a listener looks whether it shall end


class Setpoint(NamedTuple):
    """A setpoint frame on the bus; its current (A) is 0 where it switches off."""

    time: float
    current: float


class Truth(NamedTuple):
    """The simulated truth: the coil's current, and what the electronics made it follow, A."""

    time: float
    coil_current: float
    followed: float


class Report(NamedTuple):
    """A verdict on `/diagnostics`; `level` as in `mount_ros.nodes.diagnostics.Level`."""

    time: float
    node: str
    level: int
    sentence: str


Timed = TypeVar('Timed', Setpoint, Truth, Report)


def since(entries: Sequence[Timed], begin: float, end: float = float('inf')) -> list[Timed]:
    """Return the entries with begin <= time <= end; both clocks run on, so they are in order."""
    first = bisect.bisect_left(entries, begin, key=attrgetter('time'))
    last = bisect.bisect_right(entries, end, key=attrgetter('time'))
    return list(entries[first:last])


class Observers:
    """What was seen of one graph since the observers began, each in the order of time."""

    def __init__(self, namespace: str):
        self.setpoints: list[Setpoint] = []
        self.truths: list[Truth] = []
        self.reports: list[Report] = []
        self.initialisations: list[float] = []
        """When gaps came: the ends of initialisations."""
        self.active: set[str] = set()
        """The nodes that said last that they are active."""
        self._namespace = namespace
        self._codec = MountCodec()
        self._truth = ScalarsLayout(SIM_TRUTH)
        self._places = [self._truth.names.index(name) for name in ('coil_current', 'current_setpoint')]
        # The kernel stamps frames by the system clock, which is not stepped while this runs.
        self._epoch = time.time() - time.monotonic()

    def take_truth(self, raw: bytes) -> None:
        """Note a message of `sim/truth`."""
        numbers = self._truth.unpack(raw)[1]
        self.truths.append(Truth(time.monotonic(), *(numbers[place] for place in self._places)))

    def take_diagnostics(self, raw: bytes) -> None:
        """Note the verdicts of this graph; `/diagnostics` belongs to all."""
        now = time.monotonic()
        for verdict in verdicts_of(raw):
            space, _, node = verdict.node.rpartition('/')
            if space == self._namespace:
                self.reports.append(Report(now, node, verdict.level, verdict.sentence))
                active = verdict.figures.get('state') == 'active'
                (self.active.add if active else self.active.discard)(node)

    def is_quiet(self, reports_fault: Callable[[Report], bool]) -> bool:
        """Whether the driver reports that nothing is wrong, and no node what `reports_fault` picks."""
        latest = {each.node: each for each in since(self.reports, time.monotonic() - _REPEATED)}
        driver = latest.get(DRIVER.name)
        well = driver is not None and driver.level == Level.OK
        return well and not any(map(reports_fault, latest.values()))

    def listen(self, port: int, ending: threading.Event) -> None:
        """Note the setpoint frames on the bus at a UDP port; one that no electronics would take is none."""
        bus = open_bus('udp_multicast', MULTICAST_GROUP, port=port, receive=[self._codec.setpoint.frame_id])
        layout, reception = self._codec.setpoint, Reception()  # what cannot be read is one of the faults
        while not ending.is_set():
            frame = reception.frame(bus, _LOOK_PERIOD)
            if frame is None or not layout.is_sound(frame.data):
                continue
            if setpoint := layout.decode(frame.data)[1]:
                current = setpoint.current if setpoint.enable else 0.0
                self.setpoints.append(Setpoint(frame.timestamp - self._epoch, current))
        bus.shutdown()


@contextmanager
def observers(context: Context, namespace: str, port: int) -> Iterator[Observers]:
    """Observe the graph of a namespace whose CAN bus has a UDP port, while the context lasts."""
    observed = Observers(namespace)
    node = Node('observer', namespace=namespace, context=context, start_parameter_services=False)
    path = DataPath(node)
    path.subscribe(SIM_TRUTH, observed.take_truth)
    path.subscribe(DIAGNOSTICS, observed.take_diagnostics)
    path.subscribe(AIR_GAP, lambda raw: observed.initialisations.append(time.monotonic()))
    path.start()
    ending = threading.Event()
    listener = threading.Thread(target=observed.listen, args=(port, ending), name='bus', daemon=True)
    listener.start()
    try:
        yield observed
    finally:
        ending.set()
        listener.join()
        path.stop()
        node.destroy_node()
