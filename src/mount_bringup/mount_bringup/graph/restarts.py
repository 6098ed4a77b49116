"""Which node is started again after its end, what follows, how often, and when the graph is given up.

The one policy of a graph: the supervisor follows it where it has the processes itself and where `ros2 launch`
has them, and launch asks it whether to respawn. Only in real time: in lock-step a dead node ends the run.
"""

from collections import deque
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from enum import Enum

from mount_bringup.graph.errors import GraphError
from mount_bringup.graph.nodes import CONTROL, DRIVER, INIT, RECORDER, SIM, GraphNode
from mount_models.sampling import sample_time_ns
from mount_ros.messages.verdicts import flags_of

_WINDOW = 60.0  # s, chosen: within which the losses of a node are counted


class Remedy(Enum):
    """What brings a graph back to work after the end of a node, in words."""

    END = 'the graph ends'
    RECORD_ANEW = 'it is started again with a new recording'
    STAND_BY = 'it is started again and left inactive, for its result still holds'
    DAMP_ON = 'it is started again and activated with the table that holds'
    INITIALISE = 'the mount is initialised anew'


REMEDIES: dict[str, Remedy] = {
    RECORDER.name: Remedy.RECORD_ANEW,
    # Nothing of the last initialisation is known to hold of electronics that nobody has listened to.
    DRIVER.name: Remedy.INITIALISE,
    # Gaps and table stand as long as the electronics do; a ramp would only take the damping away.
    INIT.name: Remedy.STAND_BY,
    CONTROL.name: Remedy.DAMP_ON,
    # The electronics themselves: there is nothing left to drive.
    SIM.name: Remedy.END,
}
"""What follows the end of each node."""


@dataclass(frozen=True)
class Loss:
    """Nodes that ended or hang, or none where the electronics lost their initialisation, and why."""

    nodes: tuple[GraphNode, ...]
    reason: str

    @property
    def names(self) -> str:
        """The nodes, for people."""
        return ' + '.join(node.full_name for node in self.nodes) or 'electronics'

    def with_more(self, other: 'Loss') -> 'Loss':
        """Return this loss with another that came while it was made good."""
        nodes = (*self.nodes, *(node for node in other.nodes if node not in self.nodes))
        return Loss(nodes, f'{self.reason}; then {other.reason}')


class NodesLostError(GraphError):
    """Nodes of the graph were lost; without a remedy the text is why the graph ends."""

    def __init__(self, loss: Loss):
        super().__init__(loss.reason)
        self.loss = loss


@dataclass(frozen=True)
class Restart:
    """A loss that was made good: when (ns, system clock), and how long that took (s)."""

    time: int
    loss: Loss
    remedy: Remedy
    took: float

    @property
    def sentence(self) -> str:
        """What happened, for people."""
        return f'{self.loss.reason}; {self.remedy.value}: back after {self.took:.1f} s'


def restartable(nodes: Iterable[GraphNode], limit: int) -> bool:
    """Return whether a process in which `nodes` live is ever started again; `limit` as in `RestartCount`."""
    return limit > 0 and all(REMEDIES[node.name] is not Remedy.END for node in nodes)


def remedy(loss: Loss, table_holds: bool) -> Remedy:
    """Return what follows a loss; `table_holds`: mount_init is active, its table of these electronics.

    A control without a valid table would only be refused, and electronics that were reset have forgotten all.
    """
    asked = {REMEDIES[node.name] for node in loss.nodes} or {Remedy.INITIALISE}
    if Remedy.DAMP_ON in asked and (Remedy.STAND_BY in asked or not table_holds):
        asked.add(Remedy.INITIALISE)
    for first in (Remedy.END, Remedy.INITIALISE, Remedy.DAMP_ON, Remedy.RECORD_ANEW):
        if first in asked:
            return first
    return Remedy.STAND_BY


class RestartCount:
    """Counts the losses of each node; above `limit` within a minute the graph is given up, 0: the first."""

    def __init__(self, limit: int):
        self._limit = limit
        self._times: dict[str, deque[float]] = {}

    def note(self, loss: Loss, now: float) -> None:
        """Count a loss at the steady time `now` (s); raise `GraphError` where the graph is to be given up."""
        if self._limit == 0:
            raise NodesLostError(loss)
        for name in [node.full_name for node in loss.nodes] or [loss.names]:
            if REMEDIES.get(name.rpartition('/')[2]) is Remedy.END:
                raise GraphError(f'{loss.reason}; without it there is no coil to drive: {Remedy.END.value}')
            times = self._times.setdefault(name, deque())
            while times and now - times[0] > _WINDOW:
                times.popleft()
            times.append(now)
            if len(times) > self._limit:
                raise GraphError(
                    f'{loss.reason}; {name} was lost {len(times)} times within {_WINDOW:g} s '
                    f'(limit {self._limit}), so the graph is given up at 0 A: read the logs for the cause'
                )


def table_holds(driver: Mapping[str, str], init: Mapping[str, str]) -> bool:
    """Return whether the table of `mount_init` is of the measurements that come now, by the figures of both.

    It is where the driver has taken samples without a break since before the table was made. One that was
    activated since, or heard the electronics pause or restart, cannot say so.
    """
    try:
        whole = int(driver['restarts']) == 0 == int(driver['gaps'])
        period = sample_time_ns(float(driver['sample_rate']))
        taken = (int(driver['samples']) + int(driver['lost'])) * period
        since = int(driver['last_stamp']) - int(init['last_stamp'])
    except (KeyError, ValueError):
        return False
    both_active = driver.get('state') == init.get('state') == 'active'
    return both_active and whole and taken > since and not flags_of(driver).needs_initialisation
