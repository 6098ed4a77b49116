"""What the commands of the rack share: files and their values, results on the screen and on disk."""

from collections.abc import Callable, Sequence
from contextlib import AbstractContextManager
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from engine_mount.cli.commands.options import OUTPUT, new_screen, option, target, write_figures

if TYPE_CHECKING:
    from engine_mount.signals.formats.content import Stated
    from engine_mount.signals.mapping import Mapping


def rack_mapping(columns: list[str], mapping: 'Mapping', stated: 'Stated') -> 'Mapping':
    """Return the columns of a rack's quantities, of a mapping and of `--column`, which goes before it."""
    from engine_mount.identification.rack import RACK
    from engine_mount.signals.mapping import with_options

    return with_options(mapping.of(RACK), columns, known=RACK, stated=stated)


def file_values(files: list[Path], gaps: list[str], temperatures: Sequence[str] = ()) -> Any:
    """Return what the caller says of gaps (FILE=UM) and temperatures ([FILE=]DEGC) as `FileValues`."""
    from engine_mount.identification.rack import FileValues

    apart = _per_file(gaps, files, '--gap', (20.0, 5000.0), 'um', 'in mm')
    single = [setting for setting in temperatures if '=' in setting]
    common = [setting for setting in temperatures if '=' not in setting]
    if len(common) > 1:
        raise typer.BadParameter('--coil-temperature without FILE= holds for all files: give it once')
    told = '--coil-temperature', (-60.0, 250.0), 'degC', 'in kelvin'
    celsius, others = _per_file(single, files, *told), [_within(text, text, *told) for text in common]
    return FileValues({file: 1e-6 * gap for file, gap in apart.items()}, celsius, *others)


def _per_file(settings: list[str], files: list[Path], name: str, *limits: Any) -> dict[Path, float]:
    """Return {file: value} of FILE=VALUE settings; files are meant by path or by name."""
    values = {}
    for setting in settings:
        named, equals, text = setting.rpartition('=')
        meant = [file for file in files if str(file) == named or file.name == named]
        if not equals or len(meant) != 1:
            what = 'no file' if not meant else f'{len(meant)} files'
            raise typer.BadParameter(
                f'{name} {setting}: {named!r} is {what} of those given; write FILE=VALUE'
            )
        values[meant[0]] = _within(text, setting, name, *limits)
    return values


def _within(text: str, setting: str, name: str, limits: tuple[float, float], unit: str, guess: str) -> float:
    """Return the number that a setting of an option holds; refuse one beyond its limits."""
    try:
        value = float(text)
    except ValueError:
        raise typer.BadParameter(f'{name} {setting}: {text!r} is no number') from None
    low, high = limits
    if not low <= value <= high:
        raise typer.BadParameter(
            f'{name} {setting}: must lie within {low:g} .. {high:g} {unit}; was it meant {guess}?'
        )
    return value


Base = Annotated[Path | None, option('specimen with all other values; default: the shipped one')]
Name = Annotated[str, option('name of the specimen; default: that of the base')]
Out = Annotated[Path | None, option('write the specimen (YAML)', 'FILE', panel=OUTPUT, check=target)]

EXIT_CODES = 'Exit code: 0 when all requested files are written, 2 with the reason when not.\n\nExamples:'


def progress() -> AbstractContextManager[Callable[[float, str], None]]:
    """Return a bar of a fit that is gone when the work is done."""

    return new_screen().bar('reading', transient=True)


def publish(
    result: Any, json_file: Path | None, figure: Path | None, out: Path | None = None, name: str = ''
) -> None:
    """Show a result and write what is wanted of it; nothing where its specimen is refused."""
    from engine_mount.identification.specimen import PARTS, foreign_parts, save_specimen

    screen = new_screen()
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
