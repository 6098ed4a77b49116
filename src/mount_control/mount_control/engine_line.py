"""The engine's line: what ignition leaves in the displacement, at an unknown frequency from 18 to 217 Hz.

A running engine shakes itself with a line and twice its frequency. A bank of resonators, one for each hertz,
shows at which frequency the high-passed displacement moves fastest; from there two oscillators follow the
line and its double; the phase of the first corrects the common frequency (a phase-locked loop of second
order). The gain and phase of the high-pass are known and taken back, so that both lines can be subtracted
from the displacement and carried ahead in time.
"""

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from mount_models.arithmetic.compiled import compiled
from mount_models.arithmetic.elementary import sine_and_cosine
from mount_models.arithmetic.record import record_type

LOWEST_FREQUENCY = 18.0  # Hz, chosen: four cylinders at 540 turns per minute
RESONATORS = 200  # 1 Hz apart
_FIRST_FREQUENCY = 27.0  # Hz, chosen: an idling engine
_CORNER = 24.0  # Hz, chosen: of the high-pass, four poles; engine and wheel shake at 6 to 13 Hz
_MEMORY = 0.35  # s, chosen: time constant of the resonators
_SEARCH = 16  # samples, chosen: from one search in the bank to the next
_STRONGER = 2.4  # chosen: ratio of squared velocities at which the line moves to another frequency
_ELSEWHERE = 2  # Hz, chosen: the loop itself follows nearer frequencies
_FOLLOWING = 6.5
"""1/s: share of the deviation from the expected sample that a line takes up in a time (chosen)."""
_PULLING = 9.0
"""Hz/s by which the frequency follows (chosen)."""
_SMALLEST_LINE = 8e-6  # m, chosen: smaller ones pull the frequency less
_LARGEST_DEVIATION = 2.5e-5  # m, chosen: a larger one, beyond twice the line, is an impact
_AMPLITUDE_TIME = 0.04  # s, chosen
_NOISE_TIME = 0.55  # s, chosen: longer than an impact


class EngineLine(NamedTuple):
    """One of two equal high-passes, b = (gain, -2 gain, gain), frequencies in turns per sample, and gains."""

    gain: float
    a1: float
    a2: float
    lowest: float
    highest: float
    first: float
    averaging: float
    noise_averaging: float
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
            *('turns', 'amplitude', 'noise_square'),
        )
    ]
    + [('samples', 'i8')]
)
"""Memory of both high-passes (m), phasors of line and double line behind them (m), frequency of the line
(turns per sample), its amplitude in the displacement (m), mean square beside both lines (m^2), samples since
the search. The bank is an array of `2 * RESONATORS`: real parts, imaginary parts (m)."""


def design(lead_time: float, sample_time: float) -> EngineLine:
    """Return the constants of a line that is predicted `lead_time` s ahead; Butterworth, prewarped."""
    sine, cosine = sine_and_cosine(0.5 * _CORNER * sample_time)
    warped = sine / cosine
    scale = 1.0 / (1.0 + math.sqrt(2.0) * warped + warped * warped)
    return EngineLine(
        gain=scale,
        a1=2.0 * (warped * warped - 1.0) * scale,
        a2=(1.0 - math.sqrt(2.0) * warped + warped * warped) * scale,
        lowest=LOWEST_FREQUENCY * sample_time,
        highest=(LOWEST_FREQUENCY + RESONATORS - 1) * sample_time,
        first=_FIRST_FREQUENCY * sample_time,
        averaging=sample_time / _AMPLITUDE_TIME,
        noise_averaging=sample_time / _NOISE_TIME,
        following=_FOLLOWING * sample_time,
        pulling=_PULLING * sample_time * sample_time,
        lead_samples=lead_time / sample_time,
        sample_time=sample_time,
    )


def rotations(sample_time: float) -> NDArray[np.float64]:
    """Return the factors of the resonators in a sample, real parts then imaginary parts."""
    kept = 1.0 - sample_time / _MEMORY
    sines = [sine_and_cosine((LOWEST_FREQUENCY + place) * sample_time) for place in range(RESONATORS)]
    return kept * np.array([*(cosine for _, cosine in sines), *(sine for sine, _ in sines)])


@compiled
def rest(line, state, displacement):
    """Set a state of zeros to that of a mount which has always been at `displacement` (m), no line in it."""
    state.first_z1 = -line.gain * displacement
    state.first_z2 = line.gain * displacement
    state.turns = line.first


@compiled
def step(line, factors, state, bank, displacement):
    """Take one sample (m); return both lines: displacement (m) now, displacement and velocity (m/s) ahead."""
    once, state.first_z1, state.first_z2 = _high_pass(line, state.first_z1, state.first_z2, displacement)
    seen, state.second_z1, state.second_z2 = _high_pass(line, state.second_z1, state.second_z2, once)
    _shake(factors, bank, (2.0 * line.sample_time / _MEMORY) * seen)
    turns = state.turns
    sine, cosine = sine_and_cosine(turns)
    _follow(line, state, seen, cosine, sine)
    state.samples += 1
    if state.samples >= _SEARCH:
        state.samples = 0
        if _found(line, state, bank):
            turns = state.turns
            sine, cosine = sine_and_cosine(turns)

    real, imaginary = _unfiltered(line, state.cosine_part, state.sine_part, cosine, sine)
    double_real, double_imaginary = _unfiltered(
        line, state.double_real, state.double_imaginary, cosine * cosine - sine * sine, 2.0 * sine * cosine
    )
    amplitude = math.sqrt(real * real + imaginary * imaginary)
    state.amplitude += line.averaging * (amplitude - state.amplitude)
    sine, cosine = sine_and_cosine(line.lead_samples * turns)
    ahead, quarter = _turned(real, imaginary, cosine, sine)
    double_ahead, double_quarter = _turned(
        double_real, double_imaginary, cosine * cosine - sine * sine, 2.0 * sine * cosine
    )
    velocity = -2.0 * math.pi * turns / line.sample_time * (quarter + 2.0 * double_quarter)
    return real + double_real, ahead + double_ahead, velocity


@compiled
def _follow(line, state, seen, cosine, sine):
    """Turn both phasors by one sample and correct them, and the frequency, by what was `seen` (m)."""
    real, imaginary = _turned(state.cosine_part, state.sine_part, cosine, sine)
    double_real, double_imaginary = _turned(
        state.double_real, state.double_imaginary, cosine * cosine - sine * sine, 2.0 * sine * cosine
    )
    square = real * real + imaginary * imaginary
    limit = 2.0 * math.sqrt(square) + _LARGEST_DEVIATION
    deviation = min(max(seen - real - double_real, -limit), limit)
    state.noise_square += line.noise_averaging * (deviation * deviation - state.noise_square)
    pull = line.pulling * imaginary * deviation / (square + _SMALLEST_LINE * _SMALLEST_LINE)
    state.turns = min(max(state.turns - pull, line.lowest), line.highest)
    state.cosine_part, state.sine_part = real + line.following * deviation, imaginary
    state.double_real, state.double_imaginary = double_real + line.following * deviation, double_imaginary


@compiled
def _shake(factors, bank, push):
    """Turn the phasors of the bank by one sample and add `push` (m) to each."""
    cosines, sines = factors[:RESONATORS], factors[RESONATORS:]
    reals, imaginaries = bank[:RESONATORS], bank[RESONATORS:]
    for k in range(RESONATORS):
        real, imaginary = reals[k], imaginaries[k]
        reals[k] = real * cosines[k] - imaginary * sines[k] + push
        imaginaries[k] = real * sines[k] + imaginary * cosines[k]


@compiled
def _found(line, state, bank):
    """Move the line to the fastest resonator where this is elsewhere and clearly faster; return whether."""
    best = 0
    for k in range(1, RESONATORS):
        if _speed_square(bank, k) > _speed_square(bank, best):
            best = k
    here = min(max(int(state.turns / line.sample_time - LOWEST_FREQUENCY + 0.5), 0), RESONATORS - 1)
    if abs(best - here) <= _ELSEWHERE or _speed_square(bank, best) <= _STRONGER * _speed_square(bank, here):
        return False
    state.turns = (LOWEST_FREQUENCY + best) * line.sample_time
    state.cosine_part = state.sine_part = state.double_real = state.double_imaginary = 0.0
    return True


@compiled
def _speed_square(bank, k):
    """Return the square of a resonator's velocity, in m^2 Hz^2."""
    frequency = LOWEST_FREQUENCY + k
    return (bank[k] * bank[k] + bank[RESONATORS + k] * bank[RESONATORS + k]) * frequency * frequency


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
