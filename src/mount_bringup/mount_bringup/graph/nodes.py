"""Which nodes make up the graph, and in which order they come to life and end."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from enum import Enum


class GraphError(RuntimeError):
    """The graph could not be started or broke down; the text names the node and its reason."""


def name_in(mount: str, name: str) -> str:
    """Return the name of a node or topic of a mount within the namespace of the graph."""
    return f'{mount}/{name}' if mount else name


Figures = Mapping[str, str]
"""The figures of a report on `/diagnostics`, its `level` and `sentence`; empty where there is no report."""


@dataclass(frozen=True)
class GraphNode:
    """A lifecycle node of the package of its name, and the topics that it cannot do without.

    `mount` is the namespace of its mount within that of the graph, empty where there is one mount alone, or
    for what all mounts share.
    """

    name: str
    needs: tuple[str, ...] = ()
    mount: str = ''

    @property
    def class_name(self) -> str:
        """Its class in `node.py` of its package."""
        return self.name.title().replace('_', '')

    @property
    def full_name(self) -> str:
        """The name within the graph's namespace, such as `left/mount_driver`."""
        return name_in(self.mount, self.name)

    def is_a(self, *others: 'GraphNode') -> bool:
        """Whether it is one of these nodes, of whichever mount."""
        return self.name in {other.name for other in others}


RECORDER = GraphNode('mount_recorder')
DRIVER = GraphNode('mount_driver', ('current_setpoint', 'displacement', 'coil_ripple', 'coil_temperature'))
SIM = GraphNode('mount_sim')
INIT = GraphNode('mount_init', ('coil_ripple', 'coil_temperature', 'current_setpoint'))
CONTROL = GraphNode('mount_control', ('displacement', 'current_setpoint', 'air_gap', 'current_force_table'))

SIMULATED: tuple[GraphNode, ...] = (RECORDER, DRIVER, SIM, INIT, CONTROL)
"""Start order: a subscriber before its publisher, and the coil's table before the node that uses it."""

VEHICLE: tuple[GraphNode, ...] = (RECORDER, DRIVER, INIT, CONTROL)
"""The same in the car, where the electronics are real."""


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
    shared: dict[object, list[GraphNode]] = {}
    for node in nodes:
        composed = grouping is Grouping.COMPOSED and node.is_a(DRIVER, INIT, CONTROL)
        place = grouping if grouping is Grouping.TOGETHER else node.mount if composed else node
        shared.setdefault(place, []).append(node)
    return list(shared.values())


RESTART_LIMIT = 3
"""Times (chosen) that a node may be lost within a minute."""


@dataclass(frozen=True)
class GraphSettings:
    """Where the graph runs and with which parameters: {node: {parameter: value}}.

    The nodes share processes as `grouping` says. In lock-step all share one: while one of them works the
    others wait for it anyway, and handing over to another thread or process costs more than the work. Where
    the system permits it the processes run at the real-time `priority` (SCHED_FIFO; 0: off), the recorder's
    behind those of the 1 kHz loop. In real time a node may be lost `restart_limit` times within a minute
    before the graph is given up; 0: the first loss ends it. They log from `log_level` on, to files, or to
    the screen.
    """

    namespace: str = ''
    domain: int = 0
    parameters: Mapping[str, Mapping[str, object]] = field(default_factory=dict)
    grouping: Grouping = Grouping.APART
    priority: int = 0
    restart_limit: int = RESTART_LIMIT
    log_level: str = 'info'
    log_to_screen: bool = False
