"""What a catalogue tells of the displacement and of the control trace."""

import numpy as np
import pytest

from engine_mount.fleet.catalogue import displacement_figures, trace_figures

START = 1_700_000_000_000_000_000
PERIOD = 1_000_000
RATE = 1000.0


class Columns(dict):
    """Columns of a topic with their stamps, as a `Series` has them."""

    def __init__(self, stamps, columns):
        super().__init__(columns)
        self.stamps = stamps


def motion_of(stamps, values):
    return displacement_figures(Columns(stamps, {'mount': values}))


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


def test_samples_out_of_order_or_twice_change_nothing_and_one_of_another_year_is_left_out(drive):
    stamps, values = drive
    order = np.arange(len(stamps))
    order[[50, 51]] = order[[51, 50]]
    order = np.insert(order, 300, 300)
    assert motion_of(stamps[order], values[order]) == motion_of(stamps, values)
    told = stamps.copy()
    told[1000] += 10**17
    assert motion_of(told, values) == motion_of(np.delete(stamps, 1000), np.delete(values, 1000))
    assert motion_of(stamps, np.full(len(values), np.nan)) == {}


def test_the_work_of_the_pads_is_that_of_all_samples(drive):
    stamps, values = drive
    columns = {
        'damping_active': (values > 5.5e-3).astype(float),
        'velocity': np.gradient(values, 1e-3),
        'friction_coefficient': np.full(len(values), 0.3),
        'normal_force': np.abs(values) * 1e4,
    }
    columns['velocity'][5] = np.nan
    found = trace_figures(Columns(stamps, columns), 1 / RATE)
    power = np.abs(0.3 * columns['normal_force'] * columns['velocity'])
    assert found['pad_energy_j'] == pytest.approx(1e-3 * np.nansum(power), rel=1e-12)
    assert found['damping_s'] == 1e-3 * np.count_nonzero(columns['damping_active'])
    assert found['switched_on'] == np.count_nonzero(np.diff(columns['damping_active']) > 0)
