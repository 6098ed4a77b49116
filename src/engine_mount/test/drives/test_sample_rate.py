"""The laws are discretised for the sample rate of the graph: at each rate the mount is damped alike."""

import math

import numpy as np
import pytest

from engine_mount.drives.loop.run import run_core_into
from engine_mount.settings.options import with_sample_rate
from mount_bringup.settings import check_sample_rate
from mount_models.quantity import ParameterError
from mount_models.sampling import sample_time_ns

DRIVE = {'scenario': 'motorway', 'timeline.duration': 5.0, 'motorway.gap_depth': 0.03}


class Kept:
    """Keeps displacement (m) and setpoint (A) of a run."""

    def __init__(self):
        self.displacement, self.setpoint = [], []

    def write_samples(self, samples):
        self.displacement.append(samples.readings[: samples.count, 0].copy())
        self.setpoint.append(samples.setpoints[: samples.count].copy())
        samples.count = 0

    def write_result(self, stamp, result):
        self.contact_gap = result.contact_gap

    def write_off(self, stamp):
        pass


def driven(policy, rate):
    """Return (peak displacement m, mean current A after the gap, contact gap m)."""
    kept = Kept()
    run_core_into(kept, with_sample_rate({'mount_sim': DRIVE, 'mount_control': {'policy': policy}}, rate))
    behind = np.concatenate(kept.setpoint)[round(6.6 * rate) :]
    return np.abs(np.concatenate(kept.displacement)).max(), behind.mean(), kept.contact_gap


@pytest.mark.parametrize('policy', ['continuous_viscous', 'switched_viscous'])
def test_damping_at_other_rates_is_that_at_1_khz(policy):
    peak, current, gap = driven(policy, 1000.0)
    for rate, within in ((2000.0, 0.01), (500.0, 0.03)):
        other = driven(policy, rate)
        assert other[0] == pytest.approx(peak, rel=within)
        assert other[1] == pytest.approx(current, rel=0.05)
        assert other[2] == pytest.approx(gap, abs=2e-6)


def test_nodes_of_different_rates_are_refused_with_both_of_them():
    with pytest.raises(ParameterError, match=r'mount_init.sample_rate \(1000 Hz\) must equal mount_driver'):
        check_sample_rate({'mount_driver': {'sample_rate': 2000.0}})
    assert check_sample_rate(with_sample_rate({}, 2000.0)) == 2000.0
    assert check_sample_rate({'mount_sim': {'sample_rate': 2000.0}}, ['mount_driver', 'mount_init']) == 1000.0


def test_a_rate_that_the_counter_or_the_plant_cannot_have_is_refused():
    with pytest.raises(ParameterError, match=r'1100 Hz\) must divide 1 000 000.* near it lies 1100.11 Hz'):
        sample_time_ns(1100.0)
    with pytest.raises(ParameterError, match=r'1600 Hz\).*instead there are 12.5'):
        run_core_into(Kept(), with_sample_rate({}, 1600.0))
    assert math.isclose(sample_time_ns(1600.0), 625_000)
