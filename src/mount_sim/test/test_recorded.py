"""Recorded acceleration at the plant's step: accurate, without its mean, refused where implausible."""

import re

import numpy as np
import pytest

from engine_mount.recordings.signals.signal import SignalError
from mount_sim.excitation.recorded import acceleration_at, recorded_acceleration

RATE = 104.26  # Hz, of a common motion sensor
STEP = 5e-5


def _times(rate=RATE, duration=10.0):
    return np.arange(int(rate * duration)) / rate


def _sine(times, frequency=8.0):
    return np.sin(2.0 * np.pi * frequency * times)


@pytest.fixture
def driven(tmp_path):
    """Return a function that gives samples the way of a file to the excitation."""

    def drive(times, values, scale=1.0):
        np.save(tmp_path / 'imu_value.npy', values)
        np.save(tmp_path / 'imu_t.npy', times)
        return acceleration_at(recorded_acceleration(tmp_path / 'imu_value.npy'), scale, STEP)[:]

    return drive


def _amplitude(values, frequency=8.0, begin=2.0, end=8.0):
    """Amplitude, phase (rad) against a sine, and the largest deviation from it, in the middle."""
    times = np.arange(len(values)) * STEP
    part = (times > begin) & (times < end)
    angle = 2.0 * np.pi * frequency * times[part]
    basis = np.c_[np.sin(angle), np.cos(angle)]
    (a, b), *_ = np.linalg.lstsq(basis, values[part], rcond=None)
    return np.hypot(a, b), np.arctan2(b, a), np.abs(basis @ (a, b) - values[part]).max()


@pytest.mark.parametrize('rate', [RATE, 200.0, 999.0, 1000.0, 2000.0, 25_600.0])
def test_a_sine_of_8_hz_comes_out_at_20_khz_as_it_was(driven, rate):
    times = _times(rate)
    resampled = driven(times, _sine(times))
    amplitude, phase, deviation = _amplitude(resampled)
    assert amplitude == pytest.approx(1.0, abs=0.0005)
    assert abs(phase) < 1e-4
    assert deviation < 0.001
    assert len(resampled) * STEP == pytest.approx(times[-1], abs=1.5 / rate)


def test_the_mean_is_removed(driven):
    times = _times()
    resampled = driven(times, 9.81 + _sine(times))
    assert abs(np.mean(resampled[40_000:160_000])) < 1e-3
    assert np.abs(resampled).max() < 1.1


def test_jittered_time_stamps_are_regularised(driven):
    times = _times()
    jitter = np.random.default_rng(3).uniform(-0.3, 0.3, len(times)) / RATE
    jitter[0] = 0.0
    jittered = times + jitter
    amplitude, phase, deviation = _amplitude(driven(jittered, _sine(jittered)))
    assert amplitude == pytest.approx(1.0, abs=0.005)
    # the median of jittered steps misses the rate by little, and nothing else moves the time
    assert abs(phase) < 0.01
    assert deviation < 0.02


def test_nothing_appears_above_half_the_recorded_rate(driven):
    times = _times()
    noise = np.random.default_rng(4).standard_normal(len(times))
    resampled = driven(times, noise)[20_000:180_000]
    power = np.abs(np.fft.rfft(resampled * np.hanning(len(resampled)))) ** 2
    frequency = np.fft.rfftfreq(len(resampled), STEP)
    assert power[frequency > 0.65 * RATE].sum() < 2e-3 * power.sum()


def test_short_gaps_are_interpolated(driven):
    times = _times()
    kept = np.r_[times[:500], times[505:]]
    assert len(driven(kept, _sine(kept))) * STEP == pytest.approx(times[-1], abs=2 * STEP)


@pytest.mark.parametrize(
    ('change', 'reason'),
    [
        (lambda t: t * 1000.0, 'has 0.1043 samples per second (is its time in seconds?)'),
        (lambda t: t * 2.1, 'samples per second (is its time in seconds?); at least 50 are needed'),
        (
            lambda t: t + 0.12 * (t > 5.0),
            'has a gap of 0.130 s at 4.997 s; up to 0.125 s are interpolated: cut the recording there',
        ),
    ],
)
def test_what_the_engine_cannot_be_driven_with_is_refused(driven, change, reason):
    with pytest.raises(SignalError, match=re.escape(reason)):
        driven(change(_times()), _sine(_times()))


def test_two_stamps_a_microsecond_apart_shake_nothing(driven):
    times = np.arange(1000) / 100.0
    values = _sine(times) + 0.05 * np.random.default_rng(1).standard_normal(1000)
    clean = driven(times, values)
    times[500] = times[499] + 1e-6
    found = driven(times, values)
    length = min(len(found), len(clean))
    assert np.abs(found[:length] - clean[:length]).max() < 0.01


def test_an_acceleration_that_no_chassis_has_is_refused_with_its_sample(driven):
    times = _times()
    values = 9.81 + _sine(times)
    values[321] = 80.0
    with pytest.raises(
        SignalError, match=r'imu.0: sample 321 at 3\.0788 s is 70\..* m/s\^2 .*beyond \+-50 m/s\^2'
    ):
        driven(times, values)
    values[321] = 9.81
    with pytest.raises(SignalError, match=r'is its unit another one \(--scale\)'):
        driven(times, values, scale=1000.0)
