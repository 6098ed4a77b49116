"""The executable `mount_composed`: driver, initialisation and control of a mount in one process."""

from mount_control.node import MountControl
from mount_driver.node import MountDriver
from mount_init.node import MountInit
from mount_ros.nodes.process import run_nodes

COMPOSED = 'mount_composed'


def main() -> None:
    """Run the three nodes until the process is told to end."""
    run_nodes([MountDriver, MountInit, MountControl])


if __name__ == '__main__':
    main()
