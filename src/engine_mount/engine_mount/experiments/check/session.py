"""The suite driven: orders checked before the first manoeuvre, in core several at a time."""

import contextlib
import io
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import partial
from pathlib import Path
from typing import Any

from engine_mount.drives.preflight import preflight
from engine_mount.experiments.check.suite import Manoeuvre
from engine_mount.experiments.check.trial import CORE, Result, Trial, broken_down, run_trial
from engine_mount.fleet.runner import run_tasks
from engine_mount.recordings.screen import Bar, Screen
from engine_mount.settings.mounts import mounts_of
from mount_bringup.settings import checked_settings
from mount_models.quantity import ParameterError
from mount_models.sampling import SAMPLE_RATE
from mount_sim.mount_choice import with_control_of_mount

Settings = Mapping[str, Mapping[str, Any]]
Told = Callable[[str, Result, float], None]
"""Takes a manoeuvre that is done, what came of it, and the share of all that is done with it (0..1)."""

_AROUND = 8.0  # s, chosen: through nodes, their start and end


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
    return [replace(trial, seconds=_checked_duration(trial)) for trial in trials]


def run_trials(trials: Sequence[Trial], jobs: int, screen: Screen, tell: Told) -> dict[str, Result]:
    """Drive all, `tell` of each when it is done, and return {manoeuvre: what came of it} in their order.

    Raises `Interrupted`.
    """
    results: dict[str, Result] = {}
    whole = sum(trial.seconds for trial in trials)
    done = 0.0
    with screen.bar('checking', transient=True) as bar:
        for trial, result in _in_core(trials, jobs) if trials[0].through == CORE else _in_turn(trials, bar):
            done += trial.seconds
            bar(done / whole, trial.manoeuvre.name)
            results[trial.manoeuvre.name] = result
            tell(trial.manoeuvre.name, result, done / whole)
    return {trial.manoeuvre.name: results[trial.manoeuvre.name] for trial in trials}


def _in_core(trials: Sequence[Trial], jobs: int) -> Iterator[tuple[Trial, Result]]:
    """Return the trials as they are done, with what came of them."""
    for done in run_tasks(run_trial, trials, workers=jobs):
        if done.error is not None:
            raise done.error
        yield trials[done.place], done.result or broken_down(done.reason)


def _in_turn(trials: Sequence[Trial], bar: Bar) -> Iterator[tuple[Trial, Result]]:
    """Return the trials one by one, with what came of them; the bar goes on while one is driven."""
    whole = sum(trial.seconds for trial in trials)
    done = 0.0
    for trial in trials:
        name, begin, part = trial.manoeuvre.name, done / whole, trial.seconds / whole
        bar(begin, name)
        yield trial, run_trial(trial, _Within(partial(_show_part, bar, name, begin, part)))
        done += trial.seconds


class _Within(Screen):
    """The screen of one drive of many: nothing of it is seen but how far it has come."""

    def __init__(self, show: Bar):
        super().__init__(io.StringIO())
        self._show = show

    @contextlib.contextmanager
    def bar(self, what: str, *, transient: bool = False) -> Iterator[Bar]:
        yield self._show


def _show_part(
    bar: Bar, name: str, begin: float, part: float, share: float, what: str = '', detail: str = ''
) -> None:
    bar(begin + part * share, name, detail)


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


def _checked_duration(trial: Trial) -> float:
    """Return how long (s) a drive is, start and end of its graph included, or raise `CheckError`."""
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
    return excitation.start + excitation.duration + (0.0 if trial.through == CORE else _AROUND)
