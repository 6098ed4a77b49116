"""`engine-mount accept`: a reference recording made or renewed, with a reason."""

from pathlib import Path
from typing import Annotated

import typer

from engine_mount.cli.commands.options import recording_argument
from engine_mount.cli.completion import references
from engine_mount.cli.fetching import local
from engine_mount.cli.terminal import terminal

EPILOG = """Exit code: 0 when the reference is made, 1 when it was refused, with the reason.

Examples:

`engine-mount drive --core --scenario bench --duration 3 --out bags/new`

`engine-mount accept bags/new --reference initialisation --reason "ramp is 50 ms shorter"`
"""


def accept(
    run: Annotated[
        str,
        recording_argument(instead='run, recording, or replay of the reference: its folder, a file or a URI'),
    ],
    reference: Annotated[
        str, typer.Option(metavar='NAME', help='name of the reference', autocompletion=references)
    ],
    reason: Annotated[str, typer.Option(metavar='TEXT', help='why its setpoints may change')],
    folder: Annotated[Path, typer.Option(help='folder of the references')] = Path('bags/reference'),
) -> None:
    """Make a run the reference that `make test` replays; the reason is kept with it."""
    from engine_mount.recordings.place import open_run
    from engine_mount.recordings.reference import ACCEPTED_NAME
    from engine_mount.recordings.reference import accept as accept_run
    from mount_recorder.versions import versions

    console = terminal()
    accepted = accept_run(open_run(local(run, console)), reference, reason, folder, versions())
    for change in accepted.changes or ('new reference',):
        console.print(f'- {change}', soft_wrap=True)
    console.print(
        f'reference  {accepted.folder}, {accepted.size / 1e6:.2f} MB; '
        f'all references {accepted.total / 1e6:.2f} MB\n'
        f'reason     {accepted.folder / ACCEPTED_NAME}',
        soft_wrap=True,
    )
