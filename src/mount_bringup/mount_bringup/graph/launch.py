"""The launch files: they start the supervisor, which checks the arguments and owns all other processes.

Needs the `launch` of a ROS 2 installation; where there is none, the executable `mount_supervisor` takes the
same arguments.
"""

import signal
import sys
from functools import partial
from pathlib import Path

from ament_index_python.packages import get_package_share_directory
from launch import LaunchContext, LaunchDescription, LaunchDescriptionEntity
from launch.actions import DeclareLaunchArgument, EmitEvent, ExecuteProcess, OpaqueFunction
from launch.events import Shutdown
from launch.events.process import ProcessExited

from mount_bringup.graph.order import arguments_of, texts_of
from mount_bringup.graph.processes import QUIET_START
from mount_bringup.graph.run import SUPERVISOR
from mount_ros.nodes.process import environment_of_children

_PATIENCE = '86400'  # s, chosen: the supervisor has limits of its own, and a recorder may write for long


def launch_description(graph: str) -> LaunchDescription:
    """Return the launch file of a graph; its shipped parameter file is the default of `config`."""
    config = Path(get_package_share_directory('mount_bringup')) / 'config' / f'{graph}.yaml'
    declared = [
        DeclareLaunchArgument(
            argument.name,
            default_value=str(config) if argument.name == 'config' else argument.default,
            description=argument.meaning,
            choices=argument.choices.split() or None,
        )
        for argument in arguments_of(graph)
    ]
    return LaunchDescription([*declared, OpaqueFunction(function=partial(_supervisor, graph))])


def _supervisor(graph: str, context: LaunchContext) -> list[LaunchDescriptionEntity]:
    # Where another launch file includes ours, an argument may be for that one.
    if any(Path(word).name == f'{graph}.launch.py' for word in sys.argv):
        texts_of([word for word in sys.argv if ':=' in word], graph)
    names = [argument.name for argument in arguments_of(graph)]
    process = ExecuteProcess(
        cmd=[
            *(sys.executable, '-c', f'{QUIET_START}from mount_bringup.graph.run import main; main()', graph),
            *(f'{name}:={context.launch_configurations[name]}' for name in names),
        ],
        name=SUPERVISOR,
        additional_env=environment_of_children(0),
        sigterm_timeout=_PATIENCE,
        sigkill_timeout=_PATIENCE,
        output='both',
        on_exit=_on_exit,
    )
    return [process]


def _on_exit(event: ProcessExited, _: LaunchContext) -> EmitEvent:
    if event.returncode not in (0, -signal.SIGINT):  # the latter came before it could listen
        reason = ', for the reason in its log' if event.returncode > 0 else ''
        raise RuntimeError(  # by which launch ends with exit code 1
            f'{SUPERVISOR} ended with code {event.returncode}{reason}'
        )
    return EmitEvent(event=Shutdown(reason=f'{SUPERVISOR} has ended'))
