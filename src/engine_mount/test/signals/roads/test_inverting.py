"""A road, the chassis acceleration on it, and the road that is found from that."""

import numpy as np
import pytest

from engine_mount.signals.roads.driving import Speed, speed_of
from engine_mount.signals.roads.inversion import BAND, chassis_response, in_band, inverted, road_of
from engine_mount.signals.signal import SignalError, signal_of
from mount_sim.excitation.road import RandomRoad, random_road
from mount_sim.excitation.scenario import STEP_TIME
from mount_sim.plant.vehicle import Vehicle, resting_vehicle, ride_without_friction

DURATION = 16.0
STEPS = round(DURATION / STEP_TIME)


def driven(road, **changes):
    vehicle = Vehicle(**changes)
    return ride_without_friction(vehicle, resting_vehicle(), road, np.zeros_like(road), STEP_TIME)


@pytest.fixture(scope='module')
def recorded():
    """Road (m), displacement of the mount (m) and acceleration (m/s^2) at every step, from rest to rest."""
    times = STEP_TIME * np.arange(STEPS)
    within = np.clip(np.minimum(times, DURATION - 2.0 - times), 0.0, 1.0)  # the last second is rest
    road = within * random_road(times, RandomRoad(roughness=16e-6, speed=20.0, highest_frequency=2.3))
    return road, *driven(road)


def relative(found, wanted):
    return np.sqrt(np.mean((found - wanted) ** 2) / np.mean(wanted**2))


def test_the_response_is_that_of_the_simulated_vehicle():
    times = STEP_TIME * np.arange(round(8.0 / STEP_TIME))
    for frequency in (1.0, 8.0, 36.0):
        road = 1e-3 * np.sin(2.0 * np.pi * frequency * times) * np.clip(times, 0.0, 1.0)
        _, acceleration = driven(road)
        last = slice(round(6.0 / STEP_TIME), None)  # a whole number of periods
        answer = (
            2.0 * np.mean(acceleration[last] * np.exp(-2j * np.pi * frequency * times[last])) / (-1j * 1e-3)
        )
        wanted = chassis_response(Vehicle(), np.array([frequency]))[0]
        assert abs(answer - wanted) < 0.03 * abs(wanted)


def test_the_road_comes_back_in_the_band(recorded):
    road, _, acceleration = recorded
    found = road_of(acceleration, STEP_TIME, Vehicle())
    assert relative(found, in_band(road, STEP_TIME)) < 0.03


def test_driven_again_the_road_gives_acceleration_and_displacement_back(recorded):
    _, displacement, acceleration = recorded
    every = round(0.002 / STEP_TIME)  # a recording at 500 Hz
    signal = signal_of('az', STEP_TIME * np.arange(STEPS)[::every], acceleration[::every])
    road = inverted(signal, speed_of('72/3.6'))
    assert road.kept.error < 0.03
    assert road.kept.share > 0.5
    assert road.distance[-1] == pytest.approx(20.0 * DURATION, rel=0.001)
    heights = np.interp(STEP_TIME * np.arange(STEPS), 1e-3 * np.arange(road.height.size), road.height)
    again, _ = driven(heights)
    middle = slice(STEPS // 8, -STEPS // 8)
    found, wanted = (in_band(each, STEP_TIME)[middle] for each in (again, displacement))
    assert relative(found, wanted) < 0.05


def test_what_one_acceleration_cannot_tell_stands_in_the_file(recorded, tmp_path):
    _, _, acceleration = recorded
    every = round(0.01 / STEP_TIME)  # 100 Hz
    signal = signal_of('az', STEP_TIME * np.arange(STEPS)[::every], acceleration[::every])
    road = inverted(signal, speed_of('20'))
    text = road.write(tmp_path / 'road.csv', 'drive.csv').read_text()
    for words in (
        'above 40 Hz nothing is known',
        f'below {BAND[0]:g} Hz',
        'the other axle',
        'road behind drive.csv',
    ):
        assert words in text
    assert 'distance [m],effective_height [m]\n' in text


def test_where_the_car_stands_no_road_is_told(recorded):
    _, _, acceleration = recorded
    every = round(0.002 / STEP_TIME)
    signal = signal_of('az', STEP_TIME * np.arange(STEPS)[::every], acceleration[::every])
    stopping = Speed(np.array([0.0, 10.0, 20.0]), np.array([20.0, 0.0, 20.0]), '')
    with pytest.raises(SignalError, match='at less than 1 m/s no road can be told'):
        inverted(signal, stopping)
    short = Speed(np.array([0.0, 10.0]), np.array([20.0, 20.0]), '')
    with pytest.raises(SignalError, match='the speed ends at 10 s'):
        inverted(signal, short)
