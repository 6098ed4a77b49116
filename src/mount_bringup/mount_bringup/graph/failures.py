"""The policy after a failure of nodes: which action follows, how often, and when the graph is given up."""

from collections import deque
from dataclasses import dataclass
from enum import Enum

from mount_bringup.graph.nodes import (
    CONTROL,
    DRIVER,
    INIT,
    RECORDER,
    SIM,
    Figures,
    GraphError,
    GraphNode,
)
from mount_models.sampling import sample_time_ns
from mount_ros.messages.verdicts import flags_of

_WINDOW = 60.0  # s, chosen: within which the failures of a node are counted


class RecoveryAction(Enum):
    """How a graph comes back to work after a failure, in words; those that include others first."""

    END = 'the graph ends'
    INITIALISE = 'the mount is initialised anew'
    DAMP_ON = 'it is started again and activated with the table that holds'
    RECORD_ANEW = 'it is started again with a new recording'
    STAND_BY = 'it is started again and left inactive, for its result still holds'


ACTIONS: dict[str, RecoveryAction] = {
    RECORDER.name: RecoveryAction.RECORD_ANEW,
    # Nothing of the last initialisation is known to hold of electronics that nobody has listened to.
    DRIVER.name: RecoveryAction.INITIALISE,
    # Gaps and table stand as long as the electronics do; a ramp would only take the damping away.
    INIT.name: RecoveryAction.STAND_BY,
    CONTROL.name: RecoveryAction.DAMP_ON,
    # The electronics themselves: there is nothing left to drive.
    SIM.name: RecoveryAction.END,
}
"""The action after the failure of each node."""


@dataclass(frozen=True)
class NodeFailure:
    """Nodes that ended or hang, or none where the electronics lost their initialisation, and why."""

    nodes: tuple[GraphNode, ...]
    reason: str

    @property
    def names(self) -> str:
        """The nodes, for people."""
        return ' + '.join(node.full_name for node in self.nodes) or 'electronics'

    def with_more(self, other: 'NodeFailure') -> 'NodeFailure':
        """Return this failure with another that came during the recovery."""
        nodes = (*self.nodes, *(node for node in other.nodes if node not in self.nodes))
        return NodeFailure(nodes, f'{self.reason}; then {other.reason}')


class NodesFailedError(GraphError):
    """Nodes of the graph failed; the text is why the graph ends where they are not started again."""

    def __init__(self, failure: NodeFailure):
        super().__init__(failure.reason)
        self.failure = failure


@dataclass(frozen=True)
class Restart:
    """A recovery: when the failure was seen (ns, system clock), and how long it took (s)."""

    time: int
    failure: NodeFailure
    action: RecoveryAction
    took: float

    @property
    def sentence(self) -> str:
        """What happened, for people."""
        return f'{self.failure.reason}; {self.action.value}: back after {self.took:.1f} s'


def recovery_action(failure: NodeFailure, *, table_holds: bool) -> RecoveryAction:
    """Return the action after a failure.

    A control without a valid table would only be refused, and electronics that were reset have forgotten all.
    """
    actions = {ACTIONS[node.name] for node in failure.nodes} or {RecoveryAction.INITIALISE}
    if RecoveryAction.DAMP_ON in actions and (RecoveryAction.STAND_BY in actions or not table_holds):
        actions.add(RecoveryAction.INITIALISE)
    return next(action for action in RecoveryAction if action in actions)


def table_holds(driver: Figures, init: Figures) -> bool:
    """Return whether the table of `mount_init` is of the measurements that come now, by the figures of both.

    It is where the driver has taken samples without a break since before the table was made. A driver that
    was activated since, or saw the electronics pause or restart, cannot say so.
    """
    try:
        whole = int(driver['restarts']) == 0 == int(driver['gaps'])
        period = sample_time_ns(float(driver['sample_rate']))
        measured = (int(driver['samples']) + int(driver['lost'])) * period
        since = int(driver['last_stamp']) - int(init['last_stamp'])
    except (KeyError, ValueError):
        return False
    both_active = driver.get('state') == init.get('state') == 'active'
    return both_active and whole and measured > since and not flags_of(driver).needs_initialisation


class FailureCount:
    """Counts the failures of each node: more than `limit` within a minute end the graph, 0: the first."""

    def __init__(self, limit: int):
        self._limit = limit
        self._times: dict[str, deque[float]] = {}

    def note(self, failure: NodeFailure, now: float) -> None:
        """Count a failure at the steady time `now` (s); raise `GraphError` where it ends the graph."""
        if self._limit == 0:
            raise NodesFailedError(failure)
        if any(ACTIONS[node.name] is RecoveryAction.END for node in failure.nodes):
            raise GraphError(f'{failure.reason}; without it there is no coil to drive: the graph ends')
        for name in [node.full_name for node in failure.nodes] or [failure.names]:
            times = self._times.setdefault(name, deque())
            while times and now - times[0] > _WINDOW:
                times.popleft()
            times.append(now)
            if len(times) > self._limit:
                raise GraphError(
                    f'{failure.reason}; {name} was lost {len(times)} times within {_WINDOW:g} s '
                    f'(limit {self._limit}), so the graph is given up at 0 A: read the logs for the cause'
                )
