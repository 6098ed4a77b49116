"""When damping is switched on and off (section 6 of the paper)."""

import numpy as np
import pytest
from controllers import make_controller, sine
from hypothesis import given, settings
from hypothesis import strategies as st

from mount_control import switching

LAW = switching.Switching(on_level=0.0008, off_level=0.00035, period=125)


def _run(distances, law=LAW):
    """Magnitude and activity of each sample, for a band displacement of these values."""
    state, window = np.zeros(1, switching.STATE), np.zeros(law.period)
    out = [switching.step(law, state[0], window, x) for x in distances]
    return np.array([m for m, _ in out]), np.array([a for _, a in out])


def test_at_the_level_itself_damping_stays_off():
    assert not _run(np.full(1000, 0.0008))[1].any()
    assert _run(np.full(1000, np.nextafter(0.0008, 1.0)))[1].any()


def test_damping_goes_off_after_more_than_one_period_below_the_level():
    active = _run(np.r_[np.full(200, 0.001), np.full(400, 0.00034)])[1]
    assert active[:200].any()
    assert active[200:].tolist() == [1] * 125 + [0] * 275  # off with the 126th sample below


def test_one_sample_at_the_off_level_begins_the_wait_anew():
    quiet = np.full(300, 0.00034)
    quiet[100] = 0.00035
    active = _run(np.r_[np.full(200, 0.001), quiet])[1]
    assert np.flatnonzero(active)[-1] + 1 == 200 + 101 + 125


@pytest.mark.parametrize('between', [0.00036, 0.0006, 0.00079])
def test_between_the_levels_nothing_changes(between):
    assert not _run(np.full(2000, between))[1].any()
    active = _run(np.r_[np.full(200, 0.001), np.full(2000, between)])[1]
    assert active[124:].all()


def test_after_switching_off_a_full_period_above_the_level_is_needed_again():
    active = _run(np.r_[np.full(200, 0.001), np.full(300, 0.0), np.full(200, 0.001)])[1]
    assert active[500:].tolist() == [0] * 124 + [1] * 76


@pytest.mark.parametrize(
    ('frequency', 'amplitude', 'on'),
    [
        (8.0, 1e-3, True),
        (8.0, 0.79e-3, False),
        (25.0, 1e-3, False),
        (4.0, 1e-3, False),
        (6.0, 1e-3, True),
        (10.0, 1e-3, True),
    ],
)
def test_what_the_whole_chain_takes_for_a_shaking_engine(frequency, amplitude, on):
    traces = make_controller().run(sine(frequency, amplitude, 3.0))
    assert bool(traces['damping_active'].any()) is on


@given(distances=st.lists(st.sampled_from([0.0, 0.1, -0.2, 0.2, 0.3]), max_size=40), period=st.integers(1, 6))
@settings(deadline=None)
def test_magnitude_is_the_highest_value_of_the_last_period(distances, period):
    magnitude, _ = _run(distances, LAW._replace(period=period))
    before = np.abs([0.0] * (period - 1) + distances)
    assert magnitude.tolist() == [before[k : k + period].max() for k in range(len(distances))]


def test_told_to_damp_always_it_goes_on_after_one_period_and_never_off():
    still = np.zeros(2000)
    active = make_controller(switching='always').run(np.r_[still, sine(8.0, 2e-3, 1.0), still])[
        'damping_active'
    ]
    assert active.tolist() == [0] * 124 + [1] * (len(active) - 124)
    assert not make_controller().run(still)['damping_active'].any()
