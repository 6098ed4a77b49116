"""All experiments by name, in the order of the paper's figures; each is loaded when it is wanted."""

from importlib import import_module

from engine_mount.experiments.harness.contract import Experiment, ExperimentError

ALL = 'all'

NAMES = {
    'force_characteristic': ('Force of the actuator over current and gap', 'Fig. 2'),
    'field_penetration': ("How far the ripple's field enters the iron", 'Fig. 3'),
    'inductance_map': ('Incremental inductance over current and gap', 'Fig. 4'),
    'ramp_and_hold': ('Ramp and hold of the sticking contact', 'Fig. 7'),
    'sawtooth': ('Friction contact alone on a saw tooth', 'Figs. 8 to 11'),
    'bench': ('Friction mount and hydromount on a test rack', 'Fig. 13'),
    'sweep': ('Front wheels from 1 to 50 Hz', 'Fig. 14'),
    'motorway_gap': ('Over a gap in the motorway', 'Fig. 15'),
    'sensitivity': ('What the comparison with the hydromount depends on', 'Figs. 13, 14'),
    'policy': ('Control policies side by side', 'Figs. 14, 15; Secs. 6, 7'),
    'recorded_drive': ('A recorded drive', 'Sec. 7'),
    'measured_road': ('A measured road', 'Sec. 7'),
}
"""{name of the experiment and its file: (title, section or figure of the paper)}."""


def listed() -> list[tuple[str, str, str]]:
    """Return name, reference in the paper and title of every experiment, without loading any."""
    return [(name, reference, title) for name, (title, reference) in NAMES.items()]


def experiment_named(name: str) -> Experiment:
    """Return the experiment of this name; raises `ExperimentError` for an unknown one."""
    if name not in NAMES:
        raise ExperimentError(f'{name!r} is no experiment; known are {", ".join((*NAMES, ALL))}')
    experiment: Experiment = import_module(f'{__package__}.{name}').EXPERIMENT
    return experiment


def experiments_named(names: list[str]) -> list[Experiment]:
    """Return the experiments of these names; raises `ExperimentError` for an unknown one.

    `all` stands for every one that needs nothing of the user's own.
    """
    named = [experiment_named(name) for name in names if name != ALL]
    if ALL not in names:
        return named
    return [each for each in map(experiment_named, NAMES) if not each.needs or each in named]
