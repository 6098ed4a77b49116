"""Stamps are true, evenly spaced and rising: over the wrap, with drift, delays, pauses and restarts."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from mount_driver.clock import CounterClock, ElectronicsClock

EPOCH = 1_700_000_000_000_000_000  # ns, ROS time minus steady clock
START = 5_000_000_000  # ns, steady clock at the first sample
WRAP = 1 << 32


def run(delays_ns, *, first_us=1000, drift=0.0, clock=None, start=START):
    """Return (stamps - true times, stamps) of samples 1 ms apart whose frames take `delays_ns`.

    `drift` > 0: the electronics' clock is fast.
    """
    clock = clock or ElectronicsClock(EPOCH)
    errors, stamps = [], []
    received = 0
    for index, delay in enumerate(delays_ns):
        true_time = start + index * 1_000_000
        counter = first_us + round(index * 1000 * (1 + drift))
        received = max(received, true_time + int(delay))  # frames keep their order
        stamp = clock.stamp(counter % WRAP, received)
        stamps.append(stamp)
        errors.append(stamp - EPOCH - true_time)
    return np.array(errors), np.array(stamps)


def usual_delays(count, seed=1):
    """Delays of 60 us and more, as measured on one machine: an exponential tail and rare long ones."""
    random = np.random.default_rng(seed)
    delays = 60_000 + random.exponential(30_000, count)
    delays[random.random(count) < 0.01] += 5_000_000
    return delays


@pytest.mark.parametrize('ppm', [-200, 50])
def test_the_drift_of_the_electronics_is_followed(ppm):
    clock = ElectronicsClock(EPOCH)
    errors, stamps = run(usual_delays(60_000), drift=ppm * 1e-6, clock=clock)
    assert clock.drift == pytest.approx(-ppm * 1e-6, abs=2e-6)
    assert np.all(np.abs(errors[20_000:] - 60_000) < 5_000)
    assert np.max(np.abs(errors)) < 400_000
    assert np.all(np.abs(np.diff(stamps) - 1_000_000) <= 2_000)


@pytest.mark.parametrize('pause_ms', [100, 900, 3000])
def test_a_burst_after_a_pause_of_our_process_does_not_move_the_stamps(pause_ms):
    delays = usual_delays(12_000)
    delays[6000] = pause_ms * 1e6  # all later frames queue up behind this one
    clock = ElectronicsClock(EPOCH)
    errors, stamps = run(delays, clock=clock)
    assert np.all(np.abs(errors[5000:]) < 70_000)
    assert np.all(np.abs(np.diff(stamps) - 1_000_000) <= 1_000)
    assert (clock.restarts, clock.gaps, clock.remappings) == (0, 0, 0)


def test_a_late_first_frame_is_made_good_without_a_step_back():
    delays = usual_delays(60_000)
    delays[0] = 300_000_000
    clock = ElectronicsClock(EPOCH)
    errors, stamps = run(delays, clock=clock)
    assert errors[0] == 300_000_000
    assert np.all(np.diff(stamps) >= 899_000)
    assert np.all(np.abs(errors[20_000:]) < 100_000)
    assert clock.remappings == 0


def test_a_path_that_becomes_slower_for_good_is_believed_after_a_while():
    delays = usual_delays(40_000)
    delays[10_000:] += 50_000_000
    clock = ElectronicsClock(EPOCH)
    errors, stamps = run(delays, clock=clock)
    assert clock.remappings == 1
    assert np.all(np.diff(stamps) > 0)
    assert np.all(np.abs(errors[20_000:] - 50_000_000) < 200_000)


def test_a_restart_begins_a_new_mapping_ahead_of_the_last_stamp():
    clock = ElectronicsClock(EPOCH)
    _, before = run(usual_delays(5_000), clock=clock)
    errors, after = run(usual_delays(5_000), clock=clock, first_us=0, start=START + 5_300_000_000)
    assert clock.restarts == 1
    assert after[0] > before[-1]
    assert np.all(np.abs(errors) < 1_000_000)


@settings(max_examples=60, deadline=None)
@given(
    st.lists(
        st.tuples(
            st.one_of(st.integers(1, 3000), st.integers(0, WRAP - 1)),  # step of the counter, us
            st.integers(0, 2_000_000_000),  # step of the steady clock, ns
        ),
        max_size=300,
    ),
    st.integers(0, WRAP - 1),
)
def test_stamps_never_go_back_whatever_arrives(steps, first):
    clock = ElectronicsClock(EPOCH)
    counter, received = first, START
    last = clock.stamp(counter, received)
    for step, waited in steps:
        counter, received = (counter + step) % WRAP, received + waited
        stamp = clock.stamp(counter, received)
        assert stamp > last if step else stamp == last
        last = stamp


def test_in_lock_step_the_counter_is_unwrapped():
    clock = CounterClock()
    stamps = [clock.stamp(us % WRAP) for us in range(WRAP - 5000, WRAP + 5000, 1000)]
    assert set(np.diff(stamps)) == {1_000_000}
    stamps = [clock.stamp(us % WRAP) for us in range(WRAP + 5000, 3 * WRAP, WRAP // 4)]
    assert np.all(np.diff(stamps) == WRAP // 4 * 1000)


def test_in_lock_step_a_restart_goes_on_behind_the_last_stamp():
    clock = CounterClock()
    clock.stamp(5_000_000)
    assert clock.stamp(1000) == 5_001_000_000
    assert clock.stamp(2000) == 5_002_000_000
    assert clock.restarts == 1
