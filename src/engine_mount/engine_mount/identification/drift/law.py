"""Wear and other drift: a straight line through values measured at several times, and how sure its slope is.

Noise model: each value has the standard deviation that came with it, independent of the others. Where the
values scatter more about the line than that explains, all are taken as that much less sure (Birge ratio);
where they scatter less, the stated ones stand. Without any stated deviation the scatter alone tells.
"""

import math
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

FloatArray = npt.NDArray[np.float64]

FEWEST = 2


class DriftError(ValueError):
    """Values do not tell a drift; the text says what is missing and the remedy."""


@dataclass(frozen=True)
class Drift:
    """value = `level` + `slope` (t - `centre`): centre in h, level in the values' unit, slope per h.

    `*_std` are standard deviations; NaN where two values without stated deviations leave none to tell.
    `ratio` says how many times more the values scatter than stated: 1 or more, NaN for two of them.
    """

    centre: float
    level: float
    slope: float
    level_std: float
    slope_std: float
    ratio: float

    def at(self, hours: npt.ArrayLike) -> FloatArray:
        """Return the line at times in h."""
        return np.asarray(self.level + self.slope * (np.asarray(hours, float) - self.centre))

    def std_at(self, hours: npt.ArrayLike) -> FloatArray:
        """Return the standard deviation of the line at times in h."""
        return np.hypot(self.level_std, self.slope_std * (np.asarray(hours, float) - self.centre))


def fitted_drift(hours: npt.ArrayLike, values: npt.ArrayLike, stds: npt.ArrayLike | None = None) -> Drift:
    """Return the weighted line through `values` (n,) at `hours`; raises `DriftError` where there is none."""
    t, y = np.asarray(hours, float), np.asarray(values, float)
    if t.size < FEWEST:
        raise DriftError(
            f'{t.size} recording tells no drift; at least {FEWEST} from different times are needed'
        )
    if not (np.isfinite(t).all() and np.isfinite(y).all()):
        raise DriftError('a time or value is no number; leave that recording out')
    if np.ptp(t) <= 0.0:
        raise DriftError(f'all {t.size} recordings are from one time; add some from before or after')
    stated = np.ones(t.size) if stds is None else np.asarray(stds, float)
    if not (np.isfinite(stated).all() and (stated > 0.0).all()):
        raise DriftError('each standard deviation must be above 0; leave out the recording without one')
    weights = 1.0 / stated**2
    centre = float((weights * t).sum() / weights.sum())
    level = float((weights * y).sum() / weights.sum())
    spread = float((weights * (t - centre) ** 2).sum())
    slope = float((weights * (t - centre) * y).sum() / spread)
    ratio = math.nan
    if t.size > FEWEST:
        misfit = y - level - slope * (t - centre)
        ratio = math.sqrt(float((weights * misfit**2).sum()) / (t.size - FEWEST))
    factor = ratio
    if stds is not None:
        factor = 1.0 if math.isnan(ratio) else max(1.0, ratio)
        ratio = ratio if math.isnan(ratio) else max(1.0, ratio)
    return Drift(
        centre, level, slope, factor / math.sqrt(weights.sum()), factor / math.sqrt(spread),
        ratio if stds is not None else math.nan,
    )  # fmt: skip
