"""The whole graph with the simulated car: ros2 launch mount_bringup sim.launch.py recording:=bags/first"""

from launch import LaunchDescription

from mount_bringup.graph.launch import launch_description
from mount_bringup.graph.launch_arguments import SIM_ARGUMENTS
from mount_bringup.graph.nodes import SIMULATED


def generate_launch_description() -> LaunchDescription:
    return launch_description(SIMULATED, SIM_ARGUMENTS, 'sim.yaml')
