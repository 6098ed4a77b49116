"""Environment of the middleware: stay on this machine, find each other quickly.

Every default gives way to what the user has set.
"""

import os
import socket
from pathlib import Path

_NEIGHBOUR = ('127.0.0.1', 9)  # any port


def prepare_environment() -> None:
    """Set what the middleware reads when it is initialised; call it before `rclpy.init`."""
    os.environ.setdefault('ROS_AUTOMATIC_DISCOVERY_RANGE', 'LOCALHOST')
    profile = Path(__file__).parent / 'dds' / 'fast_discovery.xml'
    os.environ.setdefault('FASTRTPS_DEFAULT_PROFILES_FILE', str(profile))
    os.environ.setdefault('FASTDDS_DEFAULT_PROFILES_FILE', str(profile))
    # One line per message, so that a supervisor can pass it on.
    os.environ.setdefault('RCUTILS_CONSOLE_OUTPUT_FORMAT', '[{severity}] [{name}]: {message}')


def loopback_refusal() -> str:
    """Return why the processes of this machine cannot reach each other, empty if they can."""
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as trial:
        try:
            trial.connect(_NEIGHBOUR)  # sends nothing; needs a route
        except OSError as error:
            return f'the loopback interface is down ({error.strerror}): `ip link set lo up`'
    return ''
