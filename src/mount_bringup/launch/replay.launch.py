"""A recorded drive into the control: ros2 launch mount_bringup replay.launch.py bag:=first record:=false"""

from launch import LaunchDescription

from mount_bringup.graph.launch import launch_description


def generate_launch_description() -> LaunchDescription:
    return launch_description('replay')
