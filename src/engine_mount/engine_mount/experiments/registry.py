"""All experiments by name, in the order of the paper's figures; each is loaded when it is asked for."""

from importlib import import_module

from engine_mount.experiments.harness.contract import Experiment, ExperimentError

ALL = 'all'

NAMES = (
    'force_characteristic',
    'field_penetration',
    'inductance_map',
    'ramp_and_hold',
    'sawtooth',
    'bench',
    'sweep',
    'motorway_gap',
    'sensitivity',
    'policy',
    'recorded_drive',
    'measured_road',
)
"""The names of the experiments, which are those of their folders."""


def listed() -> list[tuple[str, str, str]]:
    """Return name, reference in the paper and title of every experiment, without loading any."""
    folders = {name: import_module(f'{__package__}.{name}') for name in NAMES}
    return [(name, folder.REFERENCE, folder.TITLE) for name, folder in folders.items()]


def experiment_named(name: str) -> Experiment:
    """Return the experiment of this name; raises `ExperimentError` for an unknown one."""
    if name not in NAMES:
        raise ExperimentError(f'{name!r} is no experiment; known are {", ".join((*NAMES, ALL))}')
    experiment: Experiment = import_module(f'{__package__}.{name}.experiment').EXPERIMENT
    return experiment


def experiments_named(names: list[str]) -> list[Experiment]:
    """Return the experiments of these names; raises `ExperimentError` for an unknown one.

    `all` stands for every one that needs nothing of the user's own.
    """
    named = [experiment_named(name) for name in names if name != ALL]
    if ALL not in names:
        return named
    return [each for each in map(experiment_named, NAMES) if not each.needs or each in named]
