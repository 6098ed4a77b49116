"""The coil's current is believed where the loop can have brought it, and doubted in time where not."""

import math

import numpy as np
import pytest

from mount_driver.protocol import Measurement, Setpoint
from mount_driver.watches.coil_watch import CoilWatch, CoilWatchParameters

COUNTERS = 1 << 16
LIMITS = CoilWatchParameters()
SAMPLES = 2000
TIME = np.arange(SAMPLES) * 1e-3
DAMPING = np.where(TIME % 0.5 < 0.3, 0.47 + 0.56 * np.abs(np.sin(50.0 * TIME)), 0.0)  # on and off


def watched(
    setpoints, carried, *, limits=LIMITS, enabled=lambda k: True, way=0, missing=(), answered=lambda k: True
):
    """Return (sample, sentence) of the first doubt, None if there is none.

    `carried(k, current, wanted)` follows each setpoint from `way` samples after it was due. The driver hears
    all samples but the `missing` ones, and answers those `answered`.
    """
    watch, current, sent = CoilWatch(limits), 0.0, []
    wanted = [0.0] * (way + 1)
    for k, setpoint in enumerate(setpoints):
        heard = k not in missing
        if heard:
            measured = current if math.isnan(current) else round(5000.0 * current) / 5000.0
            if sentence := watch.judge(sampled(k, measured, enabled(k)), sent):
                return k, sentence
            sent = [Setpoint(setpoint, k % COUNTERS)] if answered(k) else []
        wanted.append(setpoint if heard and answered(k) else wanted[-1])
        current = carried(k, current, wanted[-1 - way])
    return None


def sampled(k, current, enabled=True):
    return Measurement(k % COUNTERS, 1000 * k, 0.0, current, 0.0, 0.0, enabled=enabled)


def sound(_, current, wanted):
    """A working coil: 400 Hz, and no faster than 14 V allow."""
    return current + float(np.clip((1.0 - math.exp(-0.8 * math.pi)) * (wanted - current), -0.2, 0.13))


def ideal(_, current, wanted):
    """A coil without lag."""
    return wanted


def noise():
    return np.random.default_rng(3).uniform(0.0, 3.0, SAMPLES)


SETPOINTS = {
    'damping': DAMPING,
    'steps': np.where(TIME % 0.1 < 0.05, 3.0, 0.0),
    'sine': 1.5 + 1.5 * np.sin(100.0 * TIME),
    'noise': noise(),
}


@pytest.mark.parametrize('name', SETPOINTS)
@pytest.mark.parametrize('coil', [sound, ideal])
@pytest.mark.parametrize('way', [0, 1, 19])
def test_a_working_coil_is_not_doubted(name, coil, way):
    assert watched(SETPOINTS[name], coil, way=way) is None


def test_missing_samples_are_no_doubt():
    random = np.random.default_rng(5)
    assert watched(DAMPING, sound, missing=set(np.flatnonzero(random.uniform(size=SAMPLES) < 0.3))) is None


STRICT = LIMITS._replace(duration=0.002)


def slowest(_, current, wanted):
    """A coil at the least supply."""
    return current + float(np.clip(wanted - current, -0.15, 0.05))


@pytest.mark.parametrize('heard', [True, False])
def test_electronics_that_had_gone_to_0_ampere_in_a_pause_may_rise_from_there(heard):
    def after_a_pause(k, current, wanted):
        return 0.0 if 500 <= k < 530 else slowest(k, current, wanted)

    missing = () if heard else range(500, 531)
    told = watched(
        np.full(SAMPLES, 1.0),
        after_a_pause,
        limits=STRICT,
        missing=missing,
        enabled=lambda k: not 500 < k <= 530,
        answered=lambda k: not 480 <= k < 529,
    )
    assert told is None


def test_0_ampere_that_was_sent_by_a_watch_may_be_followed_late():
    watch = CoilWatch(LIMITS)
    sent = [Setpoint(0.0, COUNTERS - 1, enable=False), *(Setpoint(1.0, k) for k in range(SAMPLES - 1))]
    told = [watch.judge(sampled(k, 0.0), [setpoint]) for k, setpoint in enumerate(sent)]
    assert not any(told[:500])
    assert told[540]


FAULTS = {
    'open': lambda k, current, wanted: 0.0 if k > 1000 else sound(k, current, wanted),
    'too little': lambda k, current, wanted: min(sound(k, current, wanted), 0.39 if k > 1000 else 9.0),
    'stuck at 3 A': lambda k, current, wanted: 3.0 if k > 1000 else sound(k, current, wanted),
    'not valid': lambda k, current, wanted: math.nan if k > 1000 else wanted,
    'frozen': lambda k, current, wanted: current if k > 1000 else sound(k, current, wanted),
}


@pytest.mark.parametrize('fault', FAULTS)
def test_a_coil_that_does_not_follow_is_doubted(fault):
    """Within its duration and, where the setpoint itself must first leave the bounds, a swing of 63 ms."""
    sample, sentence = watched(DAMPING, FAULTS[fault])
    assert 1000 + 20 <= sample <= 1000 + 20 + 63
    assert 'must lie within' in sentence
    assert '0.1 A about its setpoint; it has not for' in sentence
    assert 'check supply, coil, cable and power stage' in sentence


@pytest.mark.parametrize('enabled', [True, False])
def test_a_current_that_flows_at_0_ampere_is_doubted_whether_or_not_the_electronics_say_to_be_on(enabled):
    stuck_on = watched(
        np.where(TIME < 1.0, 1.0, 0.0),
        lambda k, current, wanted: 1.0 if k > 900 else sound(k, current, wanted),
        enabled=lambda k: enabled or k < 1000,
    )
    # Only electronics that say to be off cannot be following a setpoint of before that is late.
    assert 1020 <= stuck_on[0] <= (1045 if enabled else 1040)
    assert stuck_on[1].startswith('coil current (1.000 A) must lie within 0.000 .. ')


def test_electronics_that_say_to_be_off_and_carry_nothing_are_safe():
    off = watched(np.full(SAMPLES, 1.0), lambda k, current, wanted: 0.0, enabled=lambda k: False)
    assert off is None


def test_a_current_that_is_not_valid_at_0_ampere_is_no_doubt():
    assert watched(np.zeros(SAMPLES), lambda k, current, wanted: math.nan) is None


def test_a_deviation_shorter_than_the_duration_is_no_doubt_unless_it_comes_again_and_again():
    assert watched(DAMPING, lambda k, current, wanted: 3.0 if k % 1000 < 15 else wanted) is None
    assert watched(DAMPING, lambda k, current, wanted: 3.0 if k % 40 < 15 else wanted) is not None


def test_samples_are_counted_on_where_their_counter_wraps():
    watch, told = CoilWatch(LIMITS), []
    for k in range(COUNTERS - 1000, COUNTERS + 1000):
        sent = [Setpoint(1.0, (k - 1) % COUNTERS)]
        told.append(watch.judge(sampled(k, 1.0 if k < COUNTERS + 5 else 0.0), sent))
    assert not any(told[30:1025])
    assert all(told[1026:])


@pytest.mark.parametrize('answered', [21, 30, 40_000, 65_534])
def test_what_answers_a_sample_that_is_too_old_or_not_yet_taken_is_followed_by_no_one(answered):
    watch = CoilWatch(LIMITS)
    told = [watch.judge(sampled(k, 2.0), [Setpoint(2.0, (k - 2 - answered) % COUNTERS)]) for k in range(200)]
    assert all(told[90:])
