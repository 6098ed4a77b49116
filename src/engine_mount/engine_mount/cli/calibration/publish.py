"""Results of identification and calibration: on the screen, as picture, as figures, as specimen."""

from collections.abc import Callable
from contextlib import AbstractContextManager
from pathlib import Path
from typing import Annotated, Any

import typer

from engine_mount.cli.terminal import note, terminal

Base = Annotated[
    Path | None, typer.Option(help='specimen that gives all other values; default: the shipped one')
]
Name = Annotated[str, typer.Option(help='name of the specimen; default: that of the base')]
Out = Annotated[Path | None, typer.Option(metavar='FILE', help='write the specimen (YAML)')]
Figure = Annotated[Path | None, typer.Option(metavar='FILE', help='draw measurement and result (PNG)')]

EXIT_CODES = 'Exit code: 0 when all that was asked for is written, 1 with the reason when not.\n\nExamples:'


def progress() -> AbstractContextManager[Callable[[float, str], None]]:
    """Return a bar of a fit that is gone when the work is done."""
    from engine_mount.cli.screen import TerminalScreen

    return TerminalScreen(terminal()).bar('reading', transient=True)


def publish(
    result: Any, json_file: Path | None, figure: Path | None, out: Path | None = None, name: str = ''
) -> None:
    """Show a result and write what is wanted of it; nothing where its specimen is refused."""
    from engine_mount.cli.screen import TerminalScreen
    from engine_mount.identification.specimen import PARTS, foreign_parts, save_specimen
    from engine_mount.reports.json_file import write_json

    console = terminal()
    specimen = result.specimen(name) if out else None
    result.report(TerminalScreen(console))
    if figure:
        result.draw(figure)
        console.print(f'figure {figure}', soft_wrap=True)
    if json_file:
        named = {'specimen': specimen.name} if specimen else {}
        write_json({**named, **result.figures()}, json_file)
    if out and specimen:
        save_specimen(specimen, out)
        console.print(f'specimen {out}', soft_wrap=True)
        for part in foreign_parts(specimen):
            note(
                console,
                f'{part} is not yet that of {specimen.name!r} but of its base; run engine-mount '
                f'{PARTS[part]} with this file as --base',
            )
