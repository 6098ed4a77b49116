"""All experiments by name, in the order of the paper's figures."""

from mount_experiments.bench import experiment as bench
from mount_experiments.field_penetration import experiment as field_penetration
from mount_experiments.force_characteristic import experiment as force_characteristic
from mount_experiments.harness.contract import Experiment, ExperimentError
from mount_experiments.inductance_map import experiment as inductance_map
from mount_experiments.motorway_gap import experiment as motorway_gap
from mount_experiments.policy import experiment as policy
from mount_experiments.ramp_and_hold import experiment as ramp_and_hold
from mount_experiments.recorded_drive import experiment as recorded_drive
from mount_experiments.sawtooth import experiment as sawtooth
from mount_experiments.sensitivity import experiment as sensitivity
from mount_experiments.sweep import experiment as sweep

ALL = 'all'

EXPERIMENTS: dict[str, Experiment] = {
    experiment.name: experiment
    for experiment in (
        force_characteristic.EXPERIMENT,
        field_penetration.EXPERIMENT,
        inductance_map.EXPERIMENT,
        ramp_and_hold.EXPERIMENT,
        sawtooth.EXPERIMENT,
        bench.EXPERIMENT,
        sweep.EXPERIMENT,
        motorway_gap.EXPERIMENT,
        sensitivity.EXPERIMENT,
        policy.EXPERIMENT,
        recorded_drive.EXPERIMENT,
    )
}


def experiments_named(names: list[str]) -> list[Experiment]:
    """Return the experiments of these names; raises `ExperimentError` for an unknown one.

    `all` stands for every one that needs nothing of the user's own.
    """
    unknown = [name for name in names if name not in (*EXPERIMENTS, ALL)]
    if unknown:
        known = ', '.join((*EXPERIMENTS, ALL))
        raise ExperimentError(f'{unknown[0]!r} is no experiment; known are {known}')
    if ALL not in names:
        return [EXPERIMENTS[name] for name in names]
    return [each for each in EXPERIMENTS.values() if not each.needs or each.name in names]
