"""`engine-mount merge`: several pieces of one drive as one recording."""

from pathlib import Path
from typing import Annotated

import typer

from engine_mount.cli.commands.options import RecordingPlaces
from engine_mount.cli.fetching import local
from engine_mount.cli.terminal import note, terminal

EPILOG = """Exit code: 0 when all is written, 1 when something of the parts could not be read.

Example: `engine-mount merge bags/drive_0s_10s bags/drive_10s_end --out bags/whole`
"""


def merge(
    recordings: RecordingPlaces,
    out: Annotated[Path, typer.Option(help='folder to create')],
    different_sessions: Annotated[
        bool, typer.Option('--different-sessions', help='merge recordings of different drives, too')
    ] = False,
) -> None:
    """Join recordings by log time; what stands in more than one of them is written once."""
    from engine_mount.recordings.merge import merge as merge_recordings
    from engine_mount.recordings.place import open_run

    console = terminal()
    opened = [open_run(local(place, console)) for place in recordings]
    done = merge_recordings(opened, out, different_sessions=different_sessions)
    console.print(
        f'{done.messages} messages; {done.repeated} stood in more than one part and were written once\n'
        f'recording  {done.folder}',
        soft_wrap=True,
    )
    warnings = [warning for recording in opened for warning in recording.warnings]
    for sentence in (*warnings, *done.losses):
        note(console, sentence)
    if done.losses:
        raise typer.Exit(1)
