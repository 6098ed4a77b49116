"""All experiments by name, in the order of the paper's figures."""

from mount_bringup.experiments import (
    bench,
    field_penetration,
    force_characteristic,
    inductance_map,
    motorway_gap,
    ramp_and_hold,
    recorded_drive,
    sawtooth,
    sensitivity,
    sweep,
)
from mount_bringup.experiments.contract import Experiment, ExperimentError

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
