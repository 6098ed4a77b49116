"""A recorded drive played by `ros2 bag play` into a running control gives the recorded setpoints.

The player of rosbag2 is C++ and not here; `bag_player.py` publishes as it does. The supervisor, the control
and the recorder are those that `replay.launch.py` starts.
"""

import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from engine_mount.recordings.recording import open_recording

PLAYER = Path(__file__).with_name('bag_player.py')
REFERENCE = Path(__file__).resolve().parents[2] / 'bags' / 'reference' / 'rough'
SETTLING = 1_000_000_000  # ns: within it a control that was activated at another sample forgets that
SETTLED = 1e-4  # A: the friction deflection is slow to be forgotten (9e-6 A after 1 s, 3e-7 A after 2 s)
LIMIT = 120.0  # s


@pytest.fixture
def started():
    processes = []
    yield processes
    for process in processes:
        if process.poll() is None:
            process.terminate()
            process.wait(30)


@pytest.fixture
def replay(tmp_path, domain, started, monkeypatch):
    """Run the supervisor of a replay as launch does; return exit code and output."""
    monkeypatch.setenv('ROS_DOMAIN_ID', str(domain))
    command = tmp_path / 'bin' / 'ros2'
    command.parent.mkdir()
    command.write_text(f'#!/bin/sh\nexec {sys.executable} {PLAYER} "$@"\n')
    command.chmod(0o755)
    monkeypatch.setenv('PATH', f'{command.parent}:{os.environ["PATH"]}')

    def run(**given):
        texts = {'recording': str(tmp_path / 'again'), **given}
        process = subprocess.Popen(
            [
                *(sys.executable, '-c', 'from mount_bringup.graph.run import main; main()', 'replay'),
                *(f'{name}:={text}' for name, text in texts.items()),
            ],
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            text=True,
        )
        started.append(process)
        output, _ = process.communicate(timeout=LIMIT)
        return process.returncode, output

    return run


def setpoints(folder):
    """Return stamps (ns) and currents (A) of the setpoints after the activation of the control."""
    recording = open_recording(folder)
    series, stamp = recording['current_setpoint'], recording['air_gap'].stamps[-1]
    stamps, first = np.unique(series.stamps, return_index=True)
    after = stamps > stamp
    return stamps[after], series['coil_current'][first][after]


@pytest.mark.slow
@pytest.mark.real_time
def test_a_recorded_drive_played_to_the_control_gives_the_recorded_setpoints(replay, tmp_path):
    code, output = replay(bag=str(REFERENCE), rate='0.25')  # beside three other suites samples were lost
    assert code == 0, output
    recorded_stamps, recorded = setpoints(REFERENCE)
    stamps, currents = setpoints_of_replay(tmp_path / 'again', recorded_stamps[0])
    common, places, again = np.intersect1d(recorded_stamps, stamps, return_indices=True)
    settled = common > common[0] + SETTLING
    assert np.count_nonzero(recorded[places][settled]) > 100
    assert np.abs(recorded[places] - currents[again])[settled].max() <= SETTLED


def setpoints_of_replay(folder, begin):
    """Return the same of a recording without an air_gap of its own, from `begin` (ns) on."""
    series = open_recording(folder)['current_setpoint']
    stamps, first = np.unique(series.stamps, return_index=True)
    return stamps[stamps >= begin], series['coil_current'][first][stamps >= begin]


@pytest.mark.slow
def test_a_player_that_fails_ends_the_replay_with_its_command_and_a_remedy(replay, tmp_path):
    (tmp_path / 'bin' / 'ros2').write_text('#!/bin/sh\nexit 2\n')
    code, output = replay(bag=str(REFERENCE), record='false')
    assert code == 1
    assert 'ended with code 2: it needs the packages ros2bag and rosbag2_storage_mcap' in output
