"""The whole graph with the simulated car: ros2 launch mount_bringup sim.launch.py scenario:=motorway"""

from pathlib import Path

from ament_index_python.packages import get_package_share_directory
from launch import LaunchDescription
from launch.actions import DeclareLaunchArgument
from launch.substitutions import LaunchConfiguration

from mount_bringup.graph.launch import launch_graph
from mount_bringup.graph.nodes import SIMULATED
from mount_control.policy.registry import DEFAULT
from mount_control.policy.switched_viscous import DEFAULT_DAMPER


def generate_launch_description() -> LaunchDescription:
    config = Path(get_package_share_directory('mount_bringup')) / 'config' / 'sim.yaml'
    arguments = [
        DeclareLaunchArgument('namespace', default_value='', description='such as mount_right'),
        DeclareLaunchArgument('config', default_value=str(config), description='parameters of all nodes'),
        DeclareLaunchArgument('recording', description='folder that the recording creates'),
        DeclareLaunchArgument('scenario', default_value='motorway', description='motorway or bench'),
        DeclareLaunchArgument('policy', default_value=DEFAULT, description='control policy'),
        DeclareLaunchArgument(
            'damper', default_value=DEFAULT_DAMPER, description='damper characteristic of switched_viscous'
        ),
    ]
    config_file = LaunchConfiguration('config')
    parameters = {node.name: [config_file] for node in SIMULATED}
    parameters['mount_recorder'].append({'uri': LaunchConfiguration('recording')})
    parameters['mount_sim'].append({'scenario': LaunchConfiguration('scenario')})
    parameters['mount_control'].append(
        {'policy': LaunchConfiguration('policy'), 'damper': LaunchConfiguration('damper')}
    )
    graph = launch_graph(SIMULATED, LaunchConfiguration('namespace'), parameters)
    return LaunchDescription([*arguments, *graph])
