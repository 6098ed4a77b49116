"""The ladder: every law fitted to the same recordings, judged by recordings that no fit has seen.

The error is rms of the difference over rms of the measured force, both over all samples of all recordings.
The training error shows how well a law can follow, the held-out error what it is worth.
"""

import math
from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np
from scipy.optimize import least_squares

from engine_mount.identification.fitting import FloatArray, Progress, silent, single_threaded
from engine_mount.identification.friction.laws import FrictionLaw
from engine_mount.identification.friction.recording import (
    FrictionRecording,
    smoothed_displacement,
    thinned,
)
from engine_mount.identification.friction.screening import explained

SEARCH_SAMPLES = 1200
"""Samples per recording while starts are compared."""
FINAL_SAMPLES = 5000
STARTS = 5
DRAWS = 12
"""So many points are drawn for each start after the first; the search begins at the best of them."""
_SPREAD = 1.2  # of the logarithm, by which further starts differ from the first


class Rung(NamedTuple):
    """One fitted law, its parameters, and its errors; that of held-out recordings None without any."""

    law: FrictionLaw
    values: FloatArray
    train_error: float
    held_out_error: float | None

    @property
    def error(self) -> float:
        """The error that judges the law: held out, or of the training where nothing was."""
        return self.train_error if self.held_out_error is None else self.held_out_error

    @property
    def parameters(self) -> dict[str, float]:
        """{parameter: value}."""
        return dict(zip((each.name for each in self.law.parameters), self.values.tolist(), strict=True))

    def figures(self) -> dict[str, Any]:
        """Return errors and parameters for JSON."""
        return {
            'train_error': self.train_error,
            'held_out_error': self.held_out_error,
            'explained': explained(self.error),
            'parameters': self.parameters,
            'units': {parameter.name: parameter.unit for parameter in self.law.parameters},
        }


def fit_ladder(
    laws: Sequence[FrictionLaw],
    training: Sequence[FrictionRecording],
    held_out: Sequence[FrictionRecording],
    progress: Progress = silent,
    seed: int = 0,
) -> list[Rung]:
    """Return every law fitted to `training`. Nothing of `held_out` enters the fit.

    `progress(share, law)` is called on the way.
    """
    rungs = []
    for law in laws:
        values = _fit_law(law, training, progress, seed)
        unseen = law_error(law, values, held_out) if held_out else None
        rungs.append(Rung(law, values, law_error(law, values, training), unseen))
    return rungs


def best_rung(rungs: Sequence[Rung]) -> Rung:
    """Return the rung with the least held-out error; without any, with the least training error."""
    return min(rungs, key=lambda each: each.error)


def law_error(law: FrictionLaw, values: FloatArray, recordings: Sequence[FrictionRecording]) -> float:
    """Return rms error over rms force over all samples of `recordings`."""
    error = signal = 0.0
    for recording in recordings:
        force = predicted_force(law, values, recording)
        error += ((force - recording.force) ** 2).sum()
        signal += (recording.force**2).sum()
    return math.sqrt(error / signal)


def predicted_force(law: FrictionLaw, values: FloatArray, recording: FrictionRecording) -> FloatArray:
    """Return the force (N) that the law predicts from the displacement and the normal force alone."""
    return law.simulate(values, smoothed_displacement(recording), recording.dt, recording.normal_force)


@single_threaded
def _fit_law(
    law: FrictionLaw, training: Sequence[FrictionRecording], progress: Progress, seed: int
) -> FloatArray:
    """Return the best parameters of several bounded searches."""
    coarse, fine = (
        _Search(law, [thinned(each, samples) for each in training])
        for samples in (SEARCH_SAMPLES, FINAL_SAMPLES)
    )
    random = np.random.default_rng(seed)
    ends = []
    for number in range(STARTS):
        progress(number / (STARTS + 1), law.name)
        starts = [coarse.start(random) for _ in range(DRAWS)] if number else [coarse.start()]
        ends.append(coarse.run(min(starts, key=coarse.cost), 60))
    best = min(ends, key=lambda each: each[1])[0]
    progress(STARTS / (STARTS + 1), law.name)
    values, _ = fine.run(best, 40)
    progress(1.0, law.name)
    return fine.values(values)


class _Search:
    """One law on recordings: parameters as the search counts them, by logarithm or in typical sizes."""

    def __init__(self, law: FrictionLaw, recordings: Sequence[FrictionRecording]):
        self.law, self.recordings = law, recordings
        self.low = np.array([each.low for each in law.parameters])
        self.high = np.array([each.high for each in law.parameters])
        self.logarithmic = np.array([each.logarithmic for each in law.parameters])
        first = np.clip(law.start, self.low, self.high)
        self.size = np.where(first != 0.0, np.abs(first), 1.0)
        self.bounds = self.unknowns(self.low), self.unknowns(self.high)
        self.first = self.unknowns(first)
        self.scale = math.sqrt(sum((each.force**2).sum() for each in recordings))

    def unknowns(self, values: FloatArray) -> FloatArray:
        with np.errstate(divide='ignore', invalid='ignore'):
            return np.where(self.logarithmic, np.log(values / self.size), values / self.size)

    def values(self, unknowns: FloatArray) -> FloatArray:
        values = np.where(self.logarithmic, np.exp(np.clip(unknowns, -700.0, 700.0)), unknowns) * self.size
        return np.clip(values, self.low, self.high)

    def start(self, random: np.random.Generator | None = None) -> FloatArray:
        """Return the first start, or one that is drawn around it."""
        middle, (low, high) = self.first, self.bounds
        if random is not None:
            draw = _SPREAD * random.standard_normal(middle.size)
            middle = np.where(self.logarithmic, middle + draw, middle * np.exp(draw))
        margin = 1e-6 * (high - low)
        return np.clip(middle, low + margin, high - margin)

    def residuals(self, unknowns: FloatArray) -> FloatArray:
        values = self.values(unknowns)
        errors = [
            self.law.simulate(values, each.displacement, each.dt, each.normal_force) - each.force
            for each in self.recordings
        ]
        return np.nan_to_num(np.concatenate(errors) / self.scale, nan=1.0, posinf=1.0, neginf=-1.0)

    def cost(self, unknowns: FloatArray) -> float:
        return 0.5 * (self.residuals(unknowns) ** 2).sum()

    def run(self, start: FloatArray, evaluations: int) -> tuple[FloatArray, float]:
        """Return (unknowns, cost) of one search that begins at `start`."""
        # finite steps wide enough to move turning samples: the laws are not smooth
        fit = least_squares(
            self.residuals, start, bounds=self.bounds, x_scale=1.0, diff_step=1e-4, ftol=1e-7, xtol=1e-7,
            max_nfev=evaluations,
        )  # fmt: skip
        return fit.x, fit.cost
