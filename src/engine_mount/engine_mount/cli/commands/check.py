"""`engine-mount check`: the manoeuvre suite that a change passes before it goes into the car."""

from pathlib import Path
from typing import Annotated

import typer

from engine_mount.cli.commands.options import (
    JsonFile,
    Listing,
    NewFolder,
    Settings,
    changes_of,
    new_screen,
    option,
    write_figures,
)

EPILOG = """Exit code: 0 when every manoeuvre stayed within its limits; 1 when a limit was exceeded; 2 for a
wrong use of the command, of a suite or of a parameter, and nothing was driven.

Examples:

`engine-mount check` - the shipped suite, without middleware

`engine-mount check --set continuous_viscous.damping_coefficient=3500` - with a change

`engine-mount check --only gap_20mm,rack` - two manoeuvres

`engine-mount check --suite ours.yaml --json check.json --out bags/check` - your own manoeuvres and limits
"""


def check(
    suite: Annotated[Path | None, option('manoeuvres and limits; default: those shipped', 'FILE')] = None,
    only: Annotated[str, option('these manoeuvres only', 'NAME,...')] = '',
    show: Listing = False,
    settings: Settings = None,
    jobs: Annotated[int, option('manoeuvres at a time; 0: one per core', least=0)] = 0,
    json_file: JsonFile = None,
    out: NewFolder = None,
) -> None:
    """Drive the manoeuvre suite and print its limits, the worst first."""
    from engine_mount.experiments.check import report
    from engine_mount.experiments.check.run import run_trials, trials_of
    from engine_mount.experiments.check.suite import chosen_of, passed, shipped_suite, suite_in_file
    from engine_mount.settings.run_folder import make_run_folder, new_place

    screen = new_screen()
    given = changes_of(settings)
    known = shipped_suite() if suite is None else suite_in_file(suite)
    chosen = chosen_of(known, [name for name in only.split(',') if name])
    if show:
        for each in chosen:
            screen.say(f'{each.name:14}{each.about}')
        return
    place = out or new_place('check')
    trials = trials_of(chosen, given, place)
    make_run_folder(place, 'check')
    results = run_trials(
        trials, jobs, screen, lambda trial, result: report.show_result(trial, result, screen)
    )
    verdicts = report.all_verdicts(trials, results)
    screen.table(report.table_of(results, verdicts))
    write_figures(report.figures_of(trials, given, results, verdicts), json_file)
    screen.say(f'recordings {place}')
    if not all(map(passed, verdicts.values())):
        raise typer.Exit(1)
