"""`engine-mount fleet index`: what each of many recordings is and holds, as two tables."""

from pathlib import Path
from typing import Annotated

import typer

from engine_mount.cli.commands.fleet.reasons import tell_question
from engine_mount.cli.commands.fleet.resuming import resumable
from engine_mount.cli.commands.options import Dbc, JsonFile, MapFiles, Scheduler, Workers
from engine_mount.cli.terminal import terminal

EPILOG = """Exit code: 0 when the catalogue is written, also where recordings are damaged, which their rows
tell; 1 when a place cannot be listed, its store no longer answers, or the cluster is lost.

Examples:

`engine-mount fleet index drives --out catalogue` - all recordings below a folder

`engine-mount fleet index s3://bucket/drives sftp://host/data/drives --out catalogue` - in stores

`engine-mount fleet index drives --map rack_2.yaml --map car.yaml --out catalogue` - files of others too

`engine-mount fleet index drives --out catalogue --scheduler tcp://10.0.0.5:8786` - read by a Dask cluster,
whose workers must reach the same places

What did not change is not read again, what is gone leaves the catalogue. After Ctrl-C, or whatever ended it,
the same command goes on where it stopped.
"""


def index(
    uris: Annotated[list[str], typer.Argument(metavar='URI...', help='folders or recordings, paths or URIs')],
    out: Annotated[Path, typer.Option(metavar='CATALOGUE', help='folder to make or to bring up to date')],
    map_files: MapFiles = None,
    dbc: Dbc = None,
    scheduler: Scheduler = 'local',
    workers: Workers = 0,
    memory: Annotated[
        int,
        typer.Option(min=0, metavar='MB', help='local: most for each process; 0: its share of the machine'),
    ] = 0,
    json_file: JsonFile = None,
) -> None:
    """Write what each recording is and holds into a catalogue: a row for it, and one for each event."""
    from time import monotonic

    from engine_mount.cli.screen import TerminalScreen
    from engine_mount.fleet.catalogue.index import indexed
    from engine_mount.fleet.foreign import said_in
    from engine_mount.reports.json_file import write_json

    console, began = terminal(), monotonic()
    with resumable(), TerminalScreen(console).bar('indexing', transient=True) as show:
        found = indexed(
            uris,
            out,
            said_in(map_files or [], dbc),
            scheduler=scheduler,
            workers=workers,
            memory=memory * 1_000_000,
            progress=lambda now: show(now.done / max(now.of, 1), detail=f'{now.done} of {now.of} recordings'),
        )
    figures = {
        'catalogue': str(out),
        'rows': found.recordings.num_rows,
        'read': found.read,
        'unchanged': found.unchanged,
        'vanished': found.vanished,
        'unreadable': found.unreadable,
        'wall_s': monotonic() - began,
    }
    for name in ('read', 'unchanged', 'vanished', 'unreadable'):
        console.print(f'{name:<12}{figures[name]}', soft_wrap=True)
    console.print(f'{"catalogue":<12}{out}', soft_wrap=True)
    if found.unreadable:
        what = f'{found.unreadable} {"is" if found.unreadable == 1 else "are"} unreadable'
        tell_question(console, what, out, 'recordings', "kind = 'unreadable'")
    if json_file is not None:
        write_json(figures, json_file)
