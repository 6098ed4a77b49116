"""A viscous damper that engages with the amplitude in the band, and cancels the engine's lines meanwhile.

    F = c g v_n - K (1 + r) x_l where that has the direction of v, else 0
    g follows A^2 / (A^2 + A_0^2 + A A_l + A_n^2), fast up, slowly down

v is the velocity; v_n that without the lines, from an alpha-beta tracker and the acceleration -w0^2 x_b; x_l
the displacement of the lines, all when the force acts. A = sqrt(x_b^2 + (v_b / w0)^2) is the amplitude in the
band, index b; A_n is 60 times the noise. A_l is line_weight (w / w0)^2.5 times the amplitude of a line at w:
of a faster line the elastomer passes less, so the friction that it turns is heard more.

Friction can only oppose v. While the slow motion fixes its direction, K, that of the elastomer, cancels the
force of the lines. Where they turn it, half of each period is left: r = 0.5 V_l^2 / (V_l^2 + V_0^2) with the
amplitude V_l of their velocity and V_0^2 = w0^2 (A^2 + A_0^2). Near 18 Hz the chassis and the harmonics of
friction answer: the low part of a line, see `engine_line`, is not cancelled, and half of it is damped.
Figures: docs/explanation/policy.md.
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

_SLOWEST = 0.0016
"""m/s, chosen, about the error of the predicted velocity: below it the law of friction would ask for a large
normal force, and friction be far too large wherever the velocity is larger than predicted."""
_LEAST_DEGREE = 0.015
"""Degree of damping below which there is no current (chosen): the offset current alone would rub."""
_LOW_DAMPED = 0.5  # chosen: share of the low part of the lines that the damper feels
_TURNED = 0.5  # chosen: so much more is cancelled where the lines turn the friction
_NOISE_WEIGHT = 3600.0  # chosen: square of how much noise of the displacement releases the damper


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
    ] = 2900.0
    half_amplitude: Annotated[
        float, Quantity('m', 'A_0: amplitude in the band at which damping is half engaged', 1e-6, 0.01)
    ] = 0.0001
    engaging_time: Annotated[
        float, Quantity('s', 'time constant by which the degree of damping rises', 0.001, 1.0)
    ] = 0.008
    releasing_time: Annotated[float, Quantity('s', 'and by which it falls', 0.001, 10.0)] = 0.14
    line_weight: Annotated[
        float, Quantity('1', 'how much lines of the engine release the damper; 0: not at all', 0.0, 100.0)
    ] = 0.17
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
            half_square=parameters.half_amplitude * parameters.half_amplitude,
            engaging=min(sample_time / parameters.engaging_time, 1.0),
            releasing=min(sample_time / parameters.releasing_time, 1.0),
            line_weight=parameters.line_weight / (w0 * w0 * math.sqrt(w0)),
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
    now, ahead, low_velocity, high_velocity = engine_line.step(
        law.line, table, lines, window, displacement, crank_frequency
    )
    engine = displacement - now
    banded, _, band_velocity = band_pass.step(law.band, state.band, engine)
    engine_velocity = _tracked(law, state, engine) - law.velocity_share * banded
    velocity = engine_velocity + low_velocity + high_velocity

    in_band = band_velocity / law.w0
    square = banded * banded + in_band * in_band
    amplitude = math.sqrt(square)
    full = square + law.half_square
    others = law.line_weight * lines.shaking * amplitude + _NOISE_WEIGHT * lines.noise_square
    wanted = square / (full + others)
    state.degree += (law.engaging if wanted > state.degree else law.releasing) * (wanted - state.degree)

    trace.band_displacement = banded
    trace.amplitude = amplitude
    trace.line_amplitude = lines.amplitude
    trace.line_frequency = lines.fastest / law.sample_time
    trace.engine_velocity = engine_velocity
    trace.predicted_velocity = velocity
    if state.degree < _LEAST_DEGREE:
        return 0.0, velocity, 0.0
    direction = -1.0 if velocity < 0.0 else 1.0
    line_square = lines.velocity * lines.velocity
    turned = _TURNED * line_square / (line_square + law.w0 * law.w0 * full)
    damped = law.damping * state.degree * (engine_velocity + _LOW_DAMPED * low_velocity)
    force = max(direction * (damped - law.line_stiffness * (1.0 + turned) * ahead), 0.0)
    return direction * force, direction * max(abs(velocity), _SLOWEST), state.degree


@compiled
def _tracked(law, state, displacement):
    """Return the velocity (m/s) of the alpha-beta tracker after one sample (m)."""
    expected = state.position + law.sample_time * state.velocity
    surprise = displacement - expected
    state.position = expected + law.alpha * surprise
    state.velocity += law.beta_rate * surprise
    return state.velocity
