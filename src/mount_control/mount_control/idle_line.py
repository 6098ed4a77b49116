"""The idle line: what the engine's ignition leaves in the displacement, told apart from its other motion.

Engine speed is not measured, but an idling engine shakes itself with a line and twice its frequency, which
stand in the displacement. Two oscillators follow them in the high-passed displacement; the phase of the first
corrects the common frequency (a phase-locked loop of second order). What the high-pass does to both is known
and taken back, so that they can be subtracted from the displacement and carried ahead in time.
"""

import math
from typing import NamedTuple

from mount_models.arithmetic.compiled import compiled
from mount_models.arithmetic.elementary import sine_and_cosine
from mount_models.arithmetic.record import record_type

LOWEST_FREQUENCY, HIGHEST_FREQUENCY = 18.0, 36.0
"""Hz (chosen): the first line of four cylinders from 540 to 1080 turns per minute."""
_FIRST_FREQUENCY = 27.0  # Hz, chosen: in the middle
_CORNER = 24.0  # Hz, chosen: of the high-pass, four poles; engine and wheel shake at 6 to 13 Hz
_FOLLOWING = 12.0
"""1/s: share of what was not expected that a line takes up in a time (chosen): settled in 0.25 s."""
_PULLING = 16.0
"""Hz/s by which the frequency follows (chosen): from the middle to either end within 1 s."""
_SMALLEST_LINE = 5e-6  # m, chosen: smaller ones pull the frequency less
_LARGEST_SURPRISE = 5e-5  # m, chosen: beyond it and twice the line, what comes is an impact, no line
_AMPLITUDE_TIME = 0.2  # s, chosen


class IdleLine(NamedTuple):
    """One of two equal high-passes, b = (gain, -2 gain, gain), the limits in turns per sample, and gains."""

    gain: float
    a1: float
    a2: float
    lowest: float
    highest: float
    first: float
    averaging: float
    following: float
    pulling: float
    lead_samples: float
    sample_time: float


STATE = record_type(
    [
        (name, 'f8')
        for name in (
            *('first_z1', 'first_z2', 'second_z1', 'second_z2'),
            *('cosine_part', 'sine_part', 'double_real', 'double_imaginary'),
            *('turns', 'amplitude'),
        )
    ]
)
"""Memory of both high-passes (m), phasors of line and double line behind them (m), frequency of the line
(turns per sample), its amplitude in the displacement (m)."""


def design(lead_time: float, sample_time: float) -> IdleLine:
    """Return the constants of a line whose velocity is told `lead_time` s ahead; Butterworth, prewarped."""
    sine, cosine = sine_and_cosine(0.5 * _CORNER * sample_time)
    warped = sine / cosine
    scale = 1.0 / (1.0 + math.sqrt(2.0) * warped + warped * warped)
    return IdleLine(
        gain=scale,
        a1=2.0 * (warped * warped - 1.0) * scale,
        a2=(1.0 - math.sqrt(2.0) * warped + warped * warped) * scale,
        lowest=LOWEST_FREQUENCY * sample_time,
        highest=HIGHEST_FREQUENCY * sample_time,
        first=_FIRST_FREQUENCY * sample_time,
        averaging=sample_time / _AMPLITUDE_TIME,
        following=_FOLLOWING * sample_time,
        pulling=_PULLING * sample_time * sample_time,
        lead_samples=lead_time / sample_time,
        sample_time=sample_time,
    )


@compiled
def rest(line, state, displacement):
    """Set a state of zeros to that of a mount which has always been at `displacement` (m), no line in it."""
    state.first_z1 = -line.gain * displacement
    state.first_z2 = line.gain * displacement
    state.turns = line.first


@compiled
def step(line, state, displacement):
    """Take one sample (m); return both lines' displacement now (m) and their velocity ahead (m/s)."""
    once, state.first_z1, state.first_z2 = _high_pass(line, state.first_z1, state.first_z2, displacement)
    seen, state.second_z1, state.second_z2 = _high_pass(line, state.second_z1, state.second_z2, once)

    turns = state.turns
    sine, cosine = sine_and_cosine(turns)
    double_sine, double_cosine = 2.0 * sine * cosine, cosine * cosine - sine * sine
    real, imaginary = _turned(state.cosine_part, state.sine_part, cosine, sine)
    double_real, double_imaginary = _turned(
        state.double_real, state.double_imaginary, double_cosine, double_sine
    )
    square = real * real + imaginary * imaginary
    limit = 2.0 * math.sqrt(square) + _LARGEST_SURPRISE
    surprise = min(max(seen - real - double_real, -limit), limit)
    pull = line.pulling * imaginary * surprise / (square + _SMALLEST_LINE * _SMALLEST_LINE)
    state.turns = min(max(turns - pull, line.lowest), line.highest)
    state.cosine_part, state.sine_part = real + line.following * surprise, imaginary
    state.double_real, state.double_imaginary = double_real + line.following * surprise, double_imaginary

    real, imaginary = _unfiltered(line, state.cosine_part, imaginary, cosine, sine)
    double_real, double_imaginary = _unfiltered(
        line, state.double_real, double_imaginary, double_cosine, double_sine
    )
    amplitude = math.sqrt(real * real + imaginary * imaginary)
    state.amplitude += line.averaging * (amplitude - state.amplitude)
    ahead_sine, ahead_cosine = sine_and_cosine(line.lead_samples * turns)
    ahead = real * ahead_sine + imaginary * ahead_cosine
    ahead_sine, ahead_cosine = 2.0 * ahead_sine * ahead_cosine, 1.0 - 2.0 * ahead_sine * ahead_sine
    ahead += 2.0 * (double_real * ahead_sine + double_imaginary * ahead_cosine)
    return real + double_real, -2.0 * math.pi * turns / line.sample_time * ahead


@compiled
def _high_pass(line, z1, z2, value):
    """Return the high-passed value and the next state (transposed direct form II)."""
    high = line.gain * value + z1
    return high, z2 - 2.0 * line.gain * value - line.a1 * high, line.gain * value - line.a2 * high


@compiled
def _turned(real, imaginary, cosine, sine):
    return real * cosine - imaginary * sine, real * sine + imaginary * cosine


@compiled
def _unfiltered(line, real, imaginary, cosine, sine):
    """Return the phasor before both high-passes, at z = cosine + j sine.

    One of them is gain (z - 1)^2 / (z^2 + a1 z + a2); its inverse is multiplied in twice.
    """
    above_real = cosine * cosine - sine * sine + line.a1 * cosine + line.a2
    above_imaginary = 2.0 * cosine * sine + line.a1 * sine
    less = cosine - 1.0
    below_real, below_imaginary = line.gain * (less * less - sine * sine), line.gain * 2.0 * less * sine
    scale = 1.0 / (below_real * below_real + below_imaginary * below_imaginary)
    inverse_real = (above_real * below_real + above_imaginary * below_imaginary) * scale
    inverse_imaginary = (above_imaginary * below_real - above_real * below_imaginary) * scale
    real, imaginary = _turned(real, imaginary, inverse_real, inverse_imaginary)
    return _turned(real, imaginary, inverse_real, inverse_imaginary)
