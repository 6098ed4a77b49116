"""What the wheel runs over, as heights over time: random road, gap in the road, sinusoidal sweep.

Times in, heights out, both in SI units; a positive height lifts the wheel. The height at one time does not
depend on the other times of the array.
"""

import math
from collections.abc import Iterator
from functools import lru_cache
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from mount_models.arithmetic.compiled import compiled
from mount_models.arithmetic.elementary import cosines, exp, log, sine_and_cosine, sines
from mount_models.arrays import FloatArray
from mount_sim.excitation.scenario import SweepScenario
from mount_sim.random_numbers import RandomNumbers

REFERENCE_FREQUENCY = 0.1
"""n0 of ISO 8608 in cycles/m."""


class RandomRoad(NamedTuple):
    """Stationary random road with the density G_d(n) = G_d(n0) (n / n0)^-waviness of ISO 8608."""

    roughness: float = 2e-6
    """G_d(n0): density at 0.1 cycles/m, m^3; a good motorway, classes A to D have 16e-6 to 1024e-6"""
    waviness: float = 2.0
    """Fall of the density with frequency, ISO 8608."""
    lowest_frequency: float = 0.01
    """Longest wave, cycles/m; 0.33 Hz at 33 m/s."""
    highest_frequency: float = 3.0
    """Shortest wave, cycles/m; 99 Hz at 33 m/s."""
    speed: float = 33.0
    """Of the vehicle, m/s."""
    ramp_in: float = 1.0
    """The height grows linearly from zero for so long, s."""
    seed: int = 1
    """Another seed is another road of the same kind."""


class Gap(NamedTuple):
    """One half sine down into the road: a gap as the wheel feels it, after the tyre has rounded it."""

    depth: float  # m
    position: float  # m, where it begins
    length: float = 1.0  # m
    speed: float = 33.0  # m/s, of the car


def random_road(times: npt.ArrayLike, road: RandomRoad) -> FloatArray:
    """Return heights (n,) in m at `times` (n,) in s: a sum of waves with random phases.

    Taken with its slope at points of a fixed grid along the road, 16 to the shortest wave, and joined by
    cubic pieces, which leaves 1e-4 of that wave's amplitude.
    """
    seconds = np.asarray(times, dtype=np.float64)
    places = road.speed * seconds / _spacing(road)
    first = math.floor(places.min()) // _BLOCK
    last = (math.floor(places.max()) + 1) // _BLOCK
    blocks = [_block_of_grid(road, block) for block in range(first, last + 1)]
    curve = _cubic(np.concatenate(blocks, axis=1), places, first * _BLOCK)
    return np.asarray(curve * _ramp(seconds, road.ramp_in), dtype=np.float64)


def gap_in_road(times: npt.ArrayLike, gap: Gap) -> FloatArray:
    """Return heights (n,) in m at `times` (n,) in s, negative in the gap, else 0."""
    along = (gap.speed * np.asarray(times, dtype=np.float64) - gap.position) / gap.length
    inside = (along > 0.0) & (along < 1.0)
    height = np.zeros_like(along)
    height[inside] = -gap.depth * sines(0.5 * along[inside])
    return height


def sweep_road(times: npt.ArrayLike, sweep: SweepScenario) -> FloatArray:
    """Return heights (n,) in m at `times` (n,) in s: -(V0 / 2 pi f) cos(phase)."""
    seconds = np.asarray(times, dtype=np.float64)
    frequency = sweep.first_frequency + sweep.rate * seconds
    turns = (sweep.first_frequency + 0.5 * sweep.rate * seconds) * seconds
    height = -sweep.velocity_amplitude / (2.0 * np.pi * frequency) * cosines(turns)
    return np.asarray(height * _ramp(seconds, sweep.ramp_in), dtype=np.float64)


_POINTS_PER_WAVE = 16
_WIDEST_CELL = 0.004  # cycles/m, 0.13 Hz at 33 m/s: finer than the analyses that look at it
_WIDEST_CELL_RATIO = 1.05
_BLOCK = 256  # points of the grid


class _Waves(NamedTuple):
    """One wave (n,) for each cell of the band, and how far it turns from the first point of a block on."""

    turns_per_step: FloatArray
    amplitudes: FloatArray  # m
    phases: FloatArray  # turns
    sines_on: FloatArray  # (n, points of a block)
    cosines_on: FloatArray


@lru_cache(maxsize=4)
def _waves(road: RandomRoad) -> _Waves:
    edges = np.array(list(_cell_edges(road)))
    random = RandomNumbers(road.seed)
    frequencies = edges[:-1] + np.diff(edges) * random.uniform(edges.size - 1)
    middle = np.sqrt(edges[:-1] * edges[1:])
    fall = np.array([exp(-road.waviness * log(ratio)) for ratio in middle / REFERENCE_FREQUENCY])
    amplitudes = np.sqrt(2.0 * road.roughness * fall * np.diff(edges))
    turns = frequencies * _spacing(road)
    within = np.outer(turns, np.arange(_BLOCK))
    on = (function(within.ravel()).reshape(within.shape) for function in (sines, cosines))
    return _Waves(turns, amplitudes, random.uniform(middle.size), *on)


def _spacing(road: RandomRoad) -> float:
    """Return the distance between points of the grid in m."""
    return 1.0 / (_POINTS_PER_WAVE * road.highest_frequency)


def _cell_edges(road: RandomRoad) -> Iterator[float]:
    edge = road.lowest_frequency
    while edge < road.highest_frequency:
        yield edge
        edge = min(edge * _WIDEST_CELL_RATIO, edge + _WIDEST_CELL)
    yield road.highest_frequency


@lru_cache(maxsize=8)
def _block_of_grid(road: RandomRoad, block: int) -> FloatArray:
    """Return height and slope per step, (2, points), of a block of the grid; the next times need it too."""
    return _sum_of_waves(*_waves(road), block)


@compiled
def _sum_of_waves(turns_per_step, amplitudes, phases, sines_on, cosines_on, block):
    """Return the sum of the waves and its slope per step, (2, points), at the points of a block.

    At each point the waves are added in their order, so that a point is the same in whatever company. A block
    begins where its number says; within it, each wave is turned on by what one table holds for all blocks.
    """
    total = np.zeros((2, _BLOCK))
    heights, slopes = total[0], total[1]
    for wave in range(turns_per_step.size):
        turns, amplitude = turns_per_step[wave], amplitudes[wave]
        sine_on, cosine_on = sines_on[wave], cosines_on[wave]
        sine, cosine = sine_and_cosine(turns * (block * _BLOCK) + phases[wave])
        a, b = amplitude * cosine, amplitude * sine
        angle = 2.0 * math.pi * turns
        for place in range(_BLOCK):
            heights[place] += a * cosine_on[place] - b * sine_on[place]
            slopes[place] -= angle * (a * sine_on[place] + b * cosine_on[place])
    return total


@compiled
def _cubic(points, places, first):
    """Return the cubic Hermite curve at `places`, in steps of the grid; `points` begin at `first`."""
    height, slope = points[0], points[1]
    curve = np.empty(places.size)
    for k in range(places.size):
        node = math.floor(places[k])
        part = places[k] - node
        rest, left, right = 1.0 - part, node - first, node - first + 1
        ends = rest * rest * (1.0 + 2.0 * part) * height[left]
        ends += part * part * (1.0 + 2.0 * rest) * height[right]
        curve[k] = ends + part * rest * (rest * slope[left] - part * slope[right])
    return curve


def _ramp(seconds: FloatArray, ramp_in: float) -> FloatArray:
    if ramp_in == 0.0:
        return np.ones_like(seconds)
    return np.clip(seconds / ramp_in, 0.0, 1.0)
