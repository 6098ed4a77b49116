"""`engine-mount merge`: several pieces of one drive as one recording."""

from pathlib import Path
from typing import Annotated

import typer

from engine_mount.cli.commands.options import RecordingPlaces, flag, option
from engine_mount.cli.fetching import local

EPILOG = """Exit code: 0 when all is written, 1 when something of the parts could not be read.

Example: `engine-mount merge bags/drive_0s_10s bags/drive_10s_end --out bags/whole`
"""


def merge(
    recordings: RecordingPlaces,
    out: Annotated[Path, option('folder to create')],
    different_sessions: Annotated[
        bool, flag('--different-sessions', 'merge recordings of different drives, too')
    ] = False,
) -> None:
    """Join recordings by log time; what stands in more than one of them is written once."""
    from engine_mount.cli.screen import TerminalScreen
    from engine_mount.recordings.merge import merge as merge_recordings
    from engine_mount.recordings.place import open_run

    screen = TerminalScreen()
    opened = [open_run(local(place, screen)) for place in recordings]
    done = merge_recordings(opened, out, different_sessions=different_sessions)
    screen.say(
        f'{done.messages} messages; {done.repeated} stood in more than one part and were written once\n'
        f'recording  {done.folder}'
    )
    for sentence in (*(warning for one in opened for warning in one.warnings), *done.losses):
        screen.note(sentence)
    if done.losses:
        raise typer.Exit(1)
