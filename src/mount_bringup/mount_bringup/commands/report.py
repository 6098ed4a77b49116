"""`engine-mount report`: one page about one or several recordings."""

from collections.abc import Sequence
from pathlib import Path
from typing import Annotated

import typer
from rich.console import Console

EPILOG = """Examples:

`engine-mount report bags/2026-11-20_18-03-11_motorway` - beside the recording, in its run folder

`engine-mount report bags/first --compare bags/second --out difference.html` - and what is different

`engine-mount report drive_1 drive_2 drive_3 --out three.html --png pictures` - in the same figures
"""


def report(
    recordings: Annotated[
        list[Path],
        typer.Argument(metavar='RECORDING...', help='folders of recordings or runs, or MCAP files'),
    ],
    other: Annotated[
        Path | None,
        typer.Option(
            '--compare', metavar='OTHER', help='draw this one too and tell how it differs from the first'
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
    """Write one HTML page that works without network, and its figures as PNG.

    Several recordings share the figures. What a recording lacks stands in the page in words.
    """
    from mount_bringup.recording_path import open_run
    from mount_bringup.report_pages import default_page, write_report

    console = Console()
    opened = [open_run(path) for path in recordings]
    compared = None if other is None else open_run(other)
    file = out or default_page(recordings[0])
    files = write_report(opened, compared, file, pictures or file.with_suffix(''), console)
    for recording in (*opened, *([compared] if compared else [])):
        for warning in recording.warnings:
            console.print('[yellow]note[/yellow]', end=' ')
            console.print(f'{recording.path}: {warning}', soft_wrap=True, highlight=False, markup=False)
    console.print(f'report     {file}', soft_wrap=True, highlight=False, markup=False)
    console.print(_pictures_line(files), soft_wrap=True, highlight=False, markup=False)


def _pictures_line(files: Sequence[Path]) -> str:
    return (
        f'pictures   {len(files)} in {files[0].parent}'
        if files
        else 'pictures   none, there is nothing to draw'
    )
