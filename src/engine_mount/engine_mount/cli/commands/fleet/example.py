"""`engine-mount fleet example`: a fleet of short simulated drives to try the other commands on."""

from pathlib import Path
from typing import Annotated

import typer

from engine_mount.cli.terminal import note, terminal

EPILOG = """Exit code: 0 when all recordings are made; 1 when one is not, or the order was refused.

Examples:

`engine-mount fleet example --out drives` - 200 recordings, some 7 s each

`engine-mount fleet example --out few --recordings 24` - some of them, each kind of damage among them

`engine-mount fleet example --out long --recordings 8 --seconds 600` - longer ones

Ten drives in twenty variations (parameters, mounts, pieces); six are damaged, each in its own way. The same
order makes the same bytes each time.
"""


def example(
    out: Annotated[Path, typer.Option(metavar='FOLDER', help='folder to create')],
    recordings: Annotated[
        int, typer.Option(metavar='NUMBER', help='how many of the fleet, spread over it')
    ] = 200,
    seconds: Annotated[
        float,
        typer.Option(metavar='S', help='length of the excitation of each drive, a sweep at most its own'),
    ] = 4.0,
    workers: Annotated[int, typer.Option(min=0, metavar='NUMBER', help='processes; 0: one on each core')] = 0,
) -> None:
    """Make recordings of short simulated drives, a few of them damaged, to try a fleet on."""
    from engine_mount.cli.screen import TerminalScreen
    from engine_mount.fleet.example.fleet import make_example

    console = terminal()
    failed, count = 0, 0
    with TerminalScreen(console).bar('driving') as show:
        for count, done in enumerate(make_example(out, recordings, seconds, workers), 1):
            show(count / recordings, detail=f'{count} of {recordings}')
            if done.result is None:
                failed += 1
                note(console, done.reason)
    console.print(f'recordings {count - failed} in {out}', soft_wrap=True)
    if failed:
        raise typer.Exit(1)
