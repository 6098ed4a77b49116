"""Which nodes make up the graph, and in which order they come to life."""

from collections.abc import Mapping
from dataclasses import dataclass, field


@dataclass(frozen=True)
class GraphNode:
    """A lifecycle node: its name, its class in `package.node`, and the topics it cannot do without.

    A node that refuses to be activated is asked `activations` times.
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
    activations=3,  # chosen: the machine may be too busy for one ramp
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


URGENT: tuple[GraphNode, ...] = (DRIVER, SIM, INIT, CONTROL)
"""The nodes of the 1 kHz loop."""

LOCKSTEP_TOGETHER: tuple[GraphNode, ...] = (RECORDER, DRIVER, SIM, INIT, CONTROL)
"""The nodes that share a process and its data thread in lock-step: while one of them works the others wait
for it anyway, and handing over to another thread or process costs more than the work."""


@dataclass(frozen=True)
class GraphSettings:
    """Where the graph lives and with which parameters: {node: {parameter: value}}.

    Nodes named in `together` share one process, all others have one of their own. The processes of the
    `urgent` nodes run at the real-time `priority` (SCHED_FIFO; 0: off) where the system permits it.
    """

    namespace: str = ''
    domain: int = 0
    parameters: Mapping[str, Mapping[str, object]] = field(default_factory=dict)
    together: tuple[GraphNode, ...] = ()
    urgent: tuple[GraphNode, ...] = ()
    priority: int = 0
