"""The engine's lines: what ignition leaves in the displacement, from 18 to 217 Hz.

A running engine shakes itself at multiples of half the frequency of its crankshaft. Where that frequency is
not known, half the frequency of the fastest line takes its place: a bank of resonators, one for each hertz,
shows it. Oscillators at the first twelve multiples follow the lines in the high-passed displacement. Each
counts by how clearly it stands above the rest. The gain and phase of the high-pass are known and taken back,
so that the lines can be subtracted from the displacement and carried ahead in time.
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
LINES = 12  # orders 0.5 to 6 of the crankshaft
WINDOW = 2 * (RESONATORS + LINES)
"""Numbers of memory: phasors (m) of the resonators, then of the lines; real parts, then imaginary parts."""
_FIRST_FREQUENCY = 27.0  # Hz, chosen: an idling engine
_CORNER = 24.0  # Hz, chosen: of the high-pass, four poles; engine and wheel shake at 6 to 13 Hz
_MEMORY = 0.35  # s, chosen: time constant of the resonators
_SEARCH = 16  # samples, chosen: from one search in the bank to the next
_STRONGER = 2.4  # chosen: ratio of squared velocities at which the fastest line moves to another frequency
_ELSEWHERE = 2  # Hz, chosen: a nearer frequency is gone to gradually
_GRADUALLY = 0.05  # chosen: share of the way to it in a search
_FOLLOWING = 6.5
"""1/s: share of the deviation from the expected sample that a line takes up in a time (chosen)."""
_DOUBT = 0.08  # chosen: share of the rest's mean square that a line must exceed to count by half
_KNOWN = 0.5  # chosen: so much of `_FOLLOWING` and `_DOUBT` where the frequency is known
_SMALLEST_SQUARE = 1e-18  # m^2: of 1 nm, keeps 0 / 0 away
_SAME_SPEED = 0.1  # chosen: a larger jump of the crankshaft's frequency leaves no line where it was
_LARGEST_DEVIATION = 2.5e-5  # m, chosen: a larger one, beyond twice the lines, is an impact
_AVERAGING_TIME = 0.04  # s, chosen: of the lines' velocity and acceleration
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
    lead_samples: float
    sample_time: float


STATE = record_type(
    [
        (name, 'f8')
        for name in (
            *('first_z1', 'first_z2', 'second_z1', 'second_z2', 'spacing', 'fastest', 'amplitude'),
            *('velocity', 'acceleration', 'deviation', 'deviation_square', 'noise_square'),
        )
    ]
    + [('samples', 'i8')]
)
"""Memory of both high-passes (m), distance of the lines and frequency of the fastest (turns per sample);
amplitudes of all lines together (m, m/s, m/s^2); what is left beside the lines (m), its mean square and that
of white noise in it (m^2); samples since the search."""


def design(lead_time: float, sample_time: float) -> EngineLine:
    """Return the constants of lines that are predicted `lead_time` s ahead; Butterworth, prewarped."""
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
        averaging=sample_time / _AVERAGING_TIME,
        noise_averaging=sample_time / _NOISE_TIME,
        following=_FOLLOWING * sample_time,
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
    state.fastest = line.first
    state.spacing = 0.5 * line.first


@compiled
def step(line, factors, state, window, displacement, crank_frequency):
    """Take one sample (m) and the frequency of the crankshaft (Hz, 0.0: unknown); return all lines together.

    These are their displacement (m) now and, when a force acts, displacement (m), velocity (m/s) and the
    velocity that is low. Of a line (lowest frequency / its frequency)^2 counts as low; the displacement
    ahead is without that part.
    """
    once, state.first_z1, state.first_z2 = _high_pass(line, state.first_z1, state.first_z2, displacement)
    seen, state.second_z1, state.second_z2 = _high_pass(line, state.second_z1, state.second_z2, once)
    bank, phasors = window[: 2 * RESONATORS], window[2 * RESONATORS :]
    _shake(factors, bank, (2.0 * line.sample_time / _MEMORY) * seen)
    state.samples += 1
    share = 1.0
    if crank_frequency > 0.0:
        share = _KNOWN
        _set_spacing(state, phasors, 0.5 * crank_frequency * line.sample_time)
    elif state.samples >= _SEARCH:
        state.samples = 0
        _search(line, state, bank, phasors)
    return _follow(line, state, phasors, share, seen)


@compiled
def _set_spacing(state, phasors, turns):
    """Set the distance of the lines; forget them where it jumps."""
    if abs(turns - state.spacing) > _SAME_SPEED * turns:
        phasors[:] = 0.0
    state.spacing = turns


@compiled
def _follow(line, state, phasors, share, seen):
    """Turn the lines by one sample, sum them, see `step`, and correct them by what was `seen` (m).

    A line counts by its power over that power and doubt; `share` is that of the gain and of the doubt.
    """
    now, ahead, velocity, low_velocity, expected, square = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
    of_displacement, of_velocity, of_acceleration, largest = 0.0, 0.0, 0.0, 0.0
    doubt = share * _DOUBT * state.deviation_square + _SMALLEST_SQUARE
    sine, cosine = sine_and_cosine(state.spacing)
    lead_sine, lead_cosine = sine_and_cosine(line.lead_samples * state.spacing)
    turn_real, turn_imaginary, lead_real, lead_imaginary = 1.0, 0.0, 1.0, 0.0
    for k in range(LINES):
        turn_real, turn_imaginary = _turned(turn_real, turn_imaginary, cosine, sine)
        lead_real, lead_imaginary = _turned(lead_real, lead_imaginary, lead_cosine, lead_sine)
        turns = (k + 1) * state.spacing
        if line.lowest <= turns <= line.highest:
            real, imaginary = _turned(phasors[k], phasors[LINES + k], turn_real, turn_imaginary)
            phasors[k], phasors[LINES + k] = real, imaginary
            power = real * real + imaginary * imaginary
            expected += real
            square += power
            clear = power / (power + doubt)
            real, imaginary = _unfiltered(line, clear * real, clear * imaginary, turn_real, turn_imaginary)
            rate = 2.0 * math.pi * turns / line.sample_time
            displacement_square = real * real + imaginary * imaginary
            velocity_square = rate * rate * displacement_square
            of_displacement += displacement_square
            of_velocity += velocity_square
            of_acceleration += rate * rate * velocity_square
            if velocity_square > largest:
                largest, state.fastest = velocity_square, turns
            real_ahead, imaginary_ahead = _turned(real, imaginary, lead_real, lead_imaginary)
            low = line.lowest / turns * (line.lowest / turns)
            now += real
            ahead += (1.0 - low) * real_ahead
            velocity -= rate * imaginary_ahead
            low_velocity -= low * rate * imaginary_ahead
        else:
            phasors[k] = phasors[LINES + k] = 0.0
    limit = 2.0 * math.sqrt(square) + _LARGEST_DEVIATION
    deviation = min(max(seen - expected, -limit), limit)
    for place in range(LINES):
        phasors[place] += share * line.following * deviation
    change = deviation - state.deviation
    state.deviation = deviation
    state.deviation_square += line.noise_averaging * (deviation * deviation - state.deviation_square)
    state.noise_square += line.noise_averaging * (0.5 * change * change - state.noise_square)
    state.amplitude = math.sqrt(of_displacement)
    state.velocity += line.averaging * (math.sqrt(of_velocity) - state.velocity)
    state.acceleration += line.averaging * (math.sqrt(of_acceleration) - state.acceleration)
    return now, ahead, velocity, low_velocity


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
def _search(line, state, bank, phasors):
    """Move the fastest line to the fastest resonator: at once where this is elsewhere and clearly faster.

    The squared amplitude of a resonator that is off a line by w is inverse to 1 + (w times its memory)^2, so
    a parabola through three inverse squares has its vertex at the line.
    """
    here = min(max(int(2.0 * state.spacing / line.sample_time - LOWEST_FREQUENCY + 0.5), 1), RESONATORS - 2)
    best, near, share = here, here, _GRADUALLY
    for k in range(1, RESONATORS - 1):
        speed = _speed_square(bank, k)
        if speed > _speed_square(bank, best):
            best = k
        if abs(k - here) <= _ELSEWHERE and speed > _speed_square(bank, near):
            near = k
    if abs(best - here) > _ELSEWHERE and _speed_square(bank, best) > _STRONGER * _speed_square(bank, near):
        near, share = best, 1.0
        phasors[:] = 0.0
    below, above = _inverse_square(bank, near - 1), _inverse_square(bank, near + 1)
    curvature = below + above - 2.0 * _inverse_square(bank, near)
    offset = min(max(0.5 * (below - above) / curvature, -1.0), 1.0) if curvature > 0.0 else 0.0
    turns = 0.5 * (LOWEST_FREQUENCY + near + offset) * line.sample_time
    state.spacing += share * (turns - state.spacing)


@compiled
def _inverse_square(bank, k):
    """Return the inverse square of a resonator's amplitude, in 1/m^2."""
    return 1.0 / (bank[k] * bank[k] + bank[RESONATORS + k] * bank[RESONATORS + k] + _SMALLEST_SQUARE)


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
