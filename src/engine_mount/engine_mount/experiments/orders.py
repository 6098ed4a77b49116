"""From names and options to orders, all checked before the first experiment runs; then one by one."""

from pathlib import Path

from engine_mount.experiments.harness.contract import (
    Experiment,
    ExperimentError,
    Order,
    Outcome,
    Progress,
    Values,
)
from engine_mount.recordings.screen import Bar, Screen
from engine_mount.settings.options import settings_of_options
from engine_mount.settings.run_folder import RunFolderError, new_place
from mount_bringup.settings import checked_settings, defaults_of_nodes
from mount_models.quantity import with_flattened

Runs = list[tuple[Experiment, Order]]


def orders(experiments: list[Experiment], options: list[str], out: Path | None, *, graph: bool) -> Runs:
    """Return each experiment with its order; raises a `ValueError` that says what is wrong with it."""
    if graph:
        for experiment in experiments:
            if not experiment.closed_loop:
                raise ExperimentError(
                    f'{experiment.name} has no graph to run through: neither controller nor CAN bus take '
                    'part in it; leave out --graph'
                )
    known: dict[str, Values] = {}
    for experiment in experiments:
        known |= experiment.known_settings() | (defaults_of_nodes() if experiment.closed_loop else {})
    settings = checked_settings(settings_of_options(options, known), known, 'owner of parameters here')
    for experiment in experiments:
        with_flattened(experiment.defaults, settings.get(experiment.name, {}))  # refuses what is out of range
    place = out or new_place(experiments[0].name if len(experiments) == 1 else 'experiments')
    if place.exists() and (not place.is_dir() or any(place.iterdir())):
        raise RunFolderError(f'{place} exists and is not empty; choose another folder with --out')
    folders = [place] if len(experiments) == 1 else [place / experiment.name for experiment in experiments]
    return [
        (experiment, Order(folder, settings, graph))
        for experiment, folder in zip(experiments, folders, strict=True)
    ]


def run_all(runs: Runs, screen: Screen) -> list[tuple[Experiment, Outcome]]:
    """Run all orders, one bar for each, and return what came of them."""
    outcomes = []
    for experiment, order in runs:
        order.out.mkdir(parents=True, exist_ok=True)
        with screen.bar(experiment.name) as show:
            outcomes.append((experiment, experiment.run(order, _named(experiment.name, show))))
            show(1.0, experiment.name)
    return outcomes


def _named(name: str, show: Bar) -> Progress:
    return lambda share, what: show(share, f'{name}: {what}')
