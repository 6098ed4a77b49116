"""Recorded acceleration and measured road at the plant's step: accurate, refused where implausible."""

import hashlib

import numpy as np
import pytest

from engine_mount.signals.excitation import build_excitation, with_array
from engine_mount.signals.signal import SignalError
from mount_models.quantity import ParameterError, flattened, with_flattened
from mount_sim.excitation import building
from mount_sim.excitation.excitation import Seat
from mount_sim.excitation.scenario import STEP_TIME
from mount_sim.parameters import SimParameters

RATE = 104.26  # Hz, of a common motion sensor


def _times(rate=RATE, duration=10.0):
    return np.arange(int(rate * duration)) / rate


def _sine(times, frequency=8.0):
    return np.sin(2.0 * np.pi * frequency * times)


def _sim(scenario, file, **changes):
    changes = {name.replace('__', '.'): value for name, value in changes.items()}
    return with_flattened(SimParameters(), {'scenario': scenario, f'{scenario}.file': str(file), **changes})


@pytest.fixture
def built(tmp_path):
    """Return a function that gives samples the way of a file to the excitation."""

    def build(times, values, scenario='recorded', **changes):
        np.save(tmp_path / 'imu_value.npy', values)
        np.save(tmp_path / 'imu_t.npy', times)
        return build_excitation(_sim(scenario, tmp_path / 'imu_value.npy', **changes))

    return build


def _middle(excitation):
    """Return steps and values of the middle, s and m/s^2."""
    steps = np.arange(len(excitation.values)) * STEP_TIME
    part = (steps > 2.0) & (steps < 8.0)
    return steps[part], excitation.values[:][part]


@pytest.mark.parametrize('rate', [RATE, 999.0, 1000.0, 25_600.0])
def test_a_sine_of_8_hz_comes_out_at_20_khz_as_it_was_without_its_mean(built, rate):
    times = _times(rate)
    excitation = built(times, 9.81 + _sine(times))
    steps, values = _middle(excitation)
    assert np.abs(values - _sine(steps)).max() < 0.001
    assert len(excitation.values) * STEP_TIME == pytest.approx(times[-1], abs=1.5 / rate)


def test_jittered_time_stamps_are_regularised_and_the_drive_tells_it(built):
    jitter = np.random.default_rng(3).uniform(-0.3, 0.3, _times().size) / RATE
    jitter[0] = 0.0
    excitation = built(_times() + jitter, _sine(_times()))
    steps, values = _middle(excitation)
    assert np.abs(values - _sine(steps)).max() < 0.06
    (note,) = excitation.notes
    assert note.startswith("imu_value.npy, column 'imu.0': taken as evenly spaced at 104.3 Hz: ")


def test_an_acceleration_that_no_chassis_has_is_refused_with_its_sample(built):
    values = 9.81 + _sine(_times())
    values[321] = 80.0
    with pytest.raises(
        SignalError, match=r"'imu.0': sample 321 at 3\.0788 s is 70\..* m/s\^2 .*beyond \+-50 m/s\^2"
    ):
        built(_times(), values)
    values[321] = 9.81
    with pytest.raises(SignalError, match=r'with the scale of 1000'):
        built(_times(), values, recorded__scale=1000.0)


def test_a_recording_shakes_the_chassis_to_the_bit_as_ever(built):
    """Whoever changes these numbers changes all drives over recordings."""
    values = np.random.Generator(np.random.PCG64(5)).integers(-1000, 1000, 200) * 2.0**-8
    excitation = built(
        np.arange(200) / 100.0, values, recorded__scale=-3.3, idle__amplitude=5.0, timeline__duration=1.5
    )
    digest = hashlib.sha256(excitation.values[:].tobytes() + excitation.engine_forces[:].tobytes())
    assert digest.hexdigest()[:16] == 'fac0065bcfae77ae'


def test_a_measured_road_goes_under_the_wheel_as_it_is(built):
    times = _times(1000.0, 3.001)
    excitation = built(times, 0.01 * _sine(times, 5.0), 'road')
    assert excitation.seat is Seat.VEHICLE
    steps = np.arange(len(excitation.values)) * STEP_TIME
    middle = slice(2000, -2000)
    np.testing.assert_allclose(excitation.values[:][middle], 0.01 * _sine(steps, 5.0)[middle], atol=5e-6)
    with pytest.raises(ParameterError, match=r'is longer than the road .*imu.0. \(3.000 s\)'):
        built(times, 0.01 * _sine(times), 'road', timeline__duration=9.0)
    with pytest.raises(SignalError, match='is meant in m, without hills'):
        built(times, 10.0 * _sine(times), 'road')


@pytest.mark.parametrize('scenario', ['recorded', 'road'])
def test_the_simulator_reads_the_array_of_a_recording_to_the_bit(built, tmp_path, scenario):
    times = _times(RATE if scenario == 'recorded' else 1000.0)
    idle = {'idle__amplitude': 100.0}
    scale = {'recorded__scale': -2.0} if scenario == 'recorded' else {}
    there = built(times, 0.5 * _sine(times), scenario, **idle, **scale, timeline__duration=3.0)
    values = flattened(_sim(scenario, tmp_path / 'imu_value.npy', **idle, **scale))
    handed = with_flattened(SimParameters(), with_array(values, there, tmp_path / 'given'))
    read = building.build_excitation(handed)
    assert read.values[:].tobytes() == there.values[:].tobytes()
    assert read.engine_forces[:].tobytes() == there.engine_forces[:].tobytes()
    assert (read.seat, read.start, read.step_time) == (there.seat, there.start, there.step_time)
