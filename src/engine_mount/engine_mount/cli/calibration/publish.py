"""Results of identification and calibration: on the screen, as picture, as figures, as specimen."""

from collections.abc import Callable
from contextlib import AbstractContextManager
from pathlib import Path
from typing import Annotated, Any

from engine_mount.cli.commands.options import option, write_figures

Base = Annotated[Path | None, option('specimen that gives all other values; default: the shipped one')]
Name = Annotated[str, option('name of the specimen; default: that of the base')]
Out = Annotated[Path | None, option('write the specimen (YAML)', 'FILE')]

EXIT_CODES = 'Exit code: 0 when all that was asked for is written, 1 with the reason when not.\n\nExamples:'


def progress() -> AbstractContextManager[Callable[[float, str], None]]:
    """Return a bar of a fit that is gone when the work is done."""
    from engine_mount.cli.screen import TerminalScreen

    return TerminalScreen().bar('reading', transient=True)


def publish(
    result: Any, json_file: Path | None, figure: Path | None, out: Path | None = None, name: str = ''
) -> None:
    """Show a result and write what is wanted of it; nothing where its specimen is refused."""
    from engine_mount.cli.screen import TerminalScreen
    from engine_mount.identification.specimen import PARTS, foreign_parts, save_specimen

    screen = TerminalScreen()
    specimen = result.specimen(name) if out else None
    result.report(screen)
    if figure:
        result.draw(figure)
        screen.say(f'figure {figure}')
    named = {'specimen': specimen.name} if specimen else {}
    write_figures({**named, **result.figures()}, json_file)
    if out and specimen:
        save_specimen(specimen, out)
        screen.say(f'specimen {out}')
        for part in foreign_parts(specimen):
            screen.note(
                f'{part} is not yet that of {specimen.name!r} but of its base; run engine-mount '
                f'{PARTS[part]} with this file as --base'
            )
