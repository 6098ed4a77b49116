"""The continuous law: phase, degree of damping, reversal, line of the engine, noise."""

import numpy as np
import pytest
from numpy.typing import NDArray

from mount_control.policy import continuous_viscous as policy
from mount_models.arithmetic.compiled import compiled
from mount_models.arithmetic.record import record_bytes, record_dtype
from mount_models.quantity import ParameterError
from mount_models.sampling import SAMPLE_TIME

TIME = np.arange(3000) * SAMPLE_TIME
LEAD = policy.Parameters().lead_time
LAW = record_dtype(policy.Law)
STATE = policy.STATE
TRACE = np.dtype([(name, 'f8') for name in policy.TRACE])


def followed(
    displacement: NDArray[np.float64], crank_frequency: float = 0.0, **parameters: float
) -> tuple[NDArray[np.void], ...]:
    """Return (answers (n, 3): force, velocity, active; traces (n,)) from rest at the first displacement."""
    design = policy.design(policy.Parameters(**parameters), SAMPLE_TIME)
    answers, traces = np.zeros((displacement.size, 3)), np.zeros(displacement.size, TRACE)
    memory = np.zeros(1, STATE).view(np.uint8), np.zeros(design.window)
    law = record_bytes(design.law)
    _follow(law, design.table, *memory, displacement, answers, traces.view(np.uint8), crank_frequency)
    return answers, traces


@compiled
def _follow(law_bytes, table, state_bytes, window, displacement, answers, trace_bytes, crank_frequency):
    law, state, traces = law_bytes.view(LAW)[0], state_bytes.view(STATE)[0], trace_bytes.view(TRACE)
    policy.start(law, state, window, displacement[0])
    for k in range(displacement.size):
        answers[k] = policy.step(law, table, state, window, traces[k], displacement[k], crank_frequency)


def sine(frequency: float, amplitude: float, time: np.ndarray = TIME) -> np.ndarray:
    return amplitude * np.sin(2.0 * np.pi * frequency * time)


def phasor(frequency: float, values: np.ndarray) -> complex:
    """Return amplitude and phase of a frequency in the last second."""
    return complex(2.0 * np.mean(values[-1000:] * np.exp(-2j * np.pi * frequency * TIME[-1000:])))


def relative_to_truth(frequency: float) -> complex:
    """Return the told velocity over the true one at the time at which it shall act."""
    answers, _ = followed(sine(frequency, 1e-3))
    true = 2.0 * np.pi * frequency * 1e-3 * np.cos(2.0 * np.pi * frequency * (TIME + LEAD))
    return phasor(frequency, answers[:, 1]) / phasor(frequency, true)


def test_velocity_has_no_phase_error_at_the_eigenfrequency() -> None:
    relative = relative_to_truth(8.0)
    assert abs(np.angle(relative)) < 0.01
    assert abs(abs(relative) - 1.0) < 0.03


@pytest.mark.parametrize('frequency', [6.0, 7.0, 9.0, 10.0, 11.0])
def test_velocity_is_nearly_right_for_other_engines(frequency: float) -> None:
    assert abs(relative_to_truth(frequency) - 1.0) < 0.15


def test_the_degree_of_damping_rises_with_the_amplitude_to_the_whole_damper() -> None:
    half = policy.Parameters().half_amplitude
    degrees = [followed(sine(8.0, times * half))[0][-1, 2] for times in (0.02, 1.0, 10.0)]
    assert degrees == pytest.approx([0.0, 0.5, 0.98], abs=0.03)
    answers, _ = followed(sine(8.0, 3e-3))
    wanted = policy.Parameters().damping_coefficient * 2.0 * np.pi * 8.0 * 3e-3
    assert abs(phasor(8.0, answers[:, 0])) == pytest.approx(wanted, rel=0.1)


def test_damping_engages_at_once_and_is_released_to_exactly_zero() -> None:
    shaken = np.where(TIME < 1.0, sine(8.0, 1e-3), 0.0)
    answers, _ = followed(shaken)
    first = int(np.argmax(answers[:, 2] > 0.5))
    assert first < 45  # within about a third of a period
    assert answers[-500:, 2].max() == 0.0


def test_force_opposes_the_velocity_at_which_it_acts() -> None:
    answers, traces = followed(sine(8.0, 2e-3) + sine(26.7, 0.2e-3))
    force, velocity, _ = answers.T
    assert (traces['engine_velocity'] * velocity < 0.0).any()
    assert np.all(force * velocity >= 0.0)


def test_force_is_small_where_the_velocity_reverses() -> None:
    answers, traces = followed(sine(8.0, 1e-3))
    force, velocity, _ = answers[1000:].T
    reversing = np.abs(traces['predicted_velocity'][1000:]) < 0.5e-3
    assert np.abs(force[reversing]).max() < 1.6
    assert np.abs(velocity[reversing]).min() > 1e-3  # else: large normal forces


@pytest.mark.parametrize('crank_orders', [0.0, 0.5, 2.0, 6.0])
@pytest.mark.parametrize('frequency', [20.0, 27.0, 45.0, 61.5, 88.0])
def test_lines_at_orders_of_the_engine_are_found_and_not_in_the_damping(
    frequency: float, crank_orders: float
) -> None:
    size = 0.1e-3 * (27.0 / frequency) ** 2
    crank = frequency / crank_orders if crank_orders else 0.0  # Hz; 0: not known
    motion = sine(8.0, 0.5e-3) + sine(frequency, size) + sine(2.0 * frequency, 0.1 * size)
    answers, traces = followed(motion, crank)
    line = 2.0 * np.pi * frequency * size
    assert abs(phasor(frequency, answers[:, 1])) == pytest.approx(line, rel=0.1)
    assert abs(phasor(frequency, traces['engine_velocity'])) < 0.1 * line
    if crank_orders < 6.0:  # the double lies beyond the orders that are followed
        assert abs(phasor(2.0 * frequency, traces['engine_velocity'])) < 0.06 * line
    assert traces['line_frequency'][-1] == pytest.approx(frequency, abs=0.1)
    assert traces['line_amplitude'][-1] == pytest.approx(size, rel=0.1)


def test_a_line_is_cancelled_by_the_size_of_the_force_while_the_slow_motion_has_its_direction() -> None:
    motion = sine(8.0, 3e-3) + sine(45.0, 50e-6)
    stiffness = 1e4  # N/m: small enough for the force to stay positive
    plain, cancelling = (followed(motion, line_stiffness=each)[0][:, 0] for each in (0.0, stiffness))
    ahead = (1.0 - (18.0 / 45.0) ** 2) * 50e-6 * np.exp(2j * np.pi * 45.0 * LEAD) / 1j
    assert phasor(45.0, cancelling - plain) == pytest.approx(-stiffness * ahead, rel=0.15)


def test_half_orders_beside_the_fastest_line_are_found_without_the_speed_of_the_engine() -> None:
    sizes = {60.0: 20e-6, 45.0: 10e-6, 75.0: 5e-6}  # m by Hz: orders 2, 1.5 and 2.5 of the crankshaft
    _, traces = followed(sine(8.0, 0.5e-3) + sum(sine(*line) for line in sizes.items()))
    for frequency, size in sizes.items():
        assert abs(phasor(frequency, traces['engine_velocity'])) < 0.2 * 2.0 * np.pi * frequency * size


@pytest.mark.parametrize(('swing', 'more'), [(3e-3, 1.0), (0.1e-3, 1.43)])
def test_lines_that_turn_the_friction_are_cancelled_by_more(swing: float, more: float) -> None:
    motion = sine(8.0, swing) + sine(45.0, 60e-6)
    force = followed(motion, line_weight=0.0, damping_coefficient=1.0)[0][-1000:, 0]
    ahead = (1.0 - (18.0 / 45.0) ** 2) * 60e-6
    assert np.abs(force).max() == pytest.approx(more * policy.Parameters().line_stiffness * ahead, rel=0.07)


def test_of_lines_of_equal_acceleration_the_faster_one_releases_the_damper_more() -> None:
    slow, fast = (
        followed(sine(8.0, 0.25e-3) + sine(frequency, 0.1e-3 * (27.0 / frequency) ** 2))[0][-1, 2]
        for frequency in (27.0, 108.0)
    )
    assert fast < 0.8 * slow


def test_a_line_of_the_engine_and_noise_release_the_damper() -> None:
    swing, line = sine(8.0, 0.25e-3), sine(24.0, 0.4e-3)
    noise = 2e-5 * np.random.default_rng(1).standard_normal(TIME.size)
    engaged, by_line, by_noise = (followed(each)[0][-1, 2] for each in (swing, swing + line, swing + noise))
    assert engaged > 0.5
    assert by_line < 0.7 * engaged
    assert by_noise < 0.5 * engaged


def test_impact_is_taken_for_no_line() -> None:
    blow = 5e-3 * np.exp(-(((TIME - 0.5) / 0.008) ** 2))
    _, traces = followed(blow)
    assert traces['line_amplitude'].max() < 0.15e-3


def test_first_sample_after_a_start_traces_no_motion() -> None:
    answers, traces = followed(np.full(5, 1.3e-3))
    assert not answers.any()
    assert not any(traces[name][0] for name, unit in policy.TRACE.items() if unit in ('m', 'm/s'))


def test_lead_of_an_eighth_of_a_period_is_refused() -> None:
    with pytest.raises(ParameterError, match='an eighth of a period'):
        policy.design(policy.Parameters(eigenfrequency=16.0, lead_time=0.009), SAMPLE_TIME)
