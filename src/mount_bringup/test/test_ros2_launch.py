"""The launch files under the real `ros2 launch`, where it is installed: up, down, refused, interrupted.

By the command, for its exit code is what is promised; each run has a ROS domain of its own.
"""

import importlib.util
import os
import signal
import subprocess

import pytest
from ament_index_python.packages import PackageNotFoundError, get_package_prefix
from ros_testing import wait_until

from engine_mount.recordings.recording import open_recording
from mount_bringup.graph.order import GRAPHS, arguments_of

LIMIT = 240.0  # s: only a hang takes so long


def _lacking():
    """Return what is missing for `ros2 launch` of this package, empty if nothing is."""
    if importlib.util.find_spec('ros2launch') is None:
        return 'ros2launch is not installed here: a ROS 2 installation has it'
    try:
        get_package_prefix('mount_bringup')
    except PackageNotFoundError:
        return 'mount_bringup is not installed by colcon here'
    return ''


NO_LAUNCH = _lacking()
pytestmark = pytest.mark.skipif(bool(NO_LAUNCH), reason=NO_LAUNCH)


@pytest.fixture
def launch(tmp_path, domain):
    """Return the function that starts `ros2 launch` with its output in a file."""
    started = []
    environment = {**os.environ, 'ROS_DOMAIN_ID': str(domain), 'ROS_LOG_DIR': str(tmp_path / 'log')}

    def start(name, *arguments):
        output = tmp_path / 'output.txt'
        with output.open('w') as file:
            process = subprocess.Popen(
                ['ros2', 'launch', 'mount_bringup', f'{name}.launch.py', *arguments],
                env=environment, cwd=tmp_path, stdout=file, stderr=subprocess.STDOUT,
            )  # fmt: skip
        started.append(process)
        return process, output

    yield start
    for process in started:
        if process.poll() is None:
            process.send_signal(signal.SIGINT)
            process.wait(60)


@pytest.mark.real_time
def test_ctrl_c_ends_with_code_0_and_a_closed_recording(launch, tmp_path):
    process, output = launch('sim', 'recording:=drive', 'duration:=600')
    wait_until(lambda: 'all nodes are active' in output.read_text(), 'the activation', LIMIT)
    process.send_signal(signal.SIGINT)
    assert process.wait(LIMIT) == 0, output.read_text()
    assert open_recording(tmp_path / 'drive').warnings == []


@pytest.mark.parametrize('name', GRAPHS)
def test_show_args_tells_every_argument_with_its_meaning(launch, name):
    process, output = launch(name, '--show-args')
    assert process.wait(LIMIT) == 0
    told = ' '.join(output.read_text().split())
    for argument in arguments_of(name):
        assert f"'{argument.name}': {argument.meaning}" in told


@pytest.mark.real_time
@pytest.mark.parametrize('composed', ['false', 'true'])
def test_a_drive_ends_with_code_0_and_a_closed_recording_that_knows_its_parameters(
    launch, tmp_path, composed
):
    process, output = launch(
        'sim', 'recording:=drive', 'duration:=2', f'composed:={composed}', 'policy:=switched_viscous'
    )
    assert process.wait(LIMIT) == 0, output.read_text()
    recording = open_recording(tmp_path / 'drive')
    assert recording.warnings == []
    session = recording.latched('session').data
    assert 'policy: switched_viscous' in session
    assert 'versions:' in session


def test_what_a_node_refuses_ends_launch_with_code_1_and_its_sentence(launch):
    process, output = launch('sim', 'recording:=')
    assert process.wait(LIMIT) == 1
    assert 'mount_recorder refused to configure: parameter uri is empty' in output.read_text()
