"""A viscous damper that engages with the amplitude in the band, and cancels the engine's lines meanwhile.

The force comes from the unfiltered velocity without the engine's lines, so that friction is small where the
true velocity reverses; the band-pass only sets the degree of damping. While the slow motion fixes the
direction of friction, its size is modulated against the force of the lines in the elastomer.

    x_n = x - lines,  v_n = v_ab - T w0^2 x_b,  v = v_n + velocity of the lines
    A = sqrt(x_b^2 + (v_b / w0)^2),  A_l = line_weight a_l / w0^2,  A_n = 50 times the noise
    q = A^2 / (A^2 + A_0^2 + A_l^2 + A_n^2),  g follows q, fast up, slowly down
    s = max((v_n + 0.5 v_low) sign v, 0),  D^2 = d^2 + (0.4 v_l)^2
    |F| = min(max(c g (sqrt(s^2 + D^2) - D) - K x_high sign v, 0), 2 c g |v|)

v_ab is the velocity of an alpha-beta tracker of x_n, index b the band-pass. T is the lead and the lag of the
tracker. v_l and a_l are the amplitudes of the lines' velocity and acceleration; x_high and v_low are their
displacement and velocity when the force acts, weighted as in `engine_line`: near 18 Hz the chassis and the
harmonics of friction answer, so there a line is damped rather than cancelled. Figures:
docs/explanation/policy.md.
"""

import math
from typing import Annotated, NamedTuple

from mount_control import band_pass, engine_line
from mount_control.delay import LOOP_DELAY, check_lead, delay_at
from mount_control.policy.contract import Design
from mount_models.arithmetic.compiled import compiled
from mount_models.arithmetic.elementary import expm1, log
from mount_models.arithmetic.record import record_type
from mount_models.quantity import Quantity
from mount_models.sampling import SAMPLE_TIME

_REVERSAL_SLOPE = 2.0
"""So many times as steeply as the damper the force may rise where the whole velocity reverses (chosen)."""
_LEAST_DEGREE = 0.03
"""Degree of damping below which there is no current (chosen): the offset current alone would rub."""
_NOISE_WEIGHT = 2500.0  # chosen: square of how much noise of the displacement releases the damper
_LINE_DAMPING = 0.5  # chosen: share of the damper that a line at the lowest frequency feels
_LINE_ROUNDING = 0.4  # chosen: share of the lines' velocity below which the force falls off


class Parameters(NamedTuple):
    """Parameters of tracker, band-pass, degree of damping, damper and line of the engine."""

    eigenfrequency: Annotated[
        float,
        Quantity(
            'Hz', 'centre of the band: engine on its mounts; 8 serves 6 to 11', 4.0, 16.0, 'paper, sec. 5'
        ),
    ] = 8.0
    quality: Annotated[
        float, Quantity('1', 'quality of the band-pass; small: other engines too', 0.3, 5.0)
    ] = 0.5
    lead_time: Annotated[
        float,
        Quantity(
            's',
            'from a sample to the middle of the effect of its setpoint, at 1 kHz',
            0.0,
            0.01,
            'derived',
        ),
    ] = LOOP_DELAY
    position_gain: Annotated[
        float,
        Quantity('1', 'alpha of the tracker at 1 kHz; large: quick, noisy', 0.1, 0.95),
    ] = 0.6
    damping_coefficient: Annotated[
        float, Quantity('N s/m', 'c: force over velocity, fully engaged', 1.0, 1e4)
    ] = 3000.0
    rounding_velocity: Annotated[
        float,
        Quantity('m/s', 'd: below it the force falls off faster than the velocity', 1e-5, 0.1),
    ] = 0.0009
    half_amplitude: Annotated[
        float, Quantity('m', 'A_0: amplitude in the band at which damping is half engaged', 1e-6, 0.01)
    ] = 0.00013
    engaging_time: Annotated[
        float, Quantity('s', 'time constant by which the degree of damping rises', 0.001, 1.0)
    ] = 0.01
    releasing_time: Annotated[float, Quantity('s', 'and by which it falls', 0.001, 10.0)] = 0.14
    line_weight: Annotated[
        float, Quantity('1', 'how much lines of the engine release the damper; 0: not at all', 0.0, 100.0)
    ] = 0.28
    line_stiffness: Annotated[
        float, Quantity('N/m', 'K: force of the lines that friction cancels, by displacement', 0.0, 1e6)
    ] = 2e5


class Law(NamedTuple):
    """What a step needs: gains per sample, and the rest as in the module's formulas."""

    band: band_pass.BandPass
    line: engine_line.EngineLine
    sample_time: float
    alpha: float
    beta_rate: float
    velocity_share: float
    w0: float
    damping: float
    rounding: float
    half_square: float
    engaging: float
    releasing: float
    line_weight: float
    line_stiffness: float


STATE = record_type(
    [
        ('band', band_pass.STATE),
        ('line', engine_line.STATE),
        ('position', 'f8'),
        ('velocity', 'f8'),
        ('degree', 'f8'),
    ]
)
TRACE = {
    'band_displacement': 'm',
    'amplitude': 'm',
    'line_amplitude': 'm',
    'line_frequency': 'Hz',
    'engine_velocity': 'm/s',
    'predicted_velocity': 'm/s',
}


def design(parameters: Parameters, sample_time: float) -> Design:
    """Return the law; raises `ParameterError` for too long a lead."""
    check_lead(parameters.lead_time, parameters.eigenfrequency)
    w0 = 2.0 * math.pi * parameters.eigenfrequency
    alpha = _alpha(parameters.position_gain, sample_time)
    lead_time = delay_at(parameters.lead_time, sample_time)
    beta = 2.0 * (2.0 - alpha) - 4.0 * math.sqrt(1.0 - alpha)
    return Design(
        Law(
            band=band_pass.design(parameters.eigenfrequency, parameters.quality, 0.0, sample_time),
            line=engine_line.design(lead_time, sample_time),
            sample_time=sample_time,
            alpha=alpha,
            beta_rate=beta / sample_time,
            velocity_share=(lead_time + sample_time * (alpha / beta - 0.5)) * w0 * w0,
            w0=w0,
            damping=parameters.damping_coefficient,
            rounding=parameters.rounding_velocity,
            half_square=parameters.half_amplitude * parameters.half_amplitude,
            engaging=min(sample_time / parameters.engaging_time, 1.0),
            releasing=min(sample_time / parameters.releasing_time, 1.0),
            line_weight=parameters.line_weight / (w0 * w0),
            line_stiffness=parameters.line_stiffness,
        ),
        engine_line.rotations(sample_time),
        engine_line.WINDOW,
    )


def _alpha(position_gain: float, sample_time: float) -> float:
    """Return the tracker's alpha that keeps its two equal poles, given at 1 kHz, where they are in time.

    They lie at z = sqrt(1 - alpha), so the powers of 1 - alpha count the samples.
    """
    if sample_time == SAMPLE_TIME:
        return position_gain
    return -expm1(log(1.0 - position_gain) * (sample_time / SAMPLE_TIME))


@compiled
def start(law, state, window, displacement):
    """Set a memory of zeros to a mount at rest at `displacement` (m), damping off."""
    band_pass.settle(law.band, state.band, displacement)
    engine_line.rest(law.line, state.line, displacement)
    state.position = displacement


@compiled
def transfer(law, new_law, state, window, new_window):
    """Go on from the same last samples; tracker, line and degree keep their past."""
    new_window[:] = window
    band_pass.transfer(law.band, new_law.band, state.band)


@compiled
def step(law, table, state, window, trace, displacement, crank_frequency):
    """Take one sample (m); return force (N), velocity (m/s) at which it acts, and the degree 0 .. 1."""
    lines = state.line
    now, ahead, line_velocity, low_velocity = engine_line.step(
        law.line, table, lines, window, displacement, crank_frequency
    )
    engine = displacement - now
    banded, _, band_velocity = band_pass.step(law.band, state.band, engine)
    engine_velocity = _tracked(law, state, engine) - law.velocity_share * banded
    velocity = engine_velocity + line_velocity

    in_band = band_velocity / law.w0
    square = banded * banded + in_band * in_band
    of_lines = law.line_weight * lines.acceleration
    others = law.half_square + of_lines * of_lines + _NOISE_WEIGHT * lines.noise_square
    wanted = square / (square + others)
    state.degree += (law.engaging if wanted > state.degree else law.releasing) * (wanted - state.degree)

    trace.band_displacement = banded
    trace.amplitude = math.sqrt(square)
    trace.line_amplitude = lines.amplitude
    trace.line_frequency = lines.fastest / law.sample_time
    trace.engine_velocity = engine_velocity
    trace.predicted_velocity = velocity
    if state.degree < _LEAST_DEGREE:
        return 0.0, velocity, 0.0
    direction = -1.0 if velocity < 0.0 else 1.0
    speed = max(direction * (engine_velocity + _LINE_DAMPING * low_velocity), 0.0)
    of_lines = _LINE_ROUNDING * lines.velocity
    rounding = math.sqrt(law.rounding * law.rounding + of_lines * of_lines)
    damping = law.damping * state.degree
    damper = damping * (math.sqrt(speed * speed + rounding * rounding) - rounding)
    force = min(
        max(damper - direction * law.line_stiffness * ahead, 0.0), _REVERSAL_SLOPE * damping * abs(velocity)
    )
    return direction * force, velocity, state.degree


@compiled
def _tracked(law, state, displacement):
    """Return the velocity (m/s) of the alpha-beta tracker after one sample (m)."""
    expected = state.position + law.sample_time * state.velocity
    surprise = displacement - expected
    state.position = expected + law.alpha * surprise
    state.velocity += law.beta_rate * surprise
    return state.velocity
