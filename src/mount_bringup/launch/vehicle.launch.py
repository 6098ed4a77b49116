"""The graph in the car: ros2 launch mount_bringup vehicle.launch.py channel:=can0 namespace:=mount_right"""

from pathlib import Path

from ament_index_python.packages import get_package_share_directory
from launch import LaunchDescription
from launch.actions import DeclareLaunchArgument
from launch.substitutions import LaunchConfiguration

from mount_bringup.graph.launch import launch_graph
from mount_bringup.graph.nodes import VEHICLE
from mount_control.policy.registry import DEFAULT
from mount_control.policy.switched_viscous import DEFAULT_DAMPER


def generate_launch_description() -> LaunchDescription:
    config = Path(get_package_share_directory('mount_bringup')) / 'config' / 'vehicle.yaml'
    arguments = [
        DeclareLaunchArgument('namespace', default_value='', description='such as mount_right'),
        DeclareLaunchArgument('config', default_value=str(config), description='parameters of all nodes'),
        DeclareLaunchArgument('recording', description='folder that the recording creates'),
        DeclareLaunchArgument('interface', default_value='socketcan', description='python-can interface'),
        DeclareLaunchArgument('channel', default_value='can0', description='channel of the interface'),
        DeclareLaunchArgument(
            'parameters_file',
            default_value='',
            description='specimen file of this mount; empty: the shipped one',
        ),
        DeclareLaunchArgument(
            'specimen', default_value='', description='name that the specimen file must bear; empty: any'
        ),
        DeclareLaunchArgument('policy', default_value=DEFAULT, description='control policy'),
        DeclareLaunchArgument(
            'damper', default_value=DEFAULT_DAMPER, description='damper characteristic of switched_viscous'
        ),
    ]
    config_file = LaunchConfiguration('config')
    parameters = {node.name: [config_file] for node in VEHICLE}
    parameters['mount_recorder'].append({'uri': LaunchConfiguration('recording')})
    parameters['mount_driver'].append(
        {'interface': LaunchConfiguration('interface'), 'channel': LaunchConfiguration('channel')}
    )
    for node in ('mount_init', 'mount_control'):
        parameters[node].append(
            {
                'parameters_file': LaunchConfiguration('parameters_file'),
                'specimen': LaunchConfiguration('specimen'),
            }
        )
    parameters['mount_control'].append(
        {'policy': LaunchConfiguration('policy'), 'damper': LaunchConfiguration('damper')}
    )
    graph = launch_graph(VEHICLE, LaunchConfiguration('namespace'), parameters)
    return LaunchDescription([*arguments, *graph])
