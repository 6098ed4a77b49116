"""`engine-mount export signals`: signals of a recording for other programs."""

from pathlib import Path
from typing import Annotated

from engine_mount.cli.commands.options import OUTPUT, RecordingPlace, option, target
from engine_mount.cli.fetching import local

EPILOG = """Exit code: 0 when the file is written, 2 when it is refused, with the reason.

Examples:

`engine-mount export signals bags/first --out first.csv` - all signals, units in the titles

`engine-mount export signals bags/first --signal displacement.mount --signal current --out first.mat`

A row is a sample of the displacement, or without it of the signal that has most. Other signals hold their
last value. `engine-mount import` reads the file again.
"""


def signals(
    recording: RecordingPlace,
    out: Annotated[Path, option('file to write: .csv, .parquet or .mat', 'FILE', panel=OUTPUT, check=target)],
    signal: Annotated[
        list[str] | None, option('a signal, as topic.field; may be repeated; default: all', 'NAME')
    ] = None,
) -> None:
    """Write signals of a recording as CSV, Parquet or MATLAB, one table with times in s."""
    from engine_mount.cli.screen import TerminalScreen
    from engine_mount.recordings.recording import recording_place
    from engine_mount.signals.exporting import export

    screen = TerminalScreen()
    place = recording_place(local(recording, screen))
    with screen.console.status('reading'):
        summary = export(place, out, signal or ())
    screen.say(f'exported   {summary}')
    screen.say(f'file       {out}')
