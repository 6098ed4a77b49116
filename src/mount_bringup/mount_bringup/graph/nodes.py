"""Which nodes make up the graph, and in which order they come to life and end."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from enum import Enum


@dataclass(frozen=True)
class GraphNode:
    """A lifecycle node: its name, its class in `package.node`, and the topics it cannot do without.

    `mount` is the namespace of its mount within that of the graph, empty where there is one mount alone, or
    for what all mounts share. A node that refuses to be activated is asked `activations` times; those at
    which the machine was too late for the 1 kHz loop do not count.
    """

    name: str
    package: str
    class_name: str
    needs: tuple[str, ...]
    activations: int = 1
    mount: str = ''

    @property
    def full_name(self) -> str:
        """The name within the graph's namespace, such as `left/mount_driver`."""
        return f'{self.mount}/{self.name}' if self.mount else self.name

    def is_a(self, *others: 'GraphNode') -> bool:
        """Whether it is one of these nodes, of whichever mount."""
        return self.name in {other.name for other in others}


RECORDER = GraphNode('mount_recorder', 'mount_recorder', 'MountRecorder', ())
DRIVER = GraphNode(
    'mount_driver',
    'mount_driver',
    'MountDriver',
    ('current_setpoint', 'displacement', 'coil_ripple', 'coil_temperature'),
)
SIM = GraphNode('mount_sim', 'mount_sim', 'MountSim', ())
INIT = GraphNode(
    'mount_init',
    'mount_init',
    'MountInit',
    ('coil_ripple', 'coil_temperature', 'current_setpoint'),
    activations=2,  # chosen
)
CONTROL = GraphNode(
    'mount_control',
    'mount_control',
    'MountControl',
    ('displacement', 'current_setpoint', 'air_gap', 'current_force_table'),
)

SIMULATED: tuple[GraphNode, ...] = (RECORDER, DRIVER, SIM, INIT, CONTROL)
"""Start order: who listens comes before who speaks, and the coil's table before who uses it."""

VEHICLE: tuple[GraphNode, ...] = (RECORDER, DRIVER, INIT, CONTROL)
"""The same in the car, where the electronics are real."""

REPLAYED: tuple[GraphNode, ...] = (RECORDER, CONTROL)
"""The nodes to which a recording is played."""


def of_mounts(nodes: Sequence[GraphNode], mounts: Sequence[str]) -> tuple[GraphNode, ...]:
    """Return `nodes` with those of each of `mounts` in the place of those of one; without any as they are."""
    if not mounts:
        return tuple(nodes)
    placed: list[GraphNode] = []
    for node in nodes:
        of_each = node.is_a(DRIVER, INIT, CONTROL)
        placed += [replace(node, mount=mount) for mount in mounts] if of_each else [node]
    return tuple(placed)


def ending_order(nodes: Sequence[GraphNode]) -> list[GraphNode]:
    """Return `nodes` as they end: last started first, but the electronics outlive the driver.

    Real ones do. A driver whose electronics end first would rightly report that they are silent.
    """
    last = [node for end in (SIM, RECORDER) for node in nodes if node == end]
    return [*(node for node in reversed(nodes) if node not in last), *last]


class Grouping(Enum):
    """Which nodes share a process, and in it a data thread."""

    APART = 'each node has a process of its own'
    COMPOSED = 'driver, initialisation and control of the mount share one'
    TOGETHER = 'all nodes share one'


def groups(nodes: Sequence[GraphNode], grouping: Grouping) -> list[list[GraphNode]]:
    """Return the nodes of each process, in start order."""
    if grouping is Grouping.TOGETHER:
        return [list(nodes)]
    if grouping is Grouping.APART:
        return [[node] for node in nodes]

    def beside(driver: GraphNode) -> list[GraphNode]:
        return [node for node in nodes if node.is_a(DRIVER, INIT, CONTROL) and node.mount == driver.mount]

    return [beside(node) if node.is_a(DRIVER) else [node] for node in nodes if not node.is_a(INIT, CONTROL)]


RESTART_LIMIT = 3
"""Times (chosen) that a node may be lost within a minute."""


@dataclass(frozen=True)
class GraphSettings:
    """Where the graph runs and with which parameters: {node: {parameter: value}}.

    The nodes share processes as `grouping` says. In lock-step all share one: while one of them works the
    others wait for it anyway, and handing over to another thread or process costs more than the work. Where
    the system permits it the processes run at the real-time `priority` (SCHED_FIFO; 0: off), the recorder's
    behind those of the 1 kHz loop. In real time a node may be lost `restart_limit` times within a minute
    before the graph is given up; 0: the first loss ends it.
    """

    namespace: str = ''
    domain: int = 0
    parameters: Mapping[str, Mapping[str, object]] = field(default_factory=dict)
    grouping: Grouping = Grouping.APART
    priority: int = 0
    restart_limit: int = RESTART_LIMIT
