"""`engine-mount report`: one page about one or several recordings."""

from collections.abc import Sequence
from pathlib import Path
from typing import Annotated

import typer

from engine_mount.cli.commands.options import RecordingPlaces
from engine_mount.cli.completion import recordings as offered
from engine_mount.cli.fetching import beside, is_fetched, local, named
from engine_mount.cli.terminal import note, terminal

EPILOG = """Exit code: 0 when the page is written, also about a damaged recording; 1 when nothing can be read
or written.

Examples:

`engine-mount report bags/first` - beside the recording, in its run folder

`engine-mount report bags/first --compare bags/second --out difference.html` - and what is different

`engine-mount report drive_1 drive_2 drive_3 --out three.html --png pictures` - in the same charts
"""


def report(
    recordings: RecordingPlaces,
    other: Annotated[
        str | None,
        typer.Option(
            '--compare',
            metavar='OTHER',
            autocompletion=offered,
            help='draw this one too and tell how it differs from the first',
        ),
    ] = None,
    out: Annotated[
        Path | None,
        typer.Option(
            metavar='FILE',
            help='the page; default: report.html in or beside the run, of a URI here',
        ),
    ] = None,
    pictures: Annotated[
        Path | None,
        typer.Option(
            '--png', metavar='FOLDER', help='folder of the PNGs; default: beside the page, by its name'
        ),
    ] = None,
) -> None:
    """Write one HTML page that works without network, and its charts as PNG.

    Several recordings share the charts. What a recording lacks stands in the page in words.
    """
    from engine_mount.cli.screen import TerminalScreen
    from engine_mount.recordings.place import open_run
    from engine_mount.reports.pages import default_pictures, write_report

    console = terminal()
    places = [local(recording, console) for recording in recordings]
    opened = [part for place in places for part in open_run(place).by_mount()]
    compared = None if other is None else open_run(local(other, console))
    file = out or _page(places[0])
    files = write_report(opened, compared, file, pictures or default_pictures(file), TerminalScreen(console))
    for recording in (*opened, *([compared] if compared else [])):
        for warning in recording.warnings:
            note(console, f'{named(recording.path)}: {warning}')
    console.print(f'report     {file}', soft_wrap=True)
    console.print(_pictures_line(files), soft_wrap=True)


def _page(recording: Path) -> Path:
    from engine_mount.reports.pages import default_page

    if is_fetched(recording):
        return beside(recording) / f'{recording.name if recording.is_dir() else recording.stem}_report.html'
    return default_page(recording)


def _pictures_line(files: Sequence[Path]) -> str:
    return (
        f'pictures   {len(files)} in {files[0].parent}'
        if files
        else 'pictures   none, there is nothing to draw'
    )
