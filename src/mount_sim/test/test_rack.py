"""The simulated rack: what it records is that of actuator and contact, with noise of the stated size."""

import numpy as np
import pytest

from mount_models.quantity import ParameterError
from mount_sim.rack import (
    GAPS,
    Rack,
    drawn_rack,
    measure_force,
    record_ripple,
    sawtooth_corners,
    write_force,
    write_ripple,
)


def test_the_same_seed_gives_the_same_recording_and_another_does_not():
    one, two, other = (record_ripple(Rack(seed=seed), 349e-6, duration=0.3) for seed in (1, 1, 2))
    assert (one['current_rate_a_per_s'] == two['current_rate_a_per_s']).all()
    assert not (one['current_rate_a_per_s'] == other['current_rate_a_per_s']).any()


def test_ripple_leads_to_the_inductance_of_the_coil():
    rack = Rack(noise=0.01)
    columns = record_ripple(rack, 349e-6)
    area = rack.actuator.turns * rack.actuator.gap_area
    held = columns['current_a'] == 0.2
    inductance = (area * columns['flux_rate_t_per_s'] / columns['current_rate_a_per_s'])[held]
    assert np.mean(inductance) == pytest.approx(48.04e-3, rel=0.002)
    assert np.std(inductance) / np.mean(inductance) == pytest.approx(0.01, rel=0.1)


def test_a_current_that_the_bridge_cannot_hold_is_refused():
    with pytest.raises(
        ParameterError, match=r'the bridge cannot hold .* at 120 degC and 14 V; lower peak_current'
    ):
        record_ripple(Rack(), 349e-6, 120.0, peak_current=4.5)


def test_drawn_racks_differ_and_come_again_by_their_seed():
    assert drawn_rack(4) == drawn_rack(4)
    assert drawn_rack(4).actuator != drawn_rack(5).actuator


def test_files_hold_what_was_measured(tmp_path):
    rack = Rack(seed=2)
    table = np.genfromtxt(write_force(rack, tmp_path / 'force.csv'), delimiter=',', names=True, skip_header=1)
    assert table.dtype.names == ('gap_um', 'current_a', 'force_n')
    assert table['force_n'] == pytest.approx(measure_force(rack)['force_n'], rel=1e-8)
    files = write_ripple(rack, tmp_path / 'ripple', GAPS[:2], 60.0)
    assert [file.name for file in files] == ['ripple_270um_+60degC.csv', 'ripple_290um_+60degC.csv']
    ripple = np.genfromtxt(files[0], delimiter=',', names=True, skip_header=1)
    assert ripple['gap_um'] == pytest.approx(270.0)


def test_the_saw_tooth_grows_faster_after_every_second_turning_point():
    times, positions = sawtooth_corners(-2.5e-3, (1e-3, 2e-3, 3e-3))
    speeds = np.array([1e-3, 1e-3, 1e-3, 2e-3, 2e-3, 3e-3, 3e-3])
    assert np.abs(np.diff(positions)) == pytest.approx(speeds * np.diff(times))
    assert positions[1:] == pytest.approx([-2.5e-3, 2.5e-3] * 3 + [-2.5e-3])
    assert (times[0], positions[0]) == (0.0, 0.0)
