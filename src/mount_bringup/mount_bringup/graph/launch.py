"""The graph for `ros2 launch`: its processes, their supervisor, and the end of all with an end for good.

Needs the `launch_ros` of a ROS 2 installation; where there is none, `mount_bringup.graph.supervisor` does it.
"""

import contextlib
import sys
import tempfile
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from functools import partial
from pathlib import Path

from ament_index_python.packages import get_package_share_directory
from launch import LaunchContext, LaunchDescription, LaunchDescriptionEntity
from launch.actions import DeclareLaunchArgument, EmitEvent, LogInfo, OpaqueFunction, RegisterEventHandler
from launch.event_handlers import OnProcessExit
from launch.events import Shutdown
from launch.events.process import ProcessExited
from launch.logging import get_logger
from launch_ros.actions import Node

from mount_bringup.graph.composed import COMPOSED
from mount_bringup.graph.domain import domain_locks
from mount_bringup.graph.launch_arguments import LaunchArgument, check_arguments
from mount_bringup.graph.launched import SUPERVISOR, arguments_of, exit_error
from mount_bringup.graph.nodes import GraphNode, groups
from mount_bringup.graph.order import LaunchOrder, check_folder, launch_order
from mount_bringup.graph.processes import node_environment, parameter_text
from mount_bringup.graph.restarts import restartable
from mount_models.arithmetic.compiled import compilation_told
from mount_ros.environment import prepare_environment
from mount_ros.nodes.scheduling import drop_real_time, started_in_real_time

_PATIENCE = '10'  # s, chosen: until a node that was asked to end is terminated
_RESPAWN_DELAY = 0.2  # s, chosen: a node that dies at once must not keep the machine busy


def graph_description(
    nodes: Sequence[GraphNode], arguments: Sequence[LaunchArgument], config: str
) -> LaunchDescription:
    """Return the launch file of the graph of `nodes`; `config` is the name of the shipped parameter file."""
    file = Path(get_package_share_directory('mount_bringup')) / 'config' / config
    every = (LaunchArgument('config', 'parameter file of all nodes', default=str(file)), *arguments)
    return launch_description(every, partial(launch_order, nodes, arguments))


def launch_description(
    arguments: Sequence[LaunchArgument], order_of: Callable[[Mapping[str, str]], LaunchOrder]
) -> LaunchDescription:
    """Return the launch file that takes `arguments` and starts what `order_of` makes of their texts."""
    prepare_environment()  # discovery on this machine only, unless the user has chosen otherwise
    declared = [
        DeclareLaunchArgument(
            argument.name,
            default_value=argument.default,
            description=argument.description,
            choices=list(argument.choices) or None,
        )
        for argument in arguments
    ]
    return LaunchDescription([*declared, OpaqueFunction(function=partial(_graph, arguments, order_of))])


def _graph(
    arguments: Sequence[LaunchArgument],
    order_of: Callable[[Mapping[str, str]], LaunchOrder],
    context: LaunchContext,
) -> list[LaunchDescriptionEntity]:
    given = {argument.name: context.launch_configurations[argument.name] for argument in arguments}
    with compilation_told(get_logger('mount_bringup').info):  # the checks compute with the laws
        check_arguments(sys.argv, arguments)
        order = order_of(given)
    check_folder(order)
    inherited = drop_real_time()
    priority = order.settings.priority or inherited
    held = contextlib.ExitStack()  # until the last process has ended
    mounts = list(dict.fromkeys(node.mount for node in order.nodes if node.mount))
    held.enter_context(domain_locks(order.settings.domain, order.settings.namespace, mounts))
    grouped = groups(order.nodes, order.settings.grouping)
    respawned = {_name(group): _is_respawned(group, order) for group in grouped}
    processes = [_process(group, order, priority, held) for group in grouped]
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
    names = [*respawned, SUPERVISOR]
    running = set(names)

    def ended(name: str, event: ProcessExited, context: LaunchContext) -> EmitEvent | None:
        if respawned.get(name) and not context.is_shutdown:
            return None  # the supervisor brings it to life again, or ends by itself, and all with it
        running.discard(name)
        if not running:
            held.close()
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


def _process(
    nodes: Sequence[GraphNode], order: LaunchOrder, priority: int, held: contextlib.ExitStack
) -> Node:
    [first, *others] = nodes
    if others:
        place = {'package': 'mount_bringup', 'executable': COMPOSED}
        parameters: list[str | dict] = [_parameter_file(nodes, order, held)]
    else:
        place = {'package': first.package, 'executable': first.name, 'name': first.name}
        parameters = [dict(order.settings.parameters[first.full_name])]
    return Node(
        **place,
        namespace=f'{order.settings.namespace}/{first.mount}'.strip('/'),
        parameters=parameters,
        additional_env=node_environment(nodes, priority),
        ros_arguments=['--log-level', order.log_level],
        sigterm_timeout=_PATIENCE,
        respawn=_is_respawned(nodes, order),
        respawn_delay=_RESPAWN_DELAY,
        output='both',
    )


def _name(nodes: Sequence[GraphNode]) -> str:
    first = nodes[0]
    return first.full_name if len(nodes) == 1 else replace(first, name=COMPOSED).full_name


def _is_respawned(nodes: Sequence[GraphNode], order: LaunchOrder) -> bool:
    lockstep = any(values.get('lockstep') for values in order.settings.parameters.values())
    return not lockstep and restartable(nodes, order.settings.restart_limit)


def _parameter_file(nodes: Sequence[GraphNode], order: LaunchOrder, held: contextlib.ExitStack) -> str:
    """Return a file with the parameters of several nodes, which launch cannot tell apart by itself."""
    with tempfile.NamedTemporaryFile('w', prefix='mount_parameters_', suffix='.yaml', delete=False) as file:
        file.write(parameter_text(nodes, order.settings))
    held.callback(Path(file.name).unlink, missing_ok=True)
    return file.name
