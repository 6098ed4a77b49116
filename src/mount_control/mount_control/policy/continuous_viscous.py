"""A viscous damper that engages with the amplitude in the band, without waiting for a period.

How much force comes from the unfiltered velocity, so that friction vanishes where the true velocity reverses;
the band-pass only decides whether to damp. An idle line is told apart from the engine's motion: it keeps the
damper from engaging, and what force there is follows the engine alone.

    x_n = x - idle line,  v_n = v_ab - T w0^2 x_b,  v = v_n + velocity of the idle line
    A = sqrt(x_b^2 + (v_b / w0)^2),  A_i = idle_weight (w_i / w0) (amplitude of the idle line)
    q = smoothstep((A - A_low) / (A_full - A_low)) A^2 / (A^2 + A_i^2),  g follows q, fast up, slowly down
    s = min(2 |v|, max(v_n sign v, 0)),  |F| = min(c g (sqrt(s^2 + d^2) - d), F_max)

v_ab is the velocity of an alpha-beta tracker of x_n, index b the band-pass. T is designed so that v_n has
phase 0 at the eigenfrequency, tracker and delay of the loop included. Figures: docs/explanation/policy.md.
"""

import math
from typing import Annotated, NamedTuple

from mount_control import band_pass, idle_line
from mount_control.delay import LOOP_DELAY, check_lead, delay_at
from mount_control.policy.contract import Design
from mount_models.arithmetic.compiled import compiled
from mount_models.arithmetic.elementary import expm1, log, sine_and_cosine
from mount_models.arithmetic.record import record_type
from mount_models.quantity import ParameterError, Quantity
from mount_models.sampling import SAMPLE_TIME

_REVERSAL_SLOPE = 2.0
"""So many times as steeply as the damper the force may rise where the whole velocity reverses (chosen)."""
_LOWEST_DEGREE = 0.03
"""Below this degree there is no current (chosen): the offset current alone would rub with some 2 N."""
_SMALLEST_SQUARE = 1e-12  # m^2: of a micrometre, keeps 0 / 0 away


class Parameters(NamedTuple):
    """Parameters of tracker, band-pass, degree of damping and damper."""

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
    ] = 0.7
    damping_coefficient: Annotated[
        float, Quantity('N s/m', 'c: force over velocity at full damping', 1.0, 1e4)
    ] = 2600.0
    rounding_velocity: Annotated[
        float,
        Quantity('m/s', 'd: below it the force falls off faster than the velocity', 1e-5, 0.1),
    ] = 0.0008
    force_limit: Annotated[float, Quantity('N', 'largest force asked for', 1.0, 1e4)] = 300.0
    lowest_amplitude: Annotated[
        float, Quantity('m', 'amplitude in the band up to which there is no damping', 0.0, 0.01)
    ] = 0.00012
    full_amplitude: Annotated[
        float, Quantity('m', 'amplitude in the band from which damping is full', 1e-6, 0.01)
    ] = 0.0004
    opening_time: Annotated[
        float, Quantity('s', 'time constant by which the degree of damping rises', 0.001, 1.0)
    ] = 0.008
    closing_time: Annotated[float, Quantity('s', 'and by which it falls', 0.001, 10.0)] = 0.4
    idle_weight: Annotated[
        float,
        Quantity('1', 'how much an idle line lowers damping; 0: as if the engine never idled', 0.0, 100.0),
    ] = 5.0


class Law(NamedTuple):
    """What a step needs: gains per sample, and the rest as in the module's formulas."""

    band: band_pass.BandPass
    line: idle_line.IdleLine
    sample_time: float
    alpha: float
    beta_rate: float
    band_share: float
    w0: float
    damping: float
    rounding: float
    force_limit: float
    lowest: float
    per_range: float
    rise: float
    fall: float
    idle_weight: float


STATE = record_type(
    [
        ('band', band_pass.STATE),
        ('line', idle_line.STATE),
        ('position', 'f8'),
        ('velocity', 'f8'),
        ('degree', 'f8'),
    ]
)
TRACE = {
    'band_displacement': 'm',
    'amplitude': 'm',
    'idle_amplitude': 'm',
    'idle_frequency': 'Hz',
    'engine_velocity': 'm/s',
    'predicted_velocity': 'm/s',
}


def design(parameters: Parameters, sample_time: float) -> Design:
    """Return the law; raises `ParameterError` for amplitudes in the wrong order or too long a lead."""
    _check(parameters)
    w0 = 2.0 * math.pi * parameters.eigenfrequency
    alpha = _alpha(parameters.position_gain, sample_time)
    lead_time = delay_at(parameters.lead_time, sample_time)
    beta = 2.0 * (2.0 - alpha) - 4.0 * math.sqrt(1.0 - alpha)
    return Design(
        Law(
            band=band_pass.design(parameters.eigenfrequency, parameters.quality, 0.0, sample_time),
            line=idle_line.design(lead_time, sample_time),
            sample_time=sample_time,
            alpha=alpha,
            beta_rate=beta / sample_time,
            band_share=_band_share(parameters.eigenfrequency, lead_time, alpha, beta, sample_time),
            w0=w0,
            damping=parameters.damping_coefficient,
            rounding=parameters.rounding_velocity,
            force_limit=parameters.force_limit,
            lowest=parameters.lowest_amplitude,
            per_range=1.0 / (parameters.full_amplitude - parameters.lowest_amplitude),
            rise=min(sample_time / parameters.opening_time, 1.0),
            fall=min(sample_time / parameters.closing_time, 1.0),
            idle_weight=parameters.idle_weight / (parameters.eigenfrequency * sample_time),
        )
    )


def _check(parameters: Parameters) -> None:
    if not parameters.lowest_amplitude < parameters.full_amplitude:
        raise ParameterError(
            f'lowest_amplitude ({1e3 * parameters.lowest_amplitude:g} mm) must lie below full_amplitude '
            f'({1e3 * parameters.full_amplitude:g} mm)'
        )
    check_lead(parameters.lead_time, parameters.eigenfrequency)


def _alpha(position_gain: float, sample_time: float) -> float:
    """Return the tracker's alpha that keeps its two equal poles, given at 1 kHz, where they are in time.

    They lie at z = sqrt(1 - alpha), so the powers of 1 - alpha count the samples.
    """
    if sample_time == SAMPLE_TIME:
        return position_gain
    return -expm1(log(1.0 - position_gain) * (sample_time / SAMPLE_TIME))


def _band_share(
    eigenfrequency: float, lead_time: float, alpha: float, beta: float, sample_time: float
) -> float:
    """Return T w0^2 (1/s).

    The tracker's velocity is V = (beta/Ts) z (z - 1) / (z^2 + (alpha + beta - 2) z + 1 - alpha) of the
    displacement, the band-pass at its centre is 1. V - T w0^2 shall have the phase 90 degrees and the lead,
    so T w0^2 = Re V + Im V tan(lead).
    """
    # in real numbers: how products of complex ones are rounded differs between processors
    sine, cosine = sine_and_cosine(eigenfrequency * sample_time)
    square_real, square_imaginary = cosine * cosine - sine * sine, 2.0 * cosine * sine
    rate = beta / sample_time
    above_real, above_imaginary = rate * (square_real - cosine), rate * (square_imaginary - sine)
    sum_of_gains = alpha + beta - 2.0
    below_real = square_real + sum_of_gains * cosine + (1.0 - alpha)
    below_imaginary = square_imaginary + sum_of_gains * sine
    scale = 1.0 / (below_real * below_real + below_imaginary * below_imaginary)
    real = (above_real * below_real + above_imaginary * below_imaginary) * scale
    imaginary = (above_imaginary * below_real - above_real * below_imaginary) * scale
    lead_sine, lead_cosine = sine_and_cosine(eigenfrequency * lead_time)
    return real + imaginary * lead_sine / lead_cosine


@compiled
def start(law, state, window, displacement):
    """Set a memory of zeros to a mount at rest at `displacement` (m), damping off."""
    band_pass.settle(law.band, state.band, displacement)
    idle_line.rest(law.line, state.line, displacement)
    state.position = displacement


@compiled
def transfer(law, new_law, state, window, new_window):
    """Go on from the same last samples; tracker, idle line and degree of damping keep their past."""
    band_pass.transfer(law.band, new_law.band, state.band)


@compiled
def step(law, table, state, window, trace, displacement):
    """Take one sample (m); return force (N), velocity (m/s) at which it acts, degree of damping 0 .. 1."""
    line_displacement, line_velocity = idle_line.step(law.line, state.line, displacement)
    engine = displacement - line_displacement
    banded, _, band_velocity = band_pass.step(law.band, state.band, engine)
    engine_velocity = _tracked(law, state, engine) - law.band_share * banded
    velocity = engine_velocity + line_velocity

    in_band = band_velocity / law.w0
    square = banded * banded + in_band * in_band
    amplitude = math.sqrt(square)
    degree = _degree(law, state, amplitude, square)

    trace.band_displacement = banded
    trace.amplitude = amplitude
    trace.idle_amplitude = state.line.amplitude
    trace.idle_frequency = state.line.turns / law.sample_time
    trace.engine_velocity = engine_velocity
    trace.predicted_velocity = velocity
    if degree == 0.0:
        return 0.0, velocity, 0.0
    direction = -1.0 if velocity < 0.0 else 1.0
    speed = min(_REVERSAL_SLOPE * abs(velocity), max(direction * engine_velocity, 0.0))
    rounded = math.sqrt(speed * speed + law.rounding * law.rounding) - law.rounding
    return direction * min(law.damping * degree * rounded, law.force_limit), velocity, degree


@compiled
def _tracked(law, state, displacement):
    """Return the velocity (m/s) of the alpha-beta tracker after one sample (m)."""
    expected = state.position + law.sample_time * state.velocity
    surprise = displacement - expected
    state.position = expected + law.alpha * surprise
    state.velocity += law.beta_rate * surprise
    return state.velocity


@compiled
def _degree(law, state, amplitude, square):
    """Return the degree of damping, 0 or `_LOWEST_DEGREE` .. 1, for an amplitude (m) and its square."""
    share = min(max((amplitude - law.lowest) * law.per_range, 0.0), 1.0)
    idle = law.idle_weight * state.line.turns * state.line.amplitude
    wanted = share * share * (3.0 - 2.0 * share) * square / (square + idle * idle + _SMALLEST_SQUARE)
    state.degree += (law.rise if wanted > state.degree else law.fall) * (wanted - state.degree)
    return state.degree if state.degree >= _LOWEST_DEGREE else 0.0
