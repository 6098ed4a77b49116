"""`engine-mount fleet worst`: which recordings to look at, with the commands that open them."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from engine_mount.cli.commands.options import JsonFile
from engine_mount.cli.terminal import terminal

if TYPE_CHECKING:
    from engine_mount.fleet.worst import Worst

EPILOG = """Exit code: 0 when the column is there, 1 with the reason when not.

Examples:

`engine-mount fleet worst result --by setpoint_difference_rms_a` - where the change matters most

`engine-mount fleet worst catalogue --by peak_displacement_m --count 3` - the largest motions

`engine-mount fleet worst catalogue --by contact_gap_m --lowest` - the smallest gaps
"""


def worst(
    folder: Annotated[Path, typer.Argument(metavar='FOLDER', help='result or catalogue')],
    by: Annotated[str, typer.Option(metavar='COLUMN', help='column of numbers')],
    count: Annotated[int, typer.Option(min=1, metavar='NUMBER', help='how many')] = 10,
    lowest: Annotated[
        bool, typer.Option('--lowest', help='the smallest values; otherwise the largest, whatever their sign')
    ] = False,
    json_file: JsonFile = None,
) -> None:
    """List the recordings with the largest values of a column, with the commands that open them."""
    from engine_mount.fleet.worst import worst as worst_of
    from engine_mount.reports.json_file import write_json

    console = terminal()
    found = worst_of(folder, by, count, lowest=lowest)
    for number, one in enumerate(found, 1):
        console.print(f'{number:>2}. {worst_line(one, by)}', soft_wrap=True)
        for command in one.commands:
            console.print(f'    {command}', soft_wrap=True)
    if not found:
        console.print(f'no row has a number in {by}')
    if json_file is not None:
        rows = [
            {'recording': one.row['recording'], 'mount': one.row['mount'] or '', 'uri': one.uri,
             by: one.value, 'commands': one.commands}
            for one in found
        ]  # fmt: skip
        write_json({'by': by, 'worst': rows}, json_file)


def worst_line(one: 'Worst', by: str) -> str:
    """Return the recording with its mount and value."""
    named = ' '.join(filter(None, (one.row['recording'], one.row['mount'])))
    return f'{named}: {by} {one.value:.6g}'
