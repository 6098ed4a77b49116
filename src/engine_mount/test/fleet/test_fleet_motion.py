"""What a catalogue tells of the displacement and of the control trace, collected part by part."""

import numpy as np
import pytest

from engine_mount.fleet.catalogue.motion import Motion
from engine_mount.fleet.catalogue.trace import Trace
from engine_mount.recordings.columns import ColumnPart

START = 1_700_000_000_000_000_000
PERIOD = 1_000_000
RATE = 1000.0


def parts(topic, stamps, columns, size=700):
    for begin in range(0, len(stamps), size):
        here = slice(begin, begin + size)
        yield ColumnPart(
            topic, stamps[here], stamps[here] + 200_000, {name: each[here] for name, each in columns.items()}
        )


def motion_of(stamps, values):
    motion = Motion()
    for part in parts('/displacement', stamps, {'mount': values}):
        motion.add(part)
    return motion.figures(RATE)


@pytest.fixture
def drive():
    stamps = START + PERIOD * np.arange(20_000)
    return stamps, 1e-3 * np.sin(2 * np.pi * 8e-3 * np.arange(20_000)) + 5e-3


def test_peak_and_rms_are_those_of_all_samples(drive):
    stamps, values = drive
    values[100:200] = np.nan
    found = motion_of(stamps, values)
    assert found['peak_displacement_m'] == np.nanmax(np.abs(values))
    assert found['rms_displacement_m'] == pytest.approx(np.nanstd(values), rel=1e-12)


def test_samples_out_of_order_or_twice_change_nothing(drive):
    stamps, values = drive
    order = np.arange(len(stamps))
    order[[50, 51]] = order[[51, 50]]
    order = np.insert(order, 300, 300)
    assert motion_of(stamps[order], values[order]) == motion_of(stamps, values)


def test_a_stamp_of_another_year_is_left_out(drive):
    stamps, values = drive
    told = stamps.copy()
    told[1000] += 10**17
    assert motion_of(told, values) == motion_of(np.delete(stamps, 1000), np.delete(values, 1000))


def test_a_displacement_that_is_never_known_has_no_figures(drive):
    stamps, values = drive
    assert motion_of(stamps, np.full(len(values), np.nan)) == {}


def test_the_parts_of_the_files_do_not_change_the_figures_of_a_trace(drive):
    stamps, values = drive
    columns = {
        'damping_active': (values > 5.5e-3).astype(float),
        'velocity': np.gradient(values, 1e-3),
        'friction_coefficient': np.full(len(values), 0.3),
        'normal_force': np.abs(values) * 1e4,
    }
    columns['velocity'][5] = np.nan
    found = []
    for size in (1, 700, 20_000):
        trace = Trace()
        for part in parts('/control_trace', stamps, columns, size):
            trace.add(part)
        found.append(trace.figures(1 / RATE))
    assert found[0] == found[1] == found[2]
    power = np.abs(0.3 * columns['normal_force'] * columns['velocity'])
    assert found[0]['pad_energy_j'] == pytest.approx(1e-3 * np.nansum(power), rel=1e-12)
    assert found[0]['damping_s'] == 1e-3 * np.count_nonzero(columns['damping_active'])
    assert found[0]['switched_on'] == np.count_nonzero(np.diff(columns['damping_active']) > 0)
