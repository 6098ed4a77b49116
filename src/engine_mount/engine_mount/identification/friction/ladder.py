"""The ladder: every law fitted to the same recordings, judged by recordings that no fit has seen.

The error is rms of the difference over rms of the measured force, both over all samples of all recordings.
The training error tells how well a law can follow, the held-out error what it is worth.
"""

import math
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.optimize import least_squares

from engine_mount.identification.friction.laws.coulomb import Coulomb, CoulombViscous
from engine_mount.identification.friction.laws.dahl import Dahl
from engine_mount.identification.friction.laws.elastic_play import ElasticPlay
from engine_mount.identification.friction.laws.law import FrictionLaw
from engine_mount.identification.friction.laws.lugre import LuGre
from engine_mount.identification.friction.laws.pad import PadModel
from engine_mount.identification.friction.recording import (
    FloatArray,
    FrictionRecording,
    smoothed_displacement,
    thinned,
)
from engine_mount.identification.single_threaded import single_threaded
from mount_models.friction.coefficient import FrictionCoefficients
from mount_models.friction.contact import FrictionContact

SEARCH_SAMPLES = 1200
"""Samples per recording while starts are compared."""
FINAL_SAMPLES = 5000
STARTS = 5
DRAWS = 12
"""So many points are drawn for each start after the first; the search begins at the best of them."""
TIME_LIMIT = 45.0
"""Seconds for one law; the best so far counts then."""
_SPREAD = 1.2  # of the logarithm, by which further starts differ from the first

Progress = Callable[[str, float], None]


@dataclass(frozen=True)
class Rung:
    """One fitted law: its parameters, its errors, how long the search took (s) and whether time ran out."""

    law: FrictionLaw
    values: FloatArray
    train_error: float
    held_out_error: float
    seconds: float
    out_of_time: bool

    @property
    def named_values(self) -> dict[str, float]:
        """Return {parameter: value}."""
        return {
            entry.name: float(value) for entry, value in zip(self.law.parameters, self.values, strict=True)
        }


def all_laws(
    training: Sequence[FrictionRecording], known: tuple[FrictionContact, FrictionCoefficients] | None = None
) -> list[FrictionLaw]:
    """Return the rungs from below; `known` is what steps 1 to 3 have found."""
    return [Coulomb(), CoulombViscous(), Dahl(), LuGre(), ElasticPlay(), PadModel(training, known)]


def fit_ladder(
    training: Sequence[FrictionRecording],
    held_out: Sequence[FrictionRecording],
    *,
    laws: Sequence[FrictionLaw] | None = None,
    progress: Progress | None = None,
    seed: int = 0,
    time_limit: float = TIME_LIMIT,
) -> list[Rung]:
    """Return every law fitted to `training`; the held-out error is NaN without `held_out`.

    Nothing of `held_out` enters the fit. `progress(law, share)` is called on the way.
    """
    rungs = []
    for law in laws or all_laws(training):
        begun = time.monotonic()
        values, out_of_time = fit_law(law, training, progress=progress, seed=seed, time_limit=time_limit)
        rungs.append(
            Rung(
                law,
                values,
                law_error(law, values, training),
                law_error(law, values, held_out) if held_out else math.nan,
                time.monotonic() - begun,
                out_of_time,
            )
        )
    return rungs


def best_rung(rungs: Sequence[Rung]) -> Rung:
    """Return the rung with the least held-out error; without any, with the least training error."""
    return min(
        rungs, key=lambda each: each.train_error if math.isnan(each.held_out_error) else each.held_out_error
    )


def law_error(law: FrictionLaw, values: FloatArray, recordings: Sequence[FrictionRecording]) -> float:
    """Return rms error over rms force over all samples of `recordings`."""
    error = signal = 0.0
    for recording in recordings:
        force = predicted_force(law, values, recording)
        error += float(((force - recording.force) ** 2).sum())
        signal += float((recording.force**2).sum())
    return math.sqrt(error / signal)


def predicted_force(law: FrictionLaw, values: FloatArray, recording: FrictionRecording) -> FloatArray:
    """Return the force (N) that the law predicts from the displacement and the normal force alone."""
    return law.simulate(values, smoothed_displacement(recording), recording.dt, recording.normal_force)


@single_threaded
def fit_law(
    law: FrictionLaw,
    training: Sequence[FrictionRecording],
    *,
    progress: Progress | None = None,
    seed: int = 0,
    time_limit: float = TIME_LIMIT,
) -> tuple[FloatArray, bool]:
    """Return the best parameters of several bounded searches, and whether time ran out before the end."""
    end = time.monotonic() + time_limit
    search = _Search(law, training)
    coarse = [thinned(recording, SEARCH_SAMPLES) for recording in training]
    fine = [thinned(recording, FINAL_SAMPLES) for recording in training]
    random = np.random.default_rng(seed)
    found = []
    for number in range(STARTS):
        _tell(progress, law.name, number / (STARTS + 1))
        candidates = [search.begin(random, number + each) for each in range(DRAWS if number else 1)]
        first = min(candidates, key=lambda seen: search.cost(coarse, seen))
        found.append(search.run(coarse, first, 60, end))
        if time.monotonic() > end:
            break
    best = min(found, key=lambda each: each[1])[0]
    _tell(progress, law.name, STARTS / (STARTS + 1))
    # the coarse result is judged on the fine grid too: a search that time ends early must not make it worse
    values, _ = search.run(fine, best, 40, end)
    _tell(progress, law.name, 1.0)
    return search.plain(values), time.monotonic() > end


class _Search:
    """Maps parameters to what the search sees: logarithms, or multiples of a typical size, within bounds."""

    def __init__(self, law: FrictionLaw, training: Sequence[FrictionRecording]):
        self.law = law
        self.logarithmic = np.array([entry.logarithmic for entry in law.parameters])
        self.low = np.array([entry.quantity.low for entry in law.parameters])
        self.high = np.array([entry.quantity.high for entry in law.parameters])
        self.first = np.clip(law.start(training), self.low, self.high)
        self.size = np.where(self.first != 0.0, np.abs(self.first), 1.0)

    def plain(self, seen: FloatArray) -> FloatArray:
        values = np.where(self.logarithmic, np.exp(np.clip(seen, -700.0, 700.0)), seen) * self.size
        return np.asarray(np.clip(values, self.low, self.high))

    def bounds(self) -> tuple[FloatArray, FloatArray]:
        with np.errstate(divide='ignore', invalid='ignore'):
            low = np.where(self.logarithmic, np.log(self.low / self.size), self.low / self.size)
            high = np.where(self.logarithmic, np.log(self.high / self.size), self.high / self.size)
        return low, high

    def begin(self, random: np.random.Generator, number: int) -> FloatArray:
        """Return the first start, or one drawn around it."""
        low, high = self.bounds()
        with np.errstate(divide='ignore', invalid='ignore'):
            middle = np.where(self.logarithmic, np.log(self.first / self.size), self.first / self.size)
        if number > 0:
            draw = random.standard_normal(middle.size)
            middle = np.where(self.logarithmic, middle + _SPREAD * draw, middle * np.exp(_SPREAD * draw))
        margin = 1e-6 * (high - low)
        return np.asarray(np.clip(middle, low + margin, high - margin))

    def residuals(self, recordings: Sequence[FrictionRecording], seen: FloatArray) -> FloatArray:
        scale = math.sqrt(sum(float((each.force**2).sum()) for each in recordings))
        values = self.plain(seen)
        parts = [
            self.law.simulate(values, each.displacement, each.dt, each.normal_force) - each.force
            for each in recordings
        ]
        return np.asarray(np.nan_to_num(np.concatenate(parts) / scale, nan=1.0, posinf=1.0, neginf=-1.0))

    def cost(self, recordings: Sequence[FrictionRecording], seen: FloatArray) -> float:
        return 0.5 * float((self.residuals(recordings, seen) ** 2).sum())

    def run(
        self, recordings: Sequence[FrictionRecording], seen: FloatArray, evaluations: int, end: float
    ) -> tuple[FloatArray, float]:
        """Return (unknowns, cost) of one search that begins at `seen`."""

        def residuals(unknowns: FloatArray) -> FloatArray:
            return self.residuals(recordings, unknowns)

        def late(intermediate_result: object) -> None:
            if time.monotonic() > end:
                raise StopIteration

        # finite steps wide enough to move turning samples: the laws are not smooth
        found = least_squares(
            residuals, seen, bounds=self.bounds(), x_scale=1.0, diff_step=1e-4, ftol=1e-7, xtol=1e-7,
            max_nfev=evaluations, callback=late,
        )  # fmt: skip
        return np.asarray(found.x), float(found.cost)


def _tell(progress: Progress | None, law: str, share: float) -> None:
    if progress is not None:
        progress(law, share)
