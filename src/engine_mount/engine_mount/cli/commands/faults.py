"""`engine-mount dev faults`: every fault in the real graph, and what the graph does about it."""

import sys
from pathlib import Path
from typing import Annotated

import typer

from engine_mount.cli.commands.options import (
    Domain,
    JsonFile,
    Listing,
    Page,
    Priority,
    names_in,
    new_screen,
    option,
    write_figures,
)
from engine_mount.cli.help import named

EPILOG = """Exit code: 0 when every fault ended as required; 1 when one did not, with the failed requirement.

The graphs run in real time, and a machine with other work makes them late: repeat a fault with `--only`.

Examples:

`engine-mount dev faults --list` - all faults with their requirements

`engine-mount dev faults --only coil_open,kill_driver --json faults.json` - two of them

`engine-mount dev faults --page docs/reference/faults.md` - all, with the page
"""

_DRIVE = (sys.executable, '-P', '-c', 'from engine_mount.cli.command import main; main()', 'drive')


def faults(
    only: Annotated[str, option('these faults only', 'NAME,...', named('case'))] = '',
    show: Listing = False,
    out: Annotated[Path | None, option('runs of the graphs; default: a new one in bags', 'FOLDER')] = None,
    json_file: JsonFile = None,
    page: Page = None,
    priority: Priority = 10,
    domain: Domain = None,
) -> None:
    """Inject every fault into the real graph and print the reaction of the graph."""
    from engine_mount.faults.case import MATRIX
    from engine_mount.faults.graph import Place
    from engine_mount.faults.page import write_page
    from engine_mount.faults.session import run_faults
    from engine_mount.recordings.screen import Table
    from engine_mount.settings.run_folder import make_run_folder
    from mount_bringup.graph.domain import chosen_domain

    screen, wanted = new_screen(), names_in(only, MATRIX, 'fault')
    chosen = [case for case in MATRIX.values() if case.name in wanted]
    if show:
        rows = [(case.name, f'{case.meaning}: {case.reaction.value}') for case in chosen]
        screen.table(Table('', 'll', rows, ('name', 'fault: what is required')))
        return
    folder = make_run_folder(out, 'faults').path.absolute()
    with screen.bar('faults', transient=True) as bar:
        place = Place(_DRIVE, chosen_domain(domain), folder, priority)
        outcomes = run_faults(
            chosen, place, bar, lambda case, outcome: screen.say(f'{case.name}: {outcome.wrong or "ok"}')
        )
    told = {MATRIX[name]: outcome for name, outcome in outcomes.items()}
    write_figures({name: outcome.as_json() for name, outcome in outcomes.items()}, json_file)
    if page is not None:
        write_page(told, page)
        screen.say(f'page       {page}')
    wrong = {name: outcome for name, outcome in outcomes.items() if not outcome.ok}
    for name, outcome in wrong.items():
        screen.note(outcome.wrong, name)
    if wrong:
        raise typer.Exit(1)
