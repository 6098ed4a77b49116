"""`engine-mount --version`: what this is, and what it runs on."""

import os

import typer

from engine_mount.cli.terminal import terminal


def tell(asked: bool) -> None:
    """Print the versions of project, ROS, Python and numpy, and end; the session of a recording tells all."""
    if not asked:
        return
    from mount_recorder.versions import versions

    found = versions()
    distribution = os.environ.get('ROS_DISTRO', 'jazzy')  # without one installed, rclpy is that of this
    terminal().print(
        f'engine-mount {found["mount_bringup"]}, ROS 2 {distribution} (rclpy {found["rclpy"]}), '
        f'Python {found["python"]}, numpy {found["numpy"]}',
        soft_wrap=True,
    )
    raise typer.Exit
