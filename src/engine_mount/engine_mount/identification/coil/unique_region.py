"""At which currents and inductances ripple determines the air gap without ambiguity: from the data.

In between, the same inductance belongs to two gaps (section 3.2). A current is called unique where the
inductance rises or falls with the gap over the whole range, beyond doubt of the scatter.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
from scipy.stats import linregress

from engine_mount.identification.coil.points import MOST_POINTS, InductanceTable, RippleRecording
from engine_mount.identification.fitting import FloatArray

Interval = tuple[float, float]

_BINS = 60  # chosen: 0.05 A each up to 3 A
_FEWEST_IN_BIN = 3
_FEWEST_GAPS = 4
_BEYOND_DOUBT = 2.0  # standard deviations, chosen
_LEVELS = 100
_LEAST_LENGTH = 2  # bins, chosen: a single one may be chance


@dataclass(frozen=True)
class UniqueRegion:
    """Currents (A) at which L_i(gap) falls or rises throughout, inductances (H) whose current gives the gap.

    `inductance` (H, shape (G, C)) is the map behind it, over `gaps` (m) and `currents` (A); NaN where empty.
    """

    falling: tuple[Interval, ...]
    rising: tuple[Interval, ...]
    levels: tuple[Interval, ...]
    gaps: FloatArray
    currents: FloatArray
    inductance: FloatArray

    def warnings(self, rest_current: float, crossing_inductance: float) -> list[str]:
        """Return sentences where the chosen rest current (A) or crossing inductance (H) is ambiguous."""
        sentences = []
        unique = sorted(self.falling + self.rising)
        if not _inside(unique, rest_current):
            sentences.append(
                f'rest_current ({rest_current:.2f} A) must lie where the inductance determines the gap '
                f'without ambiguity: {interval_text(unique)} A; choose a current from there'
            )
        if not _inside(self.levels, crossing_inductance):
            sentences.append(
                f'crossing_inductance ({crossing_inductance * 1e3:.1f} mH) must be one whose current '
                f'determines the gap without ambiguity: {interval_text(self.levels, 1e3)} mH; choose an '
                'inductance from there'
            )
        return sentences


def unique_region(recordings: Sequence[RippleRecording]) -> UniqueRegion:
    """Return where ripple at one temperature is unique; of less than 4 gaps nothing is."""
    recordings = sorted(recordings, key=lambda recording: recording.gap)
    gaps = np.array([recording.gap for recording in recordings])
    width = max(float(np.nanmax(recording.current)) for recording in recordings) / _BINS
    edges = np.asarray(np.arange(_BINS + 1) * width, np.float64)
    currents = 0.5 * (edges[1:] + edges[:-1])
    mean, std = np.array([_binned(recording, currents, edges) for recording in recordings]).swapaxes(0, 1)
    signs = np.array([_direction(gaps, mean[:, k], std[:, k]) for k in range(_BINS)])
    levels = np.linspace(0.0, float(np.nanmin(np.nanmax(mean, axis=1))), _LEVELS + 1)[1:]
    crossings = [
        np.array([_crossing(currents, *row, level) for row in zip(mean, std, strict=True)]).T
        for level in levels.tolist()
    ]
    unique = np.array([_direction(gaps, *crossing) > 0 for crossing in crossings])
    step = levels[1] - levels[0]
    level_edges = np.append(levels - 0.5 * step, levels[-1] + 0.5 * step)
    return UniqueRegion(
        _intervals(signs < 0, edges),
        _intervals(signs > 0, edges),
        _intervals(unique, level_edges),
        gaps,
        currents,
        mean,
    )


def interval_text(intervals: Sequence[Interval], factor: float = 1.0) -> str:
    """Return intervals as a text, in another unit by `factor`; 'no' without any."""
    return ', '.join(f'{low * factor:.2f} .. {high * factor:.2f}' for low, high in intervals) or 'no'


def _binned(recording: RippleRecording, currents: FloatArray, edges: FloatArray) -> FloatArray:
    """Return for each bin the inductance at its middle, by a line, and its standard deviation; else NaN."""
    current, inductance = recording.finite()
    result = np.full((2, currents.size), np.nan)
    if current.size <= MOST_POINTS:
        table = InductanceTable(recording)
        for k in np.flatnonzero((currents >= table.current[0]) & (currents <= table.current[-1])):
            result[:, k] = table.at(float(currents[k]))
        return result
    bins = np.digitize(current, edges) - 1
    for place, middle in enumerate(currents):
        inside = bins == place
        count = int(inside.sum())
        if count < _FEWEST_IN_BIN:
            continue
        offset, values = current[inside] - middle, inductance[inside]
        if count > _FEWEST_IN_BIN and np.ptp(offset) > 0.2 * (edges[1] - edges[0]):
            line = linregress(offset, values)
            result[:, place] = line.intercept, line.intercept_stderr
        else:
            result[:, place] = values.mean(), values.std(ddof=1) / np.sqrt(count)
    return result


def _direction(gaps: FloatArray, values: FloatArray, stds: FloatArray) -> int:
    """Return 1 or -1 where the values rise or fall with the gap throughout, beyond doubt; else 0."""
    known = np.isfinite(values)
    if known.sum() < _FEWEST_GAPS or known.sum() < 0.8 * gaps.size:
        return 0
    x, y = gaps[known], values[known]
    weights = 1.0 / np.maximum(stds[known], 1e-6 * np.abs(y))
    z = (x - 0.5 * (x[0] + x[-1])) / (0.5 * (x[-1] - x[0]))
    powers = np.arange(min(3, x.size - 2), -1, -1)
    coefficients, covariance = np.polyfit(z, y, powers[0], w=weights, cov='unscaled')
    misfit = np.sum(((np.polyval(coefficients, z) - y) * weights) ** 2) / max(1, x.size - powers.size)
    derived = powers * np.linspace(-1.0, 1.0, 41)[:, np.newaxis] ** np.maximum(powers - 1, 0)
    slopes = derived @ coefficients
    doubt = _BEYOND_DOUBT * np.sqrt(max(1.0, misfit) * np.einsum('ij,jk,ik->i', derived, covariance, derived))
    return int(np.all(slopes > doubt)) - int(np.all(slopes < -doubt))


def _crossing(currents: FloatArray, inductance: FloatArray, std: FloatArray, level: float) -> Interval:
    """Return the current (A) at which the curve falls through `level` (H), once and for all, and its std."""
    known = np.isfinite(inductance)
    i, values, s = currents[known], inductance[known], std[known]
    k = int(np.argmax(values < level))
    if k == 0 or np.any(values[k:] > level + 3.0 * s[k:]):
        return np.nan, np.nan
    fall = (values[k - 1] - values[k]) / (i[k] - i[k - 1])
    return float(i[k - 1] + (values[k - 1] - level) / fall), float(max(s[k - 1], s[k]) / fall)


def _intervals(wanted: npt.NDArray[np.bool_], edges: FloatArray) -> tuple[Interval, ...]:
    padded = np.concatenate([[False], wanted, [False]]).astype(int)
    starts, ends = np.flatnonzero(np.diff(padded) == 1), np.flatnonzero(np.diff(padded) == -1)
    return tuple(
        (float(edges[a]), float(edges[b]))
        for a, b in zip(starts, ends, strict=True)
        if b - a >= _LEAST_LENGTH
    )


def _inside(intervals: Sequence[Interval], value: float) -> bool:
    return any(low <= value <= high for low, high in intervals)
