"""A displacement is believed as long as it moves as a mount can, with the noise of a sound sensor."""

import numpy as np
import pytest

from mount_control.plausibility import HOLD, Plausibility, doubt_of
from mount_control.settings import ControlParameters
from mount_models.quantity import with_values

HELD = round(1e3 * HOLD)  # samples
SOUND = 2e-6  # m, noise of a sound sensor
STEP = 1e-7  # m, of the signal on the bus


def moving(samples=2000, amplitude=1e-3, frequency=8.0, noise=SOUND):
    """A sine with noise as it comes over the bus."""
    time = 1e-3 * np.arange(samples)
    drawn = np.random.default_rng(7).normal(0.0, noise, samples)
    return np.round((amplitude * np.sin(2.0 * np.pi * frequency * time) + drawn) / STEP) * STEP


def doubt(plausibility, displacement, missing=0):
    """Whether the next sample is not believed, so many missing before it."""
    return doubt_of(plausibility.limits, plausibility.memory, float(displacement), missing)


def doubted(displacements, **parameters):
    """Which of the samples are not believed, and what is told in the end."""
    plausibility = Plausibility(with_values(ControlParameters(), **parameters))
    return [doubt(plausibility, x) for x in displacements], plausibility


def _first(doubts):
    return doubts.index(True) if True in doubts else None


@pytest.mark.parametrize(
    ('amplitude', 'frequency', 'noise'),
    [(0.0, 1.0, SOUND), (1e-3, 8.0, SOUND), (1e-2, 10.0, SOUND), (1e-3, 100.0, SOUND), (1e-3, 8.0, 2e-5)],
)
def test_sound_motion_is_believed(amplitude, frequency, noise):
    doubts, plausibility = doubted(moving(5000, amplitude, frequency, noise))
    assert not any(doubts)
    assert plausibility.sentence == ''
    assert not plausibility.held


def test_a_step_is_told_at_once_with_its_velocity_and_held_for_a_second():
    motion = moving(3000)
    motion[1000:] += 2e-3
    doubts, plausibility = doubted(motion)
    assert doubts == [False] * 1000 + [True] * HELD + [False] * (2000 - HELD)
    assert plausibility.sentence.startswith('displacement moved at 2.0')
    assert 'm/s (limit 1 m/s): check the displacement sensor, its seat' in plausibility.sentence


def test_a_stuck_reading_is_told_after_50_ms_and_believed_again_a_second_after_it_moves():
    motion = moving(3000)
    motion[1000:1500] = motion[1000]
    motion[1500:] += motion[1000] - motion[1500]  # no step as well
    doubts, plausibility = doubted(motion)
    assert _first(doubts) == 1050
    assert next(index for index in range(1050, 3000) if not doubts[index]) == 1499 + HELD
    assert 'for 50 ms, without the noise of its sensor (limit 50 ms)' in plausibility.sentence


@pytest.mark.parametrize('amplitude', [0.0, 1e-3])
def test_a_displacement_without_noise_may_stand_still(amplitude):
    motion = moving(3000, amplitude, noise=0.0)
    motion[1000:] = motion[1000]
    assert not any(doubted(motion)[0])


def test_a_noisy_reading_is_told_with_its_noise():
    motion = moving(3000)
    motion[1000:] += np.random.default_rng(8).normal(0.0, 1e-4, 2000)
    doubts, plausibility = doubted(motion)
    assert 1000 < _first(doubts) < 1200
    assert all(doubts[1200:])
    assert 'is above 50 um: check the displacement sensor and its shield' in plausibility.sentence


def test_a_single_jolt_is_no_noise():
    motion = moving(3000)
    motion[1000:] += 0.9e-3
    assert not any(doubted(motion)[0])


@pytest.mark.parametrize('lost', [2, 5])
def test_missing_samples_make_no_noise_and_no_velocity(lost):
    motion, plausibility = moving(5000, 3e-3, 10.0), Plausibility(ControlParameters())
    missing = [k for k in range(1, 5000) if k % lost]
    places = sorted({0, *missing})
    gaps = np.diff(places, prepend=-1) - 1
    found = [doubt(plausibility, motion[k], int(gap)) for k, gap in zip(places, gaps, strict=True)]
    assert not any(found)


def test_limits_can_be_chosen():
    motion = moving(3000)
    motion[1000:] += 2e-3
    assert not any(doubted(motion, displacement_velocity=3.0)[0])
    noisy = moving(3000, noise=1e-4)
    assert not any(doubted(noisy, displacement_noise=2e-4)[0])
