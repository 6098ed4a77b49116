"""The graph for `ros2 launch`: its processes, their supervisor, and the end of all with the first that ends.

Needs the `launch_ros` of a ROS 2 installation; where there is none, `mount_bringup.graph.supervisor` does it.
"""

import contextlib
from collections.abc import Sequence
from functools import partial
from pathlib import Path

from ament_index_python.packages import get_package_share_directory
from launch import LaunchContext, LaunchDescription, LaunchDescriptionEntity
from launch.actions import DeclareLaunchArgument, EmitEvent, LogInfo, OpaqueFunction, RegisterEventHandler
from launch.event_handlers import OnProcessExit
from launch.events import Shutdown
from launch.events.process import ProcessExited
from launch_ros.actions import Node

from mount_bringup.graph.domain import domain_lock
from mount_bringup.graph.launched import SUPERVISOR, arguments_of, exit_error
from mount_bringup.graph.nodes import GraphNode
from mount_bringup.graph.order import LaunchArgument, LaunchOrder, launch_order
from mount_bringup.graph.processes import node_environment
from mount_ros.environment import prepare_environment
from mount_ros.nodes.scheduling import drop_real_time, started_in_real_time

_PATIENCE = '10'  # s, chosen: until a node that was asked to end is terminated


def launch_description(
    nodes: Sequence[GraphNode], arguments: Sequence[LaunchArgument], config: str
) -> LaunchDescription:
    """Return the launch file of `nodes`; `config` is the name of the shipped parameter file."""
    prepare_environment()  # discovery on this machine only, unless the user has chosen otherwise
    file = Path(get_package_share_directory('mount_bringup')) / 'config' / config
    every = (LaunchArgument('config', 'parameter file of all nodes', default=str(file)), *arguments)
    declared = [
        DeclareLaunchArgument(
            argument.name,
            default_value=argument.default,
            description=argument.description,
            choices=list(argument.choices) or None,
        )
        for argument in every
    ]
    return LaunchDescription([*declared, OpaqueFunction(function=partial(_graph, nodes, every))])


def _graph(
    nodes: Sequence[GraphNode], arguments: Sequence[LaunchArgument], context: LaunchContext
) -> list[LaunchDescriptionEntity]:
    given = {argument.name: context.launch_configurations[argument.name] for argument in arguments}
    order = launch_order(nodes, arguments, given)
    inherited = drop_real_time()
    lock = contextlib.ExitStack()
    lock.enter_context(domain_lock(order.settings.domain, order.settings.namespace))
    priority = order.settings.priority or inherited
    processes = [_node(node, order, priority) for node in order.nodes]
    processes.append(
        Node(
            package='mount_bringup',
            executable=SUPERVISOR,
            arguments=arguments_of(order),
            additional_env=node_environment((), 0),
            sigterm_timeout=_PATIENCE,
            output='both',
        )
    )
    names = [*(node.name for node in order.nodes), SUPERVISOR]
    running = set(names)

    def ended(name: str, event: ProcessExited, context: LaunchContext) -> EmitEvent:
        running.discard(name)
        if not running:
            lock.close()
        error = exit_error(name, event.returncode, asked=context.is_shutdown)
        if error:
            raise RuntimeError(error)  # by which launch ends everything, with exit code 1
        return EmitEvent(event=Shutdown(reason=f'{name} has ended'))

    handlers = [
        RegisterEventHandler(OnProcessExit(target_action=process, on_exit=partial(ended, name)))
        for name, process in zip(names, processes, strict=True)
    ]
    told = [LogInfo(msg=started_in_real_time(inherited))] if inherited else []
    return [*told, *handlers, *processes]  # handlers first, so that no end can happen unheard


def _node(node: GraphNode, order: LaunchOrder, priority: int) -> Node:
    return Node(
        package=node.package,
        executable=node.name,
        name=node.name,
        namespace=order.settings.namespace,
        parameters=[dict(order.settings.parameters[node.name])],
        additional_env=node_environment((node,), priority),
        ros_arguments=['--log-level', order.log_level],
        sigterm_timeout=_PATIENCE,
        output='both',
    )
