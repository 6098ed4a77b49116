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


def test_what_nobody_holds_is_removed_and_what_is_held_stays(tmp_path):
    _make(tmp_path, SEGMENT, f'{SEGMENT}_el', PORT, f'{PORT}_el', f'sem.{PORT}_mutex', 'of_others')
    living = 'fastrtps_fedcba9876543210'
    _make(tmp_path, living, f'{living}_el')
    with open(tmp_path / f'{living}_el', 'rb') as file:
        fcntl.flock(file, fcntl.LOCK_EX)
        removed = remove_abandoned(tmp_path, youngest=0.0)
    assert removed == [SEGMENT, f'{SEGMENT}_el', PORT, f'{PORT}_el', f'sem.{PORT}_mutex']
    assert _files(tmp_path) == [living, f'{living}_el', 'of_others']


def test_a_port_without_a_lock_is_removed_and_one_that_others_share_stays(tmp_path):
    shared = 'fastrtps_port7400'
    _make(tmp_path, PORT, f'sem.{PORT}_mutex', shared, f'{shared}_sl', f'sem.{shared}_mutex')
    with open(tmp_path / f'{shared}_sl', 'rb') as file:
        fcntl.flock(file, fcntl.LOCK_SH)
        assert remove_abandoned(tmp_path, youngest=0.0) == [PORT, f'sem.{PORT}_mutex']


def test_files_that_are_being_made_and_a_folder_that_is_not_there_are_left_alone(tmp_path):
    _make(tmp_path, SEGMENT, f'{SEGMENT}_el', PORT)
    assert remove_abandoned(tmp_path, youngest=3600.0) == []
    assert remove_abandoned(tmp_path / 'nowhere') == []


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
    assert not locks & set(remove_abandoned(youngest=0.5))  # it lives
    process.send_signal(signal.SIGKILL)
    process.communicate()
    wait_until(lambda: remove_abandoned(youngest=0.5) is not None and not locks & set(_names()), 'the end')


def _names():
    return os.listdir(SHARED_MEMORY)
