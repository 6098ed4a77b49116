"""A recorded acceleration on its way to the simulator: the bytes that it reads do not depend on who reads."""

from pathlib import Path

import numpy as np
import pytest

from engine_mount.drives.external_excitation import recorded_acceleration
from engine_mount.signals.excitation import acceleration_at, recorded_signal
from mount_sim.excitation.scenario import RecordedScenario

MOTORWAY = Path(__file__).resolve().parents[5] / 'shared' / 'data' / 'motorway_i280'


def driven(tmp_path, file, columns, **more):
    """Return the acceleration (m/s^2) that drives the car, and the excitation."""
    brought = recorded_acceleration(str(file), columns, **more)
    even = recorded_signal(RecordedScenario(str(brought.write(tmp_path / 'given'))))
    return acceleration_at(even, 1e-3)[:], brought


def test_it_is_to_the_bit_what_the_simulator_reads_by_itself(tmp_path):
    times = 5.0 + np.arange(500) / 97.3
    file = tmp_path / 'drive.csv'
    rows = np.column_stack([times, np.random.default_rng(4).standard_normal(500)])
    np.savetxt(file, rows, '%.17g', delimiter=',', header='t,az', comments='')
    found, brought = driven(tmp_path, file, ['az'], scale=-1.0)
    by_itself = acceleration_at(recorded_signal(RecordedScenario(str(file), 'az', scale=-1.0)), 1e-3)[:]
    assert found.tobytes() == by_itself.tobytes()
    assert brought.origin['file'] == 'drive.csv'


def test_the_published_layout_needs_no_option_but_the_axis(tmp_path):
    if not MOTORWAY.is_dir():
        pytest.skip('the recorded drive is not beside the repository')
    found, brought = driven(tmp_path, MOTORWAY, ['accelerometer.2'])
    assert found.size == pytest.approx(59_990, abs=20)
    assert 0.05 < np.abs(found).max() < 10.0
    column = brought.origin['columns']['acceleration']
    assert column['factor'] == 1.0
