"""Which nodes make up the graph, and in which order they come to life and end."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field


@dataclass(frozen=True)
class GraphNode:
    """A lifecycle node: its name, its class in `package.node`, and the topics it cannot do without.

    A node that refuses to be activated is asked `activations` times; those at which the machine was too late
    for the 1 kHz loop do not count.
    """

    name: str
    package: str
    class_name: str
    needs: tuple[str, ...]
    activations: int = 1


RECORDER = GraphNode('mount_recorder', 'mount_bags', 'MountRecorder', ())
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


def ending_order(nodes: Sequence[GraphNode]) -> list[GraphNode]:
    """Return `nodes` as they end: last started first, but the electronics outlive the driver.

    Real ones do. A driver whose electronics end first would rightly report that they are silent.
    """
    last = [node for node in (SIM, RECORDER) if node in nodes]
    return [*(node for node in reversed(nodes) if node not in last), *last]


@dataclass(frozen=True)
class GraphSettings:
    """Where the graph runs and with which parameters: {node: {parameter: value}}.

    The nodes live `together` in one process with one data thread, or each in a process of its own. While one
    of them works in lock-step the others wait for it anyway, and handing over to another thread or process
    costs more than the work. Where the system permits it the processes run at the real-time `priority`
    (SCHED_FIFO; 0: off), the recorder's behind those of the 1 kHz loop.
    """

    namespace: str = ''
    domain: int = 0
    parameters: Mapping[str, Mapping[str, object]] = field(default_factory=dict)
    together: bool = False
    priority: int = 0
