"""At which currents, and at which inductances, ripple tells the air gap without ambiguity: from the data.

In between, the same inductance belongs to two gaps (section 3.2). A current is called unique where the
inductance rises or falls with the gap over the whole range, beyond doubt of the scatter.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from engine_mount.identification.coil.few_points import MOST_POINTS, InductanceTable
from engine_mount.identification.coil.gap_point import RippleRecording

FloatArray = npt.NDArray[np.float64]
Interval = tuple[float, float]


@dataclass(frozen=True)
class UniqueRegion:
    """Currents (A) at which L_i(gap) falls or rises throughout, inductances (H) whose current tells the gap.

    `inductance` (H, shape (G, C)) is the map behind it, over `gaps` (m) and `currents` (A); NaN where empty.
    """

    falling: tuple[Interval, ...]
    rising: tuple[Interval, ...]
    levels: tuple[Interval, ...]
    gaps: FloatArray
    currents: FloatArray
    inductance: FloatArray


def unique_region(recordings: Sequence[RippleRecording]) -> UniqueRegion:
    """Return where ripple at one temperature is unique; of less than 4 gaps nothing is."""
    recordings = sorted(recordings, key=lambda recording: recording.gap)
    gaps = np.array([recording.gap for recording in recordings])
    width = max(float(np.nanmax(recording.current)) for recording in recordings) / _BINS
    edges = np.asarray(np.arange(_BINS + 1) * width, np.float64)
    currents = 0.5 * (edges[1:] + edges[:-1])
    mean, std = (np.full((gaps.size, _BINS), np.nan) for _ in range(2))
    for row, recording in enumerate(recordings):
        mean[row], std[row] = _binned(recording, edges)
    signs = np.array([_direction(gaps, mean[:, k], std[:, k]) for k in range(_BINS)])
    return UniqueRegion(
        falling=_intervals(signs < 0, edges),
        rising=_intervals(signs > 0, edges),
        levels=_unique_levels(gaps, currents, mean, std),
        gaps=gaps,
        currents=currents,
        inductance=mean,
    )


def warnings(region: UniqueRegion, rest_current: float, crossing_inductance: float) -> list[str]:
    """Return sentences where the chosen rest current (A) or crossing inductance (H) is ambiguous."""
    found = []
    if not _inside(region.falling + region.rising, rest_current):
        found.append(
            f'rest_current ({rest_current:.2f} A) must lie where the inductance tells the gap without '
            f'ambiguity: {_told(region.falling + region.rising, 1.0, "A")}; choose a current from there'
        )
    if not _inside(region.levels, crossing_inductance):
        found.append(
            f'crossing_inductance ({crossing_inductance * 1e3:.1f} mH) must be one whose current tells the '
            f'gap without ambiguity: {_told(region.levels, 1e3, "mH")}; choose an inductance from there'
        )
    return found


_BINS = 60  # chosen: 0.05 A each up to 3 A
_FEWEST_IN_BIN = 3
_FEWEST_GAPS = 4
_BEYOND_DOUBT = 2.0  # standard deviations, chosen
_LEVELS = 100
_LEAST_LENGTH = 2  # bins, chosen: a single one may be chance


def _binned(recording: RippleRecording, edges: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return for each bin the inductance at its middle, by a line, and its standard deviation."""
    mean, std = np.full(edges.size - 1, np.nan), np.full(edges.size - 1, np.nan)
    finite = np.isfinite(recording.current) & np.isfinite(recording.inductance)
    current, inductance = recording.current[finite], recording.inductance[finite]
    if current.size <= MOST_POINTS:
        return _interpolated(InductanceTable(current, inductance), 0.5 * (edges[1:] + edges[:-1]))
    places = np.digitize(current, edges) - 1
    for place in range(edges.size - 1):
        inside = places == place
        count = int(inside.sum())
        if count < _FEWEST_IN_BIN:
            continue
        offset = current[inside] - 0.5 * (edges[place] + edges[place + 1])
        values = inductance[inside]
        straight = np.ptp(offset) > 0.2 * (edges[1] - edges[0]) and count > _FEWEST_IN_BIN
        powers = np.stack([np.ones(count), offset], axis=1)[:, : 1 + straight]
        solution, *_ = np.linalg.lstsq(powers, values, rcond=None)
        scatter = np.sum((values - powers @ solution) ** 2) / (count - powers.shape[1])
        mean[place] = solution[0]
        std[place] = np.sqrt(scatter * np.linalg.inv(powers.T @ powers)[0, 0])
    return mean, std


def _interpolated(table: InductanceTable, currents: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return inductance and deviation of a table of few points at `currents` (A); NaN beyond its points."""
    values = np.full((2, currents.size), np.nan)
    for place in np.flatnonzero((currents >= table.current[0]) & (currents <= table.current[-1])):
        values[:, place] = table.at(float(currents[place]))
    return values[0], values[1]


def _direction(gaps: FloatArray, values: FloatArray, stds: FloatArray) -> int:
    """Return 1 or -1 where the values rise or fall with the gap throughout, beyond doubt; else 0."""
    known = np.isfinite(values)
    if known.sum() < _FEWEST_GAPS or known.sum() < 0.8 * gaps.size:
        return 0
    x, y = gaps[known], values[known]
    s = np.maximum(stds[known], 1e-6 * np.abs(y))
    centre, scale = 0.5 * (x[0] + x[-1]), 0.5 * (x[-1] - x[0])
    degree = min(3, x.size - 2)
    powers = np.polynomial.polynomial.polyvander((x - centre) / scale, degree) / s[:, np.newaxis]
    covariance = np.linalg.pinv(powers.T @ powers)
    coefficients = covariance @ powers.T @ (y / s)
    misfit = np.sum((powers @ coefficients - y / s) ** 2) / max(1, x.size - degree - 1)
    z = np.linspace(-1.0, 1.0, 41)
    derived = np.stack([k * z ** max(k - 1, 0) for k in range(degree + 1)], axis=1)
    slopes = derived @ coefficients
    doubt = _BEYOND_DOUBT * np.sqrt(max(1.0, misfit) * np.einsum('ij,jk,ik->i', derived, covariance, derived))
    if np.all(slopes > doubt):
        return 1
    return -1 if np.all(slopes < -doubt) else 0


def _unique_levels(
    gaps: FloatArray, currents: FloatArray, mean: FloatArray, std: FloatArray
) -> tuple[Interval, ...]:
    top = float(np.nanmin(np.nanmax(mean, axis=1)))
    levels = np.linspace(0.0, top, _LEVELS + 1)[1:]
    unique = []
    for level in levels:
        crossings = [
            _crossing(currents, row, spread, float(level)) for row, spread in zip(mean, std, strict=True)
        ]
        at, doubt = (np.array(column) for column in zip(*crossings, strict=True))
        unique.append(_direction(gaps, at, doubt) > 0)
    step = levels[1] - levels[0]
    return _intervals(np.array(unique), np.append(levels - 0.5 * step, levels[-1] + 0.5 * step))


def _crossing(
    currents: FloatArray, inductance: FloatArray, std: FloatArray, level: float
) -> tuple[float, float]:
    """Return the current (A) at which the curve falls through `level` (H), once and for all, and its std."""
    known = np.isfinite(inductance)
    i, values, s = currents[known], inductance[known], std[known]
    below = np.flatnonzero(values < level)
    if not below.size or below[0] == 0:
        return np.nan, np.nan
    k = int(below[0])
    if np.any(values[k:] > level + 3.0 * s[k:]):
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


def _told(intervals: Sequence[Interval], factor: float, unit: str) -> str:
    if not intervals:
        return 'nowhere in these recordings'
    return ', '.join(f'{low * factor:.2f} .. {high * factor:.2f} {unit}' for low, high in sorted(intervals))
