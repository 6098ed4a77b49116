"""The whole initialisation of a mount again while its graph runs, when somebody asks for it by a service."""

from collections.abc import Callable, Sequence
from functools import partial
from typing import Any, Protocol

from lifecycle_msgs.msg import State, Transition
from lifecycle_msgs.srv import GetState
from rclpy.callback_groups import MutuallyExclusiveCallbackGroup
from rclpy.node import Node
from std_srvs.srv import Trigger

from mount_bringup.graph.errors import GraphError
from mount_bringup.graph.nodes import CONTROL, DRIVER, INIT, GraphNode
from mount_bringup.graph.verdicts import Verdicts

SERVICE = 'reinitialize'
_FRESH_LIMIT = 5.0  # s, chosen: for diagnostics, which come once a second

Begin = Callable[[str], str]
"""Initialises the mount of this name anew, all if empty; returns what came of it or raises `GraphError`."""


class Graph(Protocol):
    """What an initialisation asks of a running graph."""

    nodes: tuple[GraphNode, ...]
    verdicts: Verdicts

    def figures(self, node: GraphNode) -> dict[str, str]: ...
    def transition(self, node: GraphNode, transition: int) -> None: ...
    def activate(self, node: GraphNode, say: Callable[[str], None]) -> None: ...
    def wait_for_matches(self) -> None: ...
    def wait_until(self, condition: Callable[[], bool], limit: float, what: str) -> None: ...
    def call(self, kind: Any, service: str, request: Any) -> Any: ...


def offer(node: Node, mounts: Sequence[str], begin: Begin) -> None:
    """Offer `~/reinitialize` of `node`, and for each of several mounts `~/<mount>/reinitialize`.

    The answer may serve the executor of `node` meanwhile: its callback group has nothing else.
    """
    group = MutuallyExclusiveCallbackGroup()
    for mount in dict.fromkeys(['', *mounts]):
        name = f'~/{mount}/{SERVICE}' if mount else f'~/{SERVICE}'
        node.create_service(Trigger, name, partial(_answer, begin, mount), callback_group=group)


def initialise_anew(graph: Graph, mount: str) -> str:
    """Return what the gaps are now: 0 A, a new ramp and table, and a new activation of the control.

    Of the mount of this name, of all if it is empty. Where it raises `GraphError` control is not active.
    """
    nodes = [node for node in graph.nodes if node.is_a(DRIVER, INIT, CONTROL)]
    nodes = [node for node in nodes if not mount or node.mount == mount]
    for node in reversed(nodes):  # control first: damping off, 0 A
        deactivate(graph, node)
    graph.wait_for_matches()
    for node in nodes:
        graph.activate(node, lambda _: None)
    return '; '.join(_told(graph, node) for node in nodes if node.is_a(INIT))


def deactivate(graph: Graph, node: GraphNode) -> None:
    """Deactivate a node if it is active."""
    state = graph.call(GetState, f'{node.full_name}/get_state', GetState.Request()).current_state
    if state.id == State.PRIMARY_STATE_ACTIVE:
        graph.transition(node, Transition.TRANSITION_DEACTIVATE)


def _told(graph: Graph, node: GraphNode) -> str:
    """Return what `mount_init` says of its result."""
    graph.verdicts.forget(node)
    graph.wait_until(lambda: bool(graph.figures(node)), _FRESH_LIMIT, f'a word of {node.full_name}')
    return f'{node.full_name}: {graph.figures(node)["sentence"]}'


def _answer(begin: Begin, mount: str, _: Trigger.Request, response: Trigger.Response) -> Trigger.Response:
    try:
        response.message = f'initialised anew; {begin(mount)}'
        response.success = True
    except GraphError as error:
        response.message = f'not initialised, the coil stays at 0 A: {error}'
    return response
