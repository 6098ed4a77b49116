"""Find the current at which a measured incremental inductance falls through 20 mH (section 3.2, i_20)."""

import math
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from mount_models.arithmetic.compiled import compiled
from mount_models.arithmetic.sums import combination_std, least_squares
from mount_models.arrays import FloatArray


class CrossingError(ValueError):
    """The measured inductance shows no clear crossing; the text says what it shows and the remedy."""


class Crossing(NamedTuple):
    """Where the inductance falls through the level: current and its std (A), slope (H/A), samples used."""

    current: float
    current_std: float
    inductance_slope: float
    samples: int


def find_crossing(
    current: npt.ArrayLike,
    inductance: npt.ArrayLike,
    level: float = 20e-3,
    half_width: float = 0.1,
) -> Crossing:
    """Return where `inductance` (H) over `current` (A), both of shape (N,), falls through `level` (H).

    A parabola through the samples within `half_width` (A) of the crossing, fitted robustly: a straight line
    would be off by 1 mA there, as the curve bends. Samples that are not finite are left out; order is free.
    Raises `CrossingError` if the samples do not fall from above to below `level`, or are too few around it.
    """
    currents, inductances = np.asarray(current, float), np.asarray(inductance, float)
    finite = np.isfinite(currents) & np.isfinite(inductances)
    order = np.argsort(currents[finite], kind='stable')
    currents, inductances = currents[finite][order], inductances[finite][order]
    centre = _coarse_crossing(currents, inductances, level)
    for _ in range(8):
        near = np.abs(currents - centre) <= half_width
        crossing = _local_crossing(currents[near], inductances[near], centre, half_width, level)
        if abs(crossing.current - centre) < 1e-3 * half_width:
            break
        centre = crossing.current
    return crossing


_FEWEST_SAMPLES = 7
_TURNS_OF_WEIGHTING = 20
_BISQUARE = 4.685  # in standard deviations: 95 % efficient for normal noise
_MAD_TO_STD = 1.4826


def _coarse_crossing(currents: FloatArray, inductances: FloatArray, level: float) -> float:
    """Return the current that best parts samples above `level` from those below; outliers barely count."""
    above = inductances > level
    below_before = np.concatenate([[0], np.cumsum(~above)])
    above_after = np.concatenate([np.cumsum(above[::-1])[::-1], [0]])
    misplaced = below_before + above_after
    part = int(np.argmin(misplaced))
    if currents.size < _FEWEST_SAMPLES or part in (0, currents.size) or misplaced[part] > 0.2 * currents.size:
        raise CrossingError(_no_crossing_sentence(currents, inductances, level))
    return 0.5 * float(currents[part - 1] + currents[part])


def _no_crossing_sentence(currents: FloatArray, inductances: FloatArray, level: float) -> str:
    what = f'coil inductance must fall through {level * 1e3:.1f} mH; instead '
    if currents.size < _FEWEST_SAMPLES:
        return what + f'only {currents.size} valid samples were received: is the coil ripple measured?'
    low, high = np.percentile(inductances, [2, 98]) * 1e3
    return what + (
        f'it lay within {low:.1f} .. {high:.1f} mH at {currents[0]:.2f} .. {currents[-1]:.2f} A: '
        f'let the current ramp reach further, or check the ripple signals'
    )


def _local_crossing(
    currents: FloatArray, inductances: FloatArray, centre: float, half_width: float, level: float
) -> Crossing:
    different = np.unique(currents).size
    if different < _FEWEST_SAMPLES:
        raise CrossingError(
            f'different currents within {half_width:.3f} A of the crossing at {centre:.3f} A ({different}) '
            f'must be at least {_FEWEST_SAMPLES}; ramp the current more slowly'
        )
    z = (currents - centre) / half_width
    coefficients, triangle, noise = _robust_parabola(z, inductances)
    at = _root_near_zero(coefficients, level)
    slope = coefficients[1] + 2.0 * coefficients[2] * at
    if not (abs(at) <= 1.0 and slope < 0.0 and z[0] <= at <= z[-1]):
        raise CrossingError(
            f'coil inductance must fall clearly through {level * 1e3:.1f} mH; around {centre:.3f} A it does '
            f'not: ramp the current more slowly or further, or check the ripple signals'
        )
    std = noise * combination_std(triangle, np.array([1.0, at, at * at])) / abs(float(slope))
    return Crossing(centre + at * half_width, std * half_width, float(slope / half_width), int(currents.size))


def _robust_parabola(z: FloatArray, values: FloatArray) -> tuple[FloatArray, FloatArray, float]:
    """Return coefficients, triangle of `least_squares` and noise (std) of a fit that outliers cannot pull."""
    weights = np.ones(z.size)
    # the first turns weigh by 1/|error|, which leads to the median curve: a safe place to judge outliers from
    for turn in range(_TURNS_OF_WEIGHTING):
        (c0, c1, c2), _ = _parabola(z, values, weights)
        error = np.abs(values - (c0 + z * (c1 + z * c2)))
        noise = _MAD_TO_STD * float(np.median(error)) * math.sqrt(z.size / (z.size - 3))
        noise = max(noise, 1e-12 * float(np.abs(values).max()))
        if turn < _TURNS_OF_WEIGHTING // 2:
            weights = noise / np.maximum(error, 0.1 * noise)
        else:
            far = error / (_BISQUARE * noise)
            near = np.clip(1.0 - far * far, 0.0, 1.0)
            weights = near * near
    return np.array([c0, c1, c2]), _parabola(z, values, weights)[1], noise


@compiled
def _parabola(z, values, weights):
    """Return coefficients, lowest first, and triangle of the parabola through weighted values, all (n,)."""
    powers, weighted = np.empty((z.size, 3)), np.empty(z.size)
    for k in range(z.size):
        root = math.sqrt(weights[k])
        powers[k, 0], powers[k, 1], powers[k, 2] = root, root * z[k], root * z[k] * z[k]
        weighted[k] = root * values[k]
    return least_squares(powers, weighted)


def _root_near_zero(coefficients: FloatArray, level: float) -> float:
    """Return the root of the parabola minus `level` that lies nearest to 0; NaN where it has none."""
    c0, c1, c2 = coefficients[0] - level, coefficients[1], coefficients[2]
    under = c1 * c1 - 4.0 * c2 * c0
    if under < 0.0:
        return float('nan')
    return float(-2.0 * c0 / (c1 + np.copysign(np.sqrt(under), c1)))
