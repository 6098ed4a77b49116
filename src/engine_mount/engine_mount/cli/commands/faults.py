"""`engine-mount faults`: every fault in the real graph, and what the graph does about it."""

import sys
from pathlib import Path
from typing import Annotated

import typer

from engine_mount.cli.commands.options import Domain
from engine_mount.cli.completion import listed
from engine_mount.cli.terminal import note, terminal

EPILOG = """Exit code: 0 when every fault ended as required; 1 when one did not, with what was wrong.

The graphs run in real time, and a machine with other work makes them late: what was not as required is
tried once more.

Examples:

`engine-mount faults --list` - which there are, and what is required

`engine-mount faults --only coil_open,kill_driver --json faults.json` - two of them

`engine-mount faults --page docs/reference/faults.md` - all, with the page
"""

_DRIVE = (sys.executable, '-P', '-c', 'from engine_mount.cli.command import main; main()', 'drive')


def faults(
    only: Annotated[
        str, typer.Option(metavar='NAME,...', help='these faults only', autocompletion=listed('case'))
    ] = '',
    show: Annotated[bool, typer.Option('--list', help='tell which faults there are')] = False,
    third: Annotated[bool, typer.Option('--third', help='a representative third of them')] = False,
    out: Annotated[
        Path | None,
        typer.Option(metavar='FOLDER', help='runs of the graphs; default: a new one in bags'),
    ] = None,
    json_file: Annotated[
        Path | None, typer.Option('--json', metavar='FILE', help='write the outcomes')
    ] = None,
    page: Annotated[Path | None, typer.Option(metavar='FILE', help='write the page')] = None,
    priority: Annotated[
        int, typer.Option(min=0, max=90, help='real-time priority of the 1 kHz loop where permitted; 0: none')
    ] = 10,
    domain: Domain = None,
) -> None:
    """Bring every fault into the real graph and tell what the graph does about it."""
    from engine_mount.cli.screen import TerminalScreen
    from engine_mount.faults.case import MATRIX
    from engine_mount.faults.graph import Place
    from engine_mount.faults.page import table, write_page
    from engine_mount.faults.session import run_faults
    from engine_mount.recordings.screen import Table
    from engine_mount.reports.json_file import write_json
    from engine_mount.settings.run_folder import make_run_folder
    from mount_bringup.graph.domain import chosen_domain

    console = terminal()
    unknown = [name for name in only.split(',') if name and name not in MATRIX]
    if unknown:
        raise typer.BadParameter(f'{", ".join(unknown)}: no such fault; --list tells which there are')
    chosen = [
        case
        for case in MATRIX.values()
        if (not only or case.name in only.split(',')) and (not third or case.third)
    ]
    if show:
        rows = [(case.name, f'{case.meaning}: {case.reaction.value}') for case in chosen]
        TerminalScreen(console).table(Table('', 'll', rows, ('name', 'fault: what is required')))
        return
    folder = make_run_folder(out, 'faults').path.absolute()
    screen = TerminalScreen(console)
    with screen.bar('faults', transient=True) as bar:
        place = Place(_DRIVE, chosen_domain(domain), folder, priority)
        outcomes = run_faults(
            chosen, place, bar, lambda case, outcome: screen.say(f'{case.name}: {outcome.wrong or "ok"}')
        )
    told = {MATRIX[name]: outcome for name, outcome in outcomes.items()}
    screen.table(table(told))
    if json_file is not None:
        write_json({name: outcome.as_json() for name, outcome in outcomes.items()}, json_file)
    if page is not None:
        write_page(told, page)
        console.print(f'page       {page}', soft_wrap=True)
    wrong = {name: outcome for name, outcome in outcomes.items() if not outcome.ok}
    for name, outcome in wrong.items():
        note(console, outcome.wrong, name)
    if wrong:
        raise typer.Exit(1)
