"""The graph for `ros2 launch`: lifecycle nodes that come to life one after the other.

Needs the `launch_ros` of a ROS 2 installation; where there is none, `mount_bringup.graph.supervisor` does it.
"""

from collections.abc import Mapping, Sequence
from itertools import pairwise
from typing import Any

from launch import LaunchDescriptionEntity
from launch.actions import EmitEvent, RegisterEventHandler
from launch.events import matches_action
from launch_ros.actions import LifecycleNode
from launch_ros.event_handlers import OnStateTransition
from launch_ros.events.lifecycle import ChangeState
from lifecycle_msgs.msg import Transition

from mount_bringup.graph.nodes import GraphNode
from mount_ros.environment import prepare_environment


def launch_graph(
    nodes: Sequence[GraphNode], namespace: Any, parameters: Mapping[str, Sequence[Any]]
) -> list[LaunchDescriptionEntity]:
    """Return the actions that start `nodes`, configure all of them in order, then activate them in order.

    `parameters`: for each node its parameter files and dictionaries, the later ones win.
    """
    prepare_environment()  # discovery on this machine only, unless the user has chosen otherwise
    actions = [
        LifecycleNode(
            package=node.package,
            executable=node.name,
            name=node.name,
            namespace=namespace,
            parameters=list(parameters.get(node.name, ())),
            output='both',
        )
        for node in nodes
    ]
    handlers = _chain(actions, 'inactive', Transition.TRANSITION_CONFIGURE)
    handlers.append(_when(actions[-1], 'inactive', actions[0], Transition.TRANSITION_ACTIVATE))
    handlers += _chain(actions, 'active', Transition.TRANSITION_ACTIVATE)
    # Handlers first, so that no transition can happen unheard.
    return [*handlers, *actions, _emit(actions[0], Transition.TRANSITION_CONFIGURE)]


def _chain(actions: Sequence[LifecycleNode], state: str, transition: int) -> list[LaunchDescriptionEntity]:
    """Return handlers that take each node through `transition` when the one before has reached `state`."""
    return [_when(before, state, after, transition) for before, after in pairwise(actions)]


def _when(
    before: LifecycleNode, state: str, after: LifecycleNode, transition: int
) -> LaunchDescriptionEntity:
    start = 'configuring' if state == 'inactive' else 'activating'
    return RegisterEventHandler(
        OnStateTransition(
            target_lifecycle_node=before,
            start_state=start,
            goal_state=state,
            entities=[_emit(after, transition)],
        )
    )


def _emit(node: LifecycleNode, transition: int) -> EmitEvent:
    return EmitEvent(event=ChangeState(lifecycle_node_matcher=matches_action(node), transition_id=transition))
