"""All experiments by name, in the order of the paper's figures; each is loaded when it is wanted."""

from collections.abc import Sequence
from importlib import import_module
from os import PathLike
from pathlib import Path
from typing import Any

from engine_mount.experiments.harness.experiment import (
    NAMES,
    Experiment,
    ExperimentError,
    Order,
    Outcome,
    Settings,
    Values,
)
from engine_mount.settings.run_folder import checked_place, new_place
from mount_bringup.settings import checked_settings, defaults_of_nodes
from mount_models.quantity import flattened, nearest

ALL = 'all'


def listed() -> list[tuple[str, str, str]]:
    """Return name, reference in the paper and title of every experiment, without loading any."""
    return [(name, reference, title) for name, (title, reference) in NAMES.items()]


def experiment_named(name: str) -> Experiment:
    """Return the experiment of this name; raises `ExperimentError` for an unknown one."""
    if name not in NAMES:
        raise ExperimentError(f'{name!r} is no experiment; {nearest(name, (*NAMES, ALL))}')
    experiment: Experiment = import_module(f'{__package__}.{name}').EXPERIMENT
    return experiment


def experiments_named(names: Sequence[str]) -> list[Experiment]:
    """Return the experiments of these names, or of `all`; raises `ExperimentError` for an unknown one."""
    return list(map(experiment_named, NAMES if ALL in names else names))


def known_settings(experiments: Sequence[Experiment]) -> dict[str, Values]:
    """Return {owner: {parameter: default}} of what can be set where these experiments run."""
    nodes = defaults_of_nodes() if any(each.closed_loop for each in experiments) else {}
    return {each.name: flattened(each.defaults) for each in experiments} | nodes


def orders(
    experiments: Sequence[Experiment], settings: Settings, out: Path | None = None
) -> list[tuple[Experiment, Order]]:
    """Return each experiment with its order; raises a `ValueError` that says what is wrong with it."""
    checked = checked_settings(settings, known_settings(experiments), 'owner of parameters here')
    alone = len(experiments) == 1
    place = checked_place(out or new_place(experiments[0].name if alone else 'experiments'))
    return [(each, each.order(place if alone else place / each.name, checked)) for each in experiments]


def experiment(name: str, *, out: str | PathLike[str] | None = None, **settings: Any) -> Outcome:
    """Repeat one experiment of the paper and return figures (SI), claims with their verdicts, and files.

    `out` is the folder of what is made, by default a new one in bags. `settings` are parameters of the
    experiment, and below the name of a node a mapping of that node's. Raises a `ValueError` that says what
    is wrong with the order.
    """
    chosen = experiment_named(name)
    nodes = {node: settings.pop(node) for node in defaults_of_nodes().keys() & settings.keys()}
    ((_, order),) = orders([chosen], {name: settings, **nodes}, None if out is None else Path(out))
    return chosen.run(order)
