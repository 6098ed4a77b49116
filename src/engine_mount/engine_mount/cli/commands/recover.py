"""`engine-mount recover`: a sound recording out of a cut or damaged one."""

from pathlib import Path
from typing import Annotated

import typer

from engine_mount.cli.commands.options import RecordingPlace
from engine_mount.cli.fetching import beside, local
from engine_mount.cli.terminal import note, terminal

INCOMPLETE = 3

EPILOG = f"""Exit code: 0 when nothing of the file is missing in the new recording, {INCOMPLETE} when
something is lost and the rest stands in it, 1 when nothing could be recovered, 2 for a wrong use of the
command.

Examples:

`engine-mount recover bags/first/recording`

`engine-mount recover crash/drive_0.mcap --out bags/drive_recovered`

All chunks whose checksum holds are kept, with topics, times, session, metadata and what the
recorder says of its own losses. A last chunk that was cut off is lost. The original is not touched.
"""


def recover(
    recording: RecordingPlace,
    out: Annotated[
        Path | None,
        typer.Option(help='folder of the new recording; default: beside it, of a URI here, `..._recovered`'),
    ] = None,
) -> None:
    """Make a sound recording of what a crash or a bad disk left; say how much is kept and lost."""
    from engine_mount.cli.screen import progress_bar
    from engine_mount.recordings.place import recording_place
    from engine_mount.recordings.recover import recover as recovered

    console = terminal()
    source = recording_place(local(recording, console))
    target = out if out is not None else _beside(source)
    with progress_bar(console, transient=True) as bar:
        task = bar.add_task('recovering', total=None)
        result = recovered(source, target, lambda done, of: bar.update(task, completed=done, total=of))
    for sentence in result.notes:
        note(console, sentence)
    console.print(f'{result}; it stands in {result.folder}', soft_wrap=True)
    if not result.complete:
        raise typer.Exit(INCOMPLETE)


def _beside(recording: Path) -> Path:
    whole = recording.absolute()
    return beside(recording) / f'{whole.name if whole.is_dir() else whole.stem}_recovered'
