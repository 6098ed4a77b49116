"""What a drive asks of the coil: current, heat, time at the limit."""

import math
from dataclasses import dataclass

import numpy as np

from engine_mount.reports.drawing.chart import Array

_AT_LIMIT = 0.999  # chosen: this share of the limit counts as at the limit


@dataclass(frozen=True)
class CoilLoad:
    """Rms and highest current (A), mean heat R i^2 (W) and its sum (J), share of time at the limit."""

    rms_current: float
    peak_current: float
    mean_heat: float
    energy: float
    share_at_limit: float
    duration: float  # s


def coil_load(time: Array, current: Array, resistance: float, limit: float | None) -> CoilLoad:
    """Return the load of a coil of `resistance` (ohm) by `current` (A) at `time` (s).

    Each sample holds until the next; unknown ones do not count, and `duration` is the time of the others. NaN
    where nothing is known, and for the share where no `limit` (A) is given.
    """
    held = np.diff(time, append=time[-1:])
    if len(time) > 1:
        held[-1] = np.median(held[:-1])
    known = np.isfinite(current)
    duration = float(held[known].sum())
    if duration <= 0.0:
        return CoilLoad(*(math.nan,) * 5, 0.0)
    flowing, held = current[known], held[known]
    mean_square = float(np.sum(flowing**2 * held)) / duration
    at_limit = math.nan
    if limit is not None:
        at_limit = float(np.sum(held[flowing >= _AT_LIMIT * limit])) / duration
    return CoilLoad(
        rms_current=math.sqrt(mean_square),
        peak_current=float(np.max(np.abs(flowing))),
        mean_heat=resistance * mean_square,
        energy=resistance * mean_square * duration,
        share_at_limit=at_limit,
        duration=duration,
    )
