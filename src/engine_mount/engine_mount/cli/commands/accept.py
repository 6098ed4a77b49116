"""`engine-mount dev accept`: a reference recording made or renewed, with a reason."""

from pathlib import Path
from typing import Annotated

from engine_mount.cli.commands.options import new_screen, option, recording_argument
from engine_mount.cli.fetching import local

EPILOG = """Exit code: 0 when the reference is made, 2 when it was refused, with the reason.

Examples:

`engine-mount drive --core --scenario bench --duration 3 --out bags/new`

`engine-mount dev accept bags/new --reference initialisation --reason "ramp is 50 ms shorter"`
"""


def accept(
    run: Annotated[
        str,
        recording_argument(instead='run, recording, or replay of the reference: its folder, a file or a URI'),
    ],
    reference: Annotated[str, option('name of the reference', 'NAME')],
    reason: Annotated[str, option('reason for the change of its setpoints', 'TEXT')],
    folder: Annotated[Path, option('folder of the references')] = Path('bags/reference'),
) -> None:
    """Make a run the reference that `make test` replays; the reason is kept with it."""
    from engine_mount.recordings.recording import open_run
    from engine_mount.recordings.reference import ACCEPTED_NAME
    from engine_mount.recordings.reference import accept as accept_run
    from mount_recorder.versions import versions

    screen = new_screen()
    accepted = accept_run(open_run(local(run, screen)), reference, reason, folder, versions())
    for change in accepted.changes or ('new reference',):
        screen.say(f'- {change}')
    place, size, total = accepted.folder, accepted.size / 1e6, accepted.total / 1e6
    screen.say(f'reference  {place}, {size:.2f} MB; all references {total:.2f} MB')
    screen.say(f'reason     {place / ACCEPTED_NAME}')
