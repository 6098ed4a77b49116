"""The whole graph with the simulated car: ros2 launch mount_bringup sim.launch.py recording:=bags/first"""

from launch import LaunchDescription

from mount_bringup.graph.launch import launch_description


def generate_launch_description() -> LaunchDescription:
    return launch_description('sim')
