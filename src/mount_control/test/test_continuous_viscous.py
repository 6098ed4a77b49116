"""The continuous law: phase, degree of damping, reversal, idle line."""

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
_EMPTY = np.zeros(0)


def followed(displacement: NDArray[np.float64], **parameters: float) -> tuple[NDArray[np.void], ...]:
    """Return (answers (n, 3): force, velocity, active; traces (n,)) from rest at the first displacement."""
    law = record_bytes(policy.design(policy.Parameters(**parameters), SAMPLE_TIME).law)
    answers, traces = np.zeros((displacement.size, 3)), np.zeros(displacement.size, TRACE)
    _follow(law, np.zeros(1, STATE).view(np.uint8), displacement, answers, traces.view(np.uint8), _EMPTY)
    return answers, traces


@compiled
def _follow(law_bytes, state_bytes, displacement, answers, trace_bytes, empty):
    law, state, traces = law_bytes.view(LAW)[0], state_bytes.view(STATE)[0], trace_bytes.view(TRACE)
    policy.start(law, state, empty, displacement[0])
    for k in range(displacement.size):
        answers[k] = policy.step(law, empty, state, empty, traces[k], displacement[k])


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
    assert abs(relative_to_truth(frequency) - 1.0) < 0.13


def test_small_amplitude_gives_no_force_and_large_one_the_whole_damper() -> None:
    answers, _ = followed(sine(8.0, 0.1e-3))
    assert not answers[:, 0].any()
    assert not answers[:, 2].any()
    answers, _ = followed(sine(8.0, 0.6e-3))
    assert answers[500:, 2].min() > 0.99
    damping = policy.Parameters().damping_coefficient
    assert abs(phasor(8.0, answers[:, 0])) == pytest.approx(damping * 2.0 * np.pi * 8.0 * 0.6e-3, rel=0.06)


def test_damping_follows_at_once_and_ends_at_exactly_zero() -> None:
    shaken = np.where(TIME < 1.0, sine(8.0, 1e-3), 0.0)
    answers, _ = followed(shaken)
    first = int(np.argmax(answers[:, 2] > 0.5))
    assert first < 45  # within about a third of a period
    assert answers[-500:, 2].max() == 0.0


def test_force_opposes_the_velocity_at_which_it_acts_and_never_exceeds_its_limit() -> None:
    answers, traces = followed(sine(8.0, 2e-3) + sine(26.7, 0.2e-3), force_limit=100.0)
    force, velocity, _ = answers.T
    assert np.all(force * velocity >= 0.0)
    assert np.abs(force).max() == 100.0
    against = traces['engine_velocity'] * velocity < 0.0
    assert against.any()
    assert not force[against].any()


def test_force_is_small_where_the_velocity_reverses() -> None:
    answers, _ = followed(sine(8.0, 1e-3))
    force, velocity, _ = answers[1000:].T
    assert np.abs(force[np.abs(velocity) < 0.5e-3]).max() < 1.0


def test_idle_line_is_not_in_the_force() -> None:
    answers, traces = followed(sine(8.0, 1e-3) + sine(27.0, 0.1e-3) + sine(54.0, 0.03e-3))
    line = abs(phasor(27.0, answers[:, 1]))
    assert line == pytest.approx(2.0 * np.pi * 27.0 * 0.1e-3, rel=0.05)
    assert abs(phasor(27.0, traces['engine_velocity'])) < 0.05 * line
    double = 2.0 * np.pi * 54.0 * 0.03e-3
    assert abs(phasor(54.0, traces['engine_velocity'])) < 0.1 * double
    assert traces['idle_frequency'][-1] == pytest.approx(27.0, abs=0.1)
    assert traces['idle_amplitude'][-1] == pytest.approx(0.1e-3, rel=0.05)


def test_idle_line_holds_the_damper_off() -> None:
    alone, _ = followed(sine(8.0, 0.25e-3))
    idling, _ = followed(sine(8.0, 0.25e-3) + sine(24.0, 0.2e-3))
    unweighted, _ = followed(sine(8.0, 0.25e-3) + sine(24.0, 0.2e-3), idle_weight=0.0)
    assert alone[-1, 2] > 0.3
    assert unweighted[-1, 2] > 0.3
    assert not idling[-500:, 2].any()


@pytest.mark.parametrize('frequency', [20.0, 23.0, 30.0, 33.0])
def test_idle_line_is_found_from_540_to_1000_turns_per_minute(frequency: float) -> None:
    _, traces = followed(sine(frequency, 0.1e-3))
    assert traces['idle_frequency'][-1] == pytest.approx(frequency, abs=0.1)


def test_impact_is_taken_for_no_line() -> None:
    blow = 5e-3 * np.exp(-(((TIME - 0.5) / 0.008) ** 2))
    _, traces = followed(blow)
    assert traces['idle_amplitude'].max() < 0.1e-3


def test_first_sample_after_a_start_traces_no_motion() -> None:
    answers, traces = followed(np.full(5, 1.3e-3))
    assert not answers.any()
    assert not any(traces[name][0] for name, unit in policy.TRACE.items() if unit in ('m', 'm/s'))


def test_lead_of_an_eighth_of_a_period_is_refused() -> None:
    with pytest.raises(ParameterError, match='an eighth of a period'):
        policy.design(policy.Parameters(eigenfrequency=16.0, lead_time=0.009), SAMPLE_TIME)
