"""Environment of the middleware: stay on this machine, find each other quickly.

Every default gives way to what the user has set.
"""

import os
from pathlib import Path


def prepare_environment() -> None:
    """Set what the middleware reads when it is initialised; call it before `rclpy.init`."""
    os.environ.setdefault('ROS_AUTOMATIC_DISCOVERY_RANGE', 'LOCALHOST')
    profile = Path(__file__).parent / 'dds' / 'fast_discovery.xml'
    os.environ.setdefault('FASTRTPS_DEFAULT_PROFILES_FILE', str(profile))
    os.environ.setdefault('FASTDDS_DEFAULT_PROFILES_FILE', str(profile))
    # One line per message, so that a supervisor can pass it on.
    os.environ.setdefault('RCUTILS_CONSOLE_OUTPUT_FORMAT', '[{severity}] [{name}]: {message}')
