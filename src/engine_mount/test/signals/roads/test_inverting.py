"""A road, the chassis acceleration on it, and the road that is found from that."""

import numpy as np
import pytest

from engine_mount.signals.roads.inversion import chassis_response, inverted
from engine_mount.signals.signal import signal_of
from mount_sim.excitation.road import RandomRoad, random_road
from mount_sim.excitation.scenario import STEP_TIME
from mount_sim.plant.vehicle import Vehicle, resting_vehicle, ride_without_friction

DURATION = 16.0
TIMES = STEP_TIME * np.arange(round(DURATION / STEP_TIME))


def driven(road):
    return ride_without_friction(Vehicle(), resting_vehicle(), road, np.zeros_like(road), STEP_TIME)


@pytest.fixture(scope='module')
def recorded():
    """Displacement of the mount (m) and acceleration (m/s^2) at every step, from rest to rest."""
    within = np.clip(np.minimum(TIMES, DURATION - 2.0 - TIMES), 0.0, 1.0)  # the last second is rest
    return driven(within * random_road(TIMES, RandomRoad(roughness=16e-6, speed=20.0, highest_frequency=2.3)))


def found(recorded, rate):
    every = round(1.0 / rate / STEP_TIME)
    return inverted(signal_of('az', TIMES[::every], recorded[1][::every]), 20.0)


def test_the_response_is_that_of_the_simulated_vehicle():
    times = STEP_TIME * np.arange(round(8.0 / STEP_TIME))
    for frequency in (1.0, 8.0, 36.0):
        road = 1e-3 * np.sin(2.0 * np.pi * frequency * times) * np.clip(times, 0.0, 1.0)
        _, acceleration = driven(road)
        last = slice(round(6.0 / STEP_TIME), None)  # a whole number of periods
        phases = np.exp(-2j * np.pi * frequency * times[last])
        answer = 2.0 * np.mean(acceleration[last] * phases) / (-1j * 1e-3)
        wanted = chassis_response(Vehicle(), np.array([frequency]))[0]
        assert abs(answer - wanted) < 0.03 * abs(wanted)


def test_driven_again_the_road_gives_displacement_and_acceleration_back(recorded):
    road = found(recorded, 500.0)
    assert road.distance[-1] == pytest.approx(20.0 * DURATION, rel=0.001)
    again = driven(np.interp(TIMES, 1e-3 * np.arange(road.height.size), road.height))
    frequency = np.fft.rfftfreq(TIMES.size, STEP_TIME)
    held = (frequency > 1.2) & (frequency < 40.0)
    middle = slice(TIMES.size // 8, -TIMES.size // 8)
    for one, wanted in zip(again, recorded, strict=True):
        one, wanted = (
            np.fft.irfft(np.fft.rfft(values) * held, TIMES.size)[middle] for values in (one, wanted)
        )
        assert np.sqrt(np.mean((one - wanted) ** 2) / np.mean(wanted**2)) < 0.05


def test_what_one_acceleration_cannot_tell_stands_in_the_file(recorded, tmp_path):
    text = found(recorded, 100.0).write(tmp_path / 'road.csv', 'drive.csv').read_text()
    sentences = ('above 40 Hz nothing is known', 'below 0.9 Hz', 'the other axle', 'road behind drive.csv')
    assert all(words in text for words in sentences)
    assert 'distance [m],effective_height [m]\n' in text
