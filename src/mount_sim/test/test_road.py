"""Random road against its own density, gap and sweep against their formulas."""

import numpy as np
import pytest
from scipy import signal

from mount_sim.excitation.road import Gap, RandomRoad, gap_in_road, random_road, sweep_road
from mount_sim.excitation.scenario import SweepScenario


def density(heights, spacing, segment):
    return signal.welch(heights, fs=1.0 / spacing, nperseg=segment, detrend='linear')


@pytest.mark.parametrize('roughness', [2e-6, 1024e-6])
def test_random_road_has_the_density_of_its_class(roughness):
    road = RandomRoad(roughness=roughness, ramp_in=0.0)
    spacing = 0.05
    heights = random_road(np.arange(0.0, 6000.0, spacing) / road.speed, road)
    frequency, found = density(heights, spacing, 8192)
    expected = roughness * (0.1 / frequency[1:]) ** 2
    ratio = found[1:] / expected
    for low, high in ((0.03, 0.1), (0.1, 0.5), (0.5, 2.8)):
        band = (frequency[1:] > low) & (frequency[1:] < high)
        assert np.mean(ratio[band]) == pytest.approx(1.0, abs=0.12)


def test_height_does_not_depend_on_the_other_times():
    road = RandomRoad()
    times = np.arange(0.0, 5.0, 1e-3)
    together = random_road(times, road)
    assert random_road(times[3217:3218], road)[0] == together[3217]
    assert np.array_equal(random_road(times[2000:4000], road), together[2000:4000])


@pytest.mark.parametrize('depth', [0.010, 0.020, 0.030])
def test_gap_goes_down_by_its_depth_over_its_length(depth):
    gap = Gap(depth=depth, position=66.0)
    times = np.arange(0.0, 4.0, 5e-5)
    heights = gap_in_road(times, gap)
    assert heights.min() == pytest.approx(-depth, rel=1e-5)
    assert heights.max() == 0.0
    inside = times[heights < 0.0]
    assert inside[0] == pytest.approx(2.0, abs=1e-4)
    assert inside[-1] == pytest.approx(2.0 + 1.0 / 33.0, abs=1e-4)
    assert times[np.argmin(heights)] == pytest.approx(2.0 + 0.5 / 33.0, abs=1e-4)


def test_sweep_begins_level_and_then_has_its_formula():
    sweep = SweepScenario(velocity_amplitude=0.2)
    assert sweep_road([0.0], sweep)[0] == 0.0
    assert sweep_road([0.5], sweep)[0] == pytest.approx(
        0.5 * -0.2 / (2.0 * np.pi * 1.5) * np.cos(2.0 * np.pi * 0.625), rel=1e-12
    )
    assert sweep_road([7.0], sweep)[0] == pytest.approx(
        -0.2 / (2.0 * np.pi * 8.0) * np.cos(2.0 * np.pi * (7.0 + 24.5)), rel=1e-9
    )
