"""The engine's lines: what ignition leaves in the displacement, from 18 to 216 Hz.

A running engine shakes itself at multiples of half the frequency of its crankshaft. Where that frequency is
not known, a bank of resonators shows the fastest line, and half its frequency takes the place, as with four
cylinders. Oscillators at the first twelve multiples follow the lines in the high-passed displacement. Each
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
RESONATORS = 100
_APART = 2.0  # Hz, chosen: from one resonator to the next
LINES = 12  # orders 0.5 to 6 of the crankshaft
_STAGES = 4  # of the high-pass, chosen
_PHASORS = 2 * RESONATORS
_HIGH_PASS = _PHASORS + 2 * LINES
WINDOW = _HIGH_PASS + _STAGES
"""Numbers of memory (m): phasors of the resonators, from `_PHASORS` on those of the lines, real parts, then
imaginary parts; from `_HIGH_PASS` on what has passed each stage of the high-pass."""
_FIRST_FREQUENCY = 27.0  # Hz, chosen: an idling engine
_CORNER = 24.0  # Hz, chosen: of each stage; engine and wheel shake at 6 to 13 Hz
_MEMORY = 0.2  # s, chosen: time constant of the resonators
_SEARCH = 16  # samples, chosen: from one search in the bank to the next
_STRONGER = 4.0  # chosen: ratio of squared velocities at which the fastest line moves to another frequency
_GRADUALLY = 0.15  # chosen: share of the way to a resonator next to the line's in a search
_FOLLOWING = 6.5
"""1/s: share of the deviation from the expected sample that a line takes up in a time (chosen)."""
_DOUBT = 0.08  # chosen: share of the rest's mean square that a line must exceed to count by half
_KNOWN = 0.5  # chosen: so much of `_FOLLOWING` and `_DOUBT` where the frequency is known
_SMALLEST_SQUARE = 1e-18  # m^2: of 1 nm, keeps 0 / 0 away
_SAME_SPEED = 0.1  # chosen: a larger jump of the crankshaft's frequency leaves no line where it was
_LARGEST_DEVIATION = 2.5e-5  # m, chosen: a larger one is an impact
_NOISE_TIME = 0.55  # s, chosen: longer than an impact


class EngineLine(NamedTuple):
    """Gain and pole of a stage of the high-pass, frequencies in turns per sample, and gains."""

    gain: float
    pole: float
    lowest: float
    highest: float
    first: float
    noise_averaging: float
    following: float
    lead_samples: float
    sample_time: float


STATE = record_type(
    [
        (name, 'f8')
        for name in (
            *('displacement', 'spacing', 'fastest', 'amplitude', 'velocity', 'shaking'),
            *('deviation', 'deviation_square', 'noise_square'),
        )
    ]
    + [('samples', 'i8')]
)
"""Last displacement (m), distance of the lines and frequency of the fastest (turns per sample); amplitudes of
all lines together: displacement (m), velocity (m/s), and what shakes the chassis, displacement times w^2.5
(m/s^2.5); what is left beside the lines (m), its mean square and that of white noise in it (m^2); samples
since the search."""


def design(lead_time: float, sample_time: float) -> EngineLine:
    """Return the constants of lines that are predicted `lead_time` s ahead; stages bilinear, prewarped."""
    sine, cosine = sine_and_cosine(0.5 * _CORNER * sample_time)
    gain = cosine / (cosine + sine)
    return EngineLine(
        gain=gain,
        pole=2.0 * gain - 1.0,
        lowest=LOWEST_FREQUENCY * sample_time,
        highest=(LOWEST_FREQUENCY + _APART * (RESONATORS - 1)) * sample_time,
        first=_FIRST_FREQUENCY * sample_time,
        noise_averaging=sample_time / _NOISE_TIME,
        following=_FOLLOWING * sample_time,
        lead_samples=lead_time / sample_time,
        sample_time=sample_time,
    )


def rotations(sample_time: float) -> NDArray[np.float64]:
    """Return the factors of the resonators in a sample, real parts then imaginary parts."""
    kept = 1.0 - sample_time / _MEMORY
    frequencies = [LOWEST_FREQUENCY + _APART * place for place in range(RESONATORS)]
    sines = [sine_and_cosine(frequency * sample_time) for frequency in frequencies]
    return kept * np.array([*(cosine for _, cosine in sines), *(sine for sine, _ in sines)])


@compiled
def rest(line, state, displacement):
    """Set a state of zeros to that of a mount which has always been at `displacement` (m), no line in it."""
    state.displacement = displacement
    state.fastest = line.first
    state.spacing = 0.25 * line.first


@compiled
def step(line, factors, state, window, displacement, crank_frequency):
    """Take one sample (m) and the frequency of the crankshaft (Hz, 0.0: unknown); return all lines together.

    These are their displacement (m) now and, when a force acts, displacement (m) of their high part, velocity
    (m/s) of the low and of the high part. Of a line (lowest frequency / its frequency)^2 counts as low.
    """
    bank, phasors = window[:_PHASORS], window[_PHASORS:_HIGH_PASS]
    high = _high_passed(line, window[_HIGH_PASS:], displacement - state.displacement)
    state.displacement = displacement
    _shake(factors, bank, (2.0 * line.sample_time / _MEMORY) * high)
    state.samples += 1
    share = 1.0
    if crank_frequency > 0.0:
        share = _KNOWN
        _set_spacing(state, phasors, 0.5 * crank_frequency * line.sample_time)
    elif state.samples >= _SEARCH:
        state.samples = 0
        _search(line, state, bank, phasors)
    return _follow(line, state, phasors, share, high)


@compiled
def _high_passed(line, stages, change):
    """Return what passes all stages (m) of a displacement that has changed by `change` (m)."""
    for k in range(_STAGES):
        before = stages[k]
        stages[k] = line.pole * before + line.gain * change
        change = stages[k] - before
    return stages[_STAGES - 1]


@compiled
def _set_spacing(state, phasors, turns):
    """Set the distance of the lines; forget them where it jumps."""
    if abs(turns - state.spacing) > _SAME_SPEED * turns:
        phasors[:] = 0.0
    state.spacing = turns


@compiled
def _follow(line, state, phasors, share, high):
    """Turn the lines by one sample, sum them, see `step`, and correct them by the sample's `high` part (m).

    A line counts by its power over that power and doubt; `share` is that of the gain and of the doubt.
    """
    now, ahead, low_velocity, high_velocity, expected = 0.0, 0.0, 0.0, 0.0, 0.0
    of_displacement, of_velocity, of_shaking, largest = 0.0, 0.0, 0.0, 0.0
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
            expected += real
            power = real * real + imaginary * imaginary
            clear = power / (power + doubt)
            real, imaginary = _unfiltered(line, clear * real, clear * imaginary, turn_real, turn_imaginary)
            rate = 2.0 * math.pi * turns / line.sample_time
            square = real * real + imaginary * imaginary
            velocity_square = rate * rate * square
            of_displacement += square
            of_velocity += velocity_square
            of_shaking += rate * rate * rate * velocity_square
            if velocity_square > largest:
                largest, state.fastest = velocity_square, turns
            now += real
            real, imaginary = _turned(real, imaginary, lead_real, lead_imaginary)
            low = line.lowest / turns * (line.lowest / turns)
            ahead += (1.0 - low) * real
            low_velocity -= low * rate * imaginary
            high_velocity -= (1.0 - low) * rate * imaginary
        else:
            phasors[k] = phasors[LINES + k] = 0.0
    deviation = min(max(high - expected, -_LARGEST_DEVIATION), _LARGEST_DEVIATION)
    for place in range(LINES):
        phasors[place] += share * line.following * deviation
    change = deviation - state.deviation
    state.deviation = deviation
    state.deviation_square += line.noise_averaging * (deviation * deviation - state.deviation_square)
    state.noise_square += line.noise_averaging * (0.5 * change * change - state.noise_square)
    state.amplitude = math.sqrt(of_displacement)
    state.velocity = math.sqrt(of_velocity)
    state.shaking = math.sqrt(of_shaking)
    return now, ahead, low_velocity, high_velocity


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
    place = (4.0 * state.spacing / line.sample_time - LOWEST_FREQUENCY) / _APART
    here = min(max(int(place + 0.5), 1), RESONATORS - 2)
    best, near, share = here, here, _GRADUALLY
    for k in range(1, RESONATORS - 1):
        speed = _speed_square(bank, k)
        if speed > _speed_square(bank, best):
            best = k
        if abs(k - here) <= 1 and speed > _speed_square(bank, near):
            near = k
    if abs(best - here) > 1 and _speed_square(bank, best) > _STRONGER * _speed_square(bank, near):
        near, share = best, 1.0
        phasors[:] = 0.0
    below, above = _inverse_square(bank, near - 1), _inverse_square(bank, near + 1)
    curvature = below + above - 2.0 * _inverse_square(bank, near)
    offset = min(max(0.5 * (below - above) / curvature, -1.0), 1.0) if curvature > 0.0 else 0.0
    turns = 0.25 * (LOWEST_FREQUENCY + _APART * (near + offset)) * line.sample_time
    state.spacing += share * (turns - state.spacing)


@compiled
def _inverse_square(bank, k):
    """Return the inverse square of a resonator's amplitude, in 1/m^2."""
    return 1.0 / (bank[k] * bank[k] + bank[RESONATORS + k] * bank[RESONATORS + k] + _SMALLEST_SQUARE)


@compiled
def _speed_square(bank, k):
    """Return the square of a resonator's velocity, in m^2 Hz^2."""
    frequency = LOWEST_FREQUENCY + _APART * k
    return frequency * frequency / _inverse_square(bank, k)


@compiled
def _turned(real, imaginary, cosine, sine):
    return real * cosine - imaginary * sine, real * sine + imaginary * cosine


@compiled
def _unfiltered(line, real, imaginary, cosine, sine):
    """Return the phasor before the high-pass, at z = cosine + j sine.

    The inverse of a stage is (z - pole) / (gain (z - 1)) = 1 + j back, that of two stages its square.
    """
    back = (line.pole - 1.0) / (line.pole + 1.0) * sine / (1.0 - cosine)
    for _ in range(_STAGES // 2):
        real, imaginary = _turned(real, imaginary, 1.0 - back * back, 2.0 * back)
    return real, imaginary
