"""`engine-mount report`: one page about one or several recordings."""

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
    from engine_mount.reports.report import default_page, default_pictures
    from engine_mount.reports.report import report as make_report

    console = terminal()
    places = [local(recording, console) for recording in recordings]
    compared = None if other is None else local(other, console)
    first = places[0]
    fetched = beside(first) / f'{first.name if first.is_dir() else first.stem}_report.html'
    file = out or (fetched if is_fetched(first) else default_page(first))
    folder = pictures or default_pictures(file)
    with TerminalScreen(console).bar('reading', transient=True) as show:
        made = make_report(places, compare_with=compared, out=file, pictures=folder, on_step=show)
    for failure in made.failures:
        note(console, failure)
    for subject in made.subjects:
        for warning in subject.recording.warnings:
            note(console, f'{named(subject.recording.path)}: {warning}')
    console.print(f'report     {file}', soft_wrap=True)
    drawn = f'{len(made.pictures)} in {folder}' if made.pictures else 'none, there is nothing to draw'
    console.print(f'pictures   {drawn}', soft_wrap=True)
