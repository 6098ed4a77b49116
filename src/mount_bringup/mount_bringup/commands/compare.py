"""`engine-mount compare`: what is different between two recordings, in words."""

import json
from pathlib import Path
from typing import Annotated

import typer
from rich.console import Console

from mount_bringup.commands.options import JsonFile

EPILOG = """Examples:

`engine-mount compare bags/before bags/after` - to the bit

`engine-mount compare A B --tolerance current=0.01 --tolerance switching=0.002 --tolerance 0.1%`

`engine-mount compare bags/long bags/cut --common --figure difference.png`
"""
_INCOMPARABLE = 2


def compare(
    a: Annotated[Path, typer.Argument(metavar='A', help='folder of a recording or run, or an MCAP file')],
    b: Annotated[Path, typer.Argument(metavar='B', help='the other one')],
    tolerances: Annotated[
        list[str] | None,
        typer.Option(
            '--tolerance',
            metavar='NAME=VALUE',
            help='signal=0.01 in its unit, signal=1% of its largest value, 1% for all, switching=0.002 in s',
        ),
    ] = None,
    common: Annotated[bool, typer.Option('--common', help='compare only the time that both cover')] = False,
    json_file: JsonFile = None,
    figure: Annotated[
        Path | None, typer.Option(metavar='FILE', help='draw the most important differences (PNG)')
    ] = None,
) -> None:
    """Tell in words how recording B differs from recording A.

    Exit code 0: equal to the bit, or within the tolerances; 1: different; 2: not to be compared.
    """
    from mount_bags.alignment import ComparisonError
    from mount_bags.compare import compare as compare_recordings
    from mount_bags.comparison_words import as_json, as_table, sentences
    from mount_bags.tolerances import Tolerances
    from mount_bringup.recording_path import open_run

    console = Console()
    recordings = open_run(a), open_run(b)
    try:
        comparison = compare_recordings(*recordings, Tolerances(tolerances or ()), common_only=common)
    except ComparisonError as error:
        Console(stderr=True).print(f'[red]engine-mount:[/red] {error}', soft_wrap=True, highlight=False)
        raise typer.Exit(_INCOMPARABLE) from None
    console.print(f'A {comparison.name_a}, B {comparison.name_b}', highlight=False)
    for sentence in sentences(comparison):
        console.print(f'- {sentence}', soft_wrap=True, highlight=False, markup=False)
    if comparison.differing:
        console.print(as_table(comparison))
    console.print(
        f'Times are from the first displacement sample of A; {comparison.alignment.sentence}.',
        soft_wrap=True,
        highlight=False,
    )
    for recording in recordings:
        for warning in recording.warnings:
            console.print(f'[yellow]note[/yellow] {recording.path}: {warning}', soft_wrap=True)
    if json_file is not None:
        json_file.write_text(json.dumps(as_json(comparison), indent=2, allow_nan=False) + '\n')
    if figure is not None:
        from mount_bringup.compare_figure import draw_comparison

        draw_comparison(comparison, *recordings, figure)
        console.print(f'figure {figure}', highlight=False)
    if not comparison.equal:
        raise typer.Exit(1)
