"""The suite driven: orders checked before the first manoeuvre, in core several at a time."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from mount_bags.run.screen import Screen
from mount_bringup.mount_choice import with_control_of_mount
from mount_bringup.mounts import mounts_of
from mount_bringup.settings import checked_settings
from mount_experiments.check.suite import Manoeuvre
from mount_experiments.check.trial import CORE, Result, Trial, run_trial
from mount_experiments.sensitivity.grid import run_all
from mount_models.quantity import ParameterError
from mount_models.sampling import SAMPLE_RATE
from mount_replay.drive.preflight import preflight

Settings = Mapping[str, Mapping[str, Any]]


class CheckError(ValueError):
    """The suite cannot be driven as ordered; the text says why and the remedy."""


@dataclass(frozen=True)
class CheckOrder:
    """What is to be checked: manoeuvres, the user's {node: {parameter: value}}, and how they are driven.

    `jobs` manoeuvres at a time in core, 0: one for each core of the machine.
    """

    manoeuvres: Sequence[Manoeuvre]
    through: str = CORE
    settings: Settings = field(default_factory=dict)
    jobs: int = 0
    domain: int = 0
    priority: int = 0


def trials_of(order: CheckOrder, out: Path) -> list[Trial]:
    """Return the drives of an order, each refused with its manoeuvre before any begins; a `ValueError`."""
    if order.through != CORE and order.jobs > 1:
        raise CheckError(f'through {order.through} one manoeuvre is driven at a time; leave out --jobs')
    settings = checked_settings(order.settings)
    if mounts_of(settings):
        raise CheckError('a suite checks one mount; leave out mount_sim.mounts')
    for node, values in settings.items():
        if values.get('sample_rate', SAMPLE_RATE) != SAMPLE_RATE:
            raise CheckError(f'a suite is judged at {SAMPLE_RATE:g} Hz; leave out {node}.sample_rate')
    trials = [
        Trial(manoeuvre, _merged(manoeuvre, settings), order.through, out, order.domain, order.priority)
        for manoeuvre in order.manoeuvres
    ]
    for trial in trials:
        _check(trial)
    return trials


def run_trials(trials: Sequence[Trial], jobs: int, screen: Screen) -> dict[str, Result]:
    """Drive all and return {manoeuvre: what came of it} in their order; raises `Interrupted`."""
    results: dict[str, Result] = {}
    with screen.bar('checking', transient=True) as show:
        if trials[0].through == CORE:
            told = run_all(trials, jobs, lambda done: show(done / len(trials)), run_trial)
            results = {name: result for (name,), result in told.items()}
        else:
            for place, trial in enumerate(trials):
                show(place / len(trials), trial.manoeuvre.name)
                _, results[trial.manoeuvre.name] = run_trial(trial)
    return {trial.manoeuvre.name: results[trial.manoeuvre.name] for trial in trials}


def _merged(manoeuvre: Manoeuvre, settings: Settings) -> dict[str, dict[str, Any]]:
    merged = {node: dict(values) for node, values in manoeuvre.settings.items()}
    for node, values in settings.items():
        for name, value in values.items():
            if name in merged.get(node, {}):
                raise CheckError(
                    f'{node}.{name} is set by the manoeuvre {manoeuvre.name} itself; leave it out, or give a '
                    'suite of your own with --suite'
                )
            merged.setdefault(node, {})[name] = value
    return with_control_of_mount(merged)


def _check(trial: Trial) -> None:
    manoeuvre = trial.manoeuvre
    try:
        excitation = preflight(trial.parameters, core=trial.through == CORE)
    except ParameterError as error:
        raise CheckError(f'{manoeuvre.name}: {error}') from None
    if manoeuvre.evaluated_from >= excitation.duration:
        raise CheckError(
            f'{manoeuvre.name}: evaluated_from_s ({manoeuvre.evaluated_from:g} s) must lie before the end of '
            f'the excitation ({excitation.duration:g} s)'
        )
