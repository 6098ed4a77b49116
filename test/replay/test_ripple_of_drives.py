"""The driver's watch of the ripple over whole simulated drives: silent while all is sound, soon where not."""

import numpy as np
import pytest

from engine_mount.drives.loop.run import run_core_into
from mount_driver.parameters import DriverParameters
from mount_driver.watches.ripple_law import RippleLaw
from mount_driver.watches.ripple_watch import RippleWatch

CONTACT = 0.4725  # A, section 3.4
FAULT = 8.0  # s: the motorway damps before and behind


class Readings:
    """A sink that keeps stamps and readings."""

    def __init__(self):
        self.stamps, self.readings = [], []

    def write_samples(self, samples):
        self.stamps += samples.stamps[: samples.count].tolist()
        self.readings += samples.readings[: samples.count].tolist()
        samples.count = 0

    def write_result(self, stamp, result):
        pass

    def write_off(self, stamp):
        pass


def watched(sim, supply=14.0, celsius=20.0):
    """Return (place, sentence) of the first doubt in a core run, None if there is none, and its currents."""
    run, parameters = Readings(), DriverParameters()
    run_core_into(run, {'mount_sim': {'timeline.duration': 9.0} | sim})
    watch = RippleWatch(parameters.ripple, RippleLaw(), parameters.heating)
    watch.take_status(supply, celsius)
    currents = np.array(run.readings)[:, 1]
    for k, (stamp, (_, *ripple)) in enumerate(zip(run.stamps, run.readings, strict=True)):
        if sentence := watch.judge(*ripple, True, stamp):
            return (k, sentence), currents
    assert watch.noise > 0.0
    return None, currents


@pytest.mark.parametrize(
    ('sim', 'supply', 'celsius'),
    [
        ({}, 14.0, 20.0),
        ({'scenario': 'bench', 'bench.amplitude': 4e-3}, 14.0, 20.0),
        ({'idle.amplitude': 200.0}, 14.0, 20.0),
        ({'coil.link_voltage': 9.0}, 9.0, 20.0),
        ({'coil.link_voltage': 16.0}, 16.0, 20.0),
        ({'electronics.coil_temperature': 119.0}, 14.0, 119.0),
        ({'electronics.coil_temperature': -40.0}, 14.0, -40.0),
    ],
)
def test_a_sound_drive_is_not_doubted(sim, supply, celsius):
    doubt, currents = watched(sim, supply, celsius)
    assert doubt is None
    assert np.mean(currents > CONTACT) > 0.2


@pytest.mark.parametrize(
    'fault', ['pads_missing', 'gap_blocked', 'coil_shorted', 'ripple_missing', 'ripple_noisy', 'ripple_scale']
)
def test_a_fault_while_damping_is_found_within_a_second_of_contact(fault):
    doubt, currents = watched({'faults': (f'{fault}@{FAULT:g}',)})
    assert doubt is not None
    begin = round(1e3 * FAULT)
    assert doubt[0] >= begin
    assert np.sum(currents[begin : doubt[0]] > CONTACT) < 400


def test_pads_that_wear_by_the_fault_are_found_in_the_first_damping_beyond_the_ready_position():
    doubt, currents = watched({'faults': (f'pads_worn@{FAULT:g}',), 'timeline.duration': 13.0})
    assert doubt is not None
    begin = round(1e3 * FAULT)
    assert begin <= doubt[0]
    assert np.sum(currents[begin : doubt[0]] > 0.75) < 150
