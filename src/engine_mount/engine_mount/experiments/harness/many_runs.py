"""Many runs of the closed loop side by side, each in a process of its own; nothing is recorded."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any, TypeVar

import numpy as np

from engine_mount.drives.loop.messages import Samples
from engine_mount.drives.loop.run import run_core_into
from engine_mount.experiments.harness.contract import Settings, Values
from engine_mount.experiments.harness.measures import peak_and_rms
from engine_mount.fleet.runner import run_tasks
from engine_mount.reports.drive.signals import FloatArray
from engine_mount.reports.sections.periodic import harmonics, whole_periods
from engine_mount.settings.chosen import Parameters
from mount_init.initialisation import InitialisationResult
from mount_models.sampling import SAMPLE_TIME
from mount_sim.plant.plant import TRUTH

Found = dict[tuple[Any, ...], Any]
"""{key of a run: its figures}."""
J = TypeVar('J')

_ORDERS = 8
_PERIODS = 16


@dataclass(frozen=True)
class Job:
    """One run: its key in the results, and the parameters of all nodes."""

    key: tuple[Any, ...]
    parameters: Settings


class TruthOnly:
    """Keeps some fields of the truth of a run, nothing else."""

    def __init__(self, names: Sequence[str] = ('displacement', 'mount_force', 'chassis_acceleration')):
        self._names = names
        self._pieces: list[FloatArray] = []

    def write_samples(self, samples: Samples) -> None:
        """Take the block's truths and empty it."""
        truth = samples.truths[: samples.count].view(TRUTH)[:, 0]
        self._pieces.append(np.stack([truth[name] for name in self._names]))
        samples.count = 0

    def write_result(self, stamp: int, result: InitialisationResult) -> None:
        """Let the initialisation's result pass: the controller has it."""

    def write_off(self, stamp: int) -> None:
        """Let the last setpoint pass."""

    def signals(self, start: float) -> FloatArray:
        """Return (fields, n), one row for each field, SI, from `start` (s) on."""
        return np.concatenate(self._pieces, axis=1)[:, round(start / SAMPLE_TIME) :]


def run_all(
    jobs: Sequence[J],
    workers: int,
    told: Callable[[int], None],
    work: Callable[[J], tuple[tuple[Any, ...], Any]],
) -> Found:
    """Return {key: figures} of all jobs; `told` takes how many are done. 0 workers: one for each core.

    `work` returns key and figures of one job, as `run_job` does.
    """
    found: Found = {}
    for done in run_tasks(work, jobs, workers=workers):
        if done.result is None:
            raise done.error or ChildProcessError(done.reason)
        key, figures = done.result
        found[key] = figures
        told(len(found))
    return found


def run_job(job: Job) -> tuple[tuple[Any, ...], Values]:
    """Run one job through the same closed loop as every drive in core; return its key and its figures."""
    truth = TruthOnly()
    outcome = run_core_into(truth, job.parameters)
    displacement, force, acceleration = truth.signals(outcome.excitation_start)
    if job.parameters['mount_sim']['scenario'] == 'bench':
        return job.key, _of_bench(force, job.parameters)
    return job.key, peak_and_rms(displacement, acceleration)


def _of_bench(force: FloatArray, parameters: Parameters) -> Values:
    frequency = float(parameters['mount_sim']['bench.frequency'])
    time = SAMPLE_TIME * np.arange(force.size)
    part, _ = whole_periods(time, frequency, _PERIODS)
    return {'harmonics_n': harmonics(time[part], force[part], frequency, _ORDERS).tolist()}
