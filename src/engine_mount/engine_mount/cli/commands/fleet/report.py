"""`engine-mount fleet report`: one page about the result of a fleet."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from engine_mount.cli.terminal import note, terminal

if TYPE_CHECKING:
    from engine_mount.fleet.worst import Worst
    from engine_mount.reports.fleet.looks import Look

EPILOG = """Exit code: 0 when the page is written, also where a recording could not be read again for its
picture, which the page says; 1 when there is no result, or the page cannot be written.

Examples:

`engine-mount fleet report result` - result/report.html

`engine-mount fleet report result --by pad_energy_changed_j --count 5 --out energy.html`
"""

_BY = {'setpoints': 'setpoint_difference_largest_a', 'displacement': 'displacement_difference_largest_m'}
"""By which column the worst are chosen, by what was asked."""


def report(
    result: Annotated[Path, typer.Argument(metavar='RESULT', help='folder of fleet replay')],
    out: Annotated[
        Path | None, typer.Option(metavar='FILE', help='the page; default: report.html in RESULT')
    ] = None,
    by: Annotated[
        str,
        typer.Option(metavar='COLUMN', help='by which the worst are chosen; default: the largest difference'),
    ] = '',
    count: Annotated[
        int, typer.Option(min=0, metavar='NUMBER', help='recordings with a picture of their own')
    ] = 10,
) -> None:
    """Write one page: how figures are spread before and after the change, the worst, what failed and why.

    The recordings with pictures are read once more. The page needs no network.
    """
    from engine_mount.cli.screen import TerminalScreen
    from engine_mount.fleet.questions import result_of
    from engine_mount.fleet.worst import worst
    from engine_mount.reports.fleet.report import fleet_report

    console = terminal()
    table = result_of(result)
    by = by or _BY[table['asked'][0].as_py()]
    found = worst(result, by, count) if count else []
    looks = []
    with TerminalScreen(console).bar('replaying the worst', transient=True) as show:
        for place, one in enumerate(found):
            show(place / len(found), detail=one.row['recording'])
            looks.append(_look(one, result))
    for look in looks:
        if look.reason:
            note(console, f'{look.name}: no picture: {look.reason}')
    file = out or result / 'report.html'
    file.parent.mkdir(parents=True, exist_ok=True)
    fleet_report(table, looks, by, result.absolute().name).write_page(file)
    console.print(f'report     {file}', soft_wrap=True)


def _look(one: 'Worst', result: Path) -> 'Look':
    from engine_mount.fleet.before_and_after import before_and_after
    from engine_mount.fleet.worst import said_of
    from engine_mount.reports.fleet.looks import Look, Signals

    try:
        found = before_and_after(
            one.uri,
            one.changes,
            one.row['mount'] or '',
            closed_loop=one.row['asked'] == 'displacement',
            said=said_of(result),
        )
    except (ValueError, OSError) as error:
        return Look(one.row, one.commands, reason=str(error))
    return Look(one.row, one.commands, Signals(found.time, found.given, found.setpoints, found.displacements))
