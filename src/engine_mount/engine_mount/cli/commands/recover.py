"""`engine-mount edit recover`: a sound recording out of a cut or damaged one."""

from pathlib import Path
from typing import Annotated

import typer

from engine_mount.cli.commands.options import RecordingPlace, option
from engine_mount.cli.fetching import beside, local

INCOMPLETE = 3

EPILOG = f"""Exit code: 0 when nothing of the file is missing in the new recording, {INCOMPLETE} when
something is lost and the rest stands in it, 2 when nothing could be recovered, or for a wrong use of the
command.

Examples:

`engine-mount edit recover bags/first/recording`

`engine-mount edit recover crash/drive_0.mcap --out bags/drive_recovered`

All chunks whose checksum holds are kept, with topics, times, session, metadata and the recorder's report of
its own losses. A last chunk that was cut off is lost. The original is not touched.
"""


def recover(
    recording: RecordingPlace,
    out: Annotated[
        Path | None,
        option('folder of the new recording; default: beside it, of a URI here, `..._recovered`'),
    ] = None,
) -> None:
    """Make a sound recording after a crash or from a bad disk; print kept and lost data."""
    from engine_mount.cli.screen import TerminalScreen
    from engine_mount.recordings.edit import recover as recovered
    from engine_mount.recordings.recording import recording_place

    screen = TerminalScreen()
    source = recording_place(local(recording, screen))
    target = out or beside(source, '_recovered')
    with screen.bar('recovering', transient=True) as show:
        result = recovered(source, target, lambda done, of: show(done / max(of, 1)))
    for sentence in result.notes:
        screen.note(sentence)
    screen.say(f'{result}; it stands in {result.folder}')
    if not result.complete:
        raise typer.Exit(INCOMPLETE)
