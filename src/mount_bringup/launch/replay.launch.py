"""A recorded drive into the control: ros2 launch mount_bringup replay.launch.py bag:=first record:=false"""

from launch import LaunchDescription

from mount_bringup.graph.launch import launch_description
from mount_bringup.graph.launch_arguments import REPLAY_ARGUMENTS
from mount_bringup.graph.replay_order import replay_order


def generate_launch_description() -> LaunchDescription:
    return launch_description(REPLAY_ARGUMENTS, replay_order)
