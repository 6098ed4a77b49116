"""`engine-mount report`: one page about one or several recordings."""

from collections.abc import Sequence
from pathlib import Path
from typing import Annotated

import typer

from mount_cli.completion.values import recordings
from mount_cli.terminal import note, terminal

EPILOG = """Exit code: 0 when the page is written, also about a damaged recording; 1 when nothing can be read
or written.

Examples:

`engine-mount report bags/first` - beside the recording, in its run folder

`engine-mount report bags/first --compare bags/second --out difference.html` - and what is different

`engine-mount report drive_1 drive_2 drive_3 --out three.html --png pictures` - in the same charts
"""


def report(
    recordings: Annotated[
        list[Path],
        typer.Argument(
            metavar='RECORDING...',
            help='folders of recordings or runs, or MCAP files',
            autocompletion=recordings,
        ),
    ],
    other: Annotated[
        Path | None,
        typer.Option(
            '--compare',
            metavar='OTHER',
            autocompletion=recordings,
            help='draw this one too and tell how it differs from the first',
        ),
    ] = None,
    out: Annotated[
        Path | None, typer.Option(metavar='FILE', help='the page; default: report.html in or beside the run')
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
    from mount_bags.run.place import open_run
    from mount_cli.screen import TerminalScreen
    from mount_report.pages import default_page, default_pictures, write_report

    console = terminal()
    opened = [part for path in recordings for part in open_run(path).by_mount()]
    compared = None if other is None else open_run(other)
    file = out or default_page(recordings[0])
    files = write_report(opened, compared, file, pictures or default_pictures(file), TerminalScreen(console))
    for recording in (*opened, *([compared] if compared else [])):
        for warning in recording.warnings:
            note(console, f'{recording.path}: {warning}')
    console.print(f'report     {file}', soft_wrap=True)
    console.print(_pictures_line(files), soft_wrap=True)


def _pictures_line(files: Sequence[Path]) -> str:
    return (
        f'pictures   {len(files)} in {files[0].parent}'
        if files
        else 'pictures   none, there is nothing to draw'
    )
