"""Shared memory of the middleware: what belongs to the living stays, what the dead left goes."""

import fcntl
import os
import signal
import subprocess
import sys
from pathlib import Path

from ros_testing import wait_until

from mount_ros.nodes.shutdown import SHARED_MEMORY, remove_abandoned

SEGMENT, PORT = 'fastrtps_0123456789abcdef', 'fastrtps_port7411'

NODE = """
from mount_ros.environment import prepare_environment
prepare_environment()
import time, rclpy
rclpy.init()
node = rclpy.create_node('left')
print('up', flush=True)
time.sleep(3600.0)
"""


def _files(folder):
    return sorted(file.name for file in folder.iterdir())


def _make(folder, *names):
    for name in names:
        (folder / name).touch()


def test_what_nobody_holds_is_removed_and_what_is_held_or_new_stays(tmp_path):
    _make(tmp_path, SEGMENT, f'{SEGMENT}_el', PORT, f'{PORT}_el', f'sem.{PORT}_mutex', 'fastrtps_port7412')
    remove_abandoned(tmp_path, youngest=3600.0)
    assert len(_files(tmp_path)) == 6
    kept = ['fastrtps_fedcba9876543210', 'fastrtps_fedcba9876543210_el', 'of_others']
    shared = ['fastrtps_port7400', 'fastrtps_port7400_sl', 'sem.fastrtps_port7400_mutex']
    _make(tmp_path, *kept, *shared)
    with open(tmp_path / kept[1], 'rb') as own, open(tmp_path / shared[1], 'rb') as of_several:
        fcntl.flock(own, fcntl.LOCK_EX)
        fcntl.flock(of_several, fcntl.LOCK_SH)
        remove_abandoned(tmp_path, youngest=0.0)
    assert _files(tmp_path) == sorted([*kept, *shared])


def test_what_a_killed_node_has_left_is_removed(domain):
    process = subprocess.Popen(
        [sys.executable, '-c', NODE],
        stdout=subprocess.PIPE,
        env={**os.environ, 'ROS_DOMAIN_ID': str(domain)},
    )
    assert process.stdout is not None
    assert process.stdout.readline() == b'up\n'
    opened = Path(f'/proc/{process.pid}/fd')
    targets = [os.readlink(entry) for entry in opened.iterdir() if entry.exists()]
    locks = {Path(name).name for name in targets if name.startswith(f'{SHARED_MEMORY}/fastrtps_')}
    assert any(name.endswith('_el') for name in locks)
    remove_abandoned(youngest=0.5)
    assert locks <= set(_names())  # it lives
    process.send_signal(signal.SIGKILL)
    process.communicate()
    wait_until(lambda: remove_abandoned(youngest=0.5) or not locks & set(_names()), 'the end')


def _names():
    return os.listdir(SHARED_MEMORY)
