"""The executables end at once and quietly by Ctrl-C while they load."""

import os
import signal
import subprocess
import sys

import pytest

NAMES = [
    *('mount_driver', 'mount_init', 'mount_control', 'mount_sim', 'mount_recorder'),
    'mount_supervisor',
]

START = 'import sys; sys.argv[0] = {!r}; from mount_ros.start import main; main()'


@pytest.mark.parametrize('name', NAMES)
def test_ctrl_c_while_an_executable_loads_leaves_no_traceback(tmp_path, name):
    for module in ('numpy', 'rclpy', 'yaml'):
        (tmp_path / f'{module}.py').write_text('import time; print("up", flush=True); time.sleep(600)')
    with subprocess.Popen(
        [sys.executable, '-c', START.format(f'bin/{name}')],
        env={**os.environ, 'PYTHONPATH': str(tmp_path)},
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    ) as process:
        assert process.stdout.readline() == 'up\n'
        process.send_signal(signal.SIGINT)
        _, errors = process.communicate()
    assert (process.returncode, errors) == (-signal.SIGINT, '')


def test_an_executable_runs_its_module():
    program = [sys.executable, '-c', START.format('bin/mount_supervisor'), 'car']
    ended = subprocess.run(program, capture_output=True, text=True, check=False)
    assert ended.returncode == 1
    assert "graph 'car' is unknown" in ended.stdout + ended.stderr
