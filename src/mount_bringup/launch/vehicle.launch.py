"""The graph in the car: ros2 launch mount_bringup vehicle.launch.py recording:=bags/first channel:=can0"""

from launch import LaunchDescription

from mount_bringup.graph.launch import launch_description


def generate_launch_description() -> LaunchDescription:
    return launch_description('vehicle')
