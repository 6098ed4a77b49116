"""What several sub-commands share: options, the screen."""

from collections.abc import Callable, Collection, Sequence
from collections.abc import Mapping as Figures
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from engine_mount.cli.help import Completer, named, recordings, setting
from mount_models.quantity import nearest

if TYPE_CHECKING:
    from engine_mount.cli.screen import TerminalScreen
    from engine_mount.signals.formats.content import Stated
    from engine_mount.signals.mapping import Mapping

FOREIGN, ROAD, GRAPH, OUTPUT = 'Foreign file', 'Measured road', 'Graph', 'Output'
_BEGINNINGS = {'foreign file': FOREIGN, 'recorded': FOREIGN, 'road': ROAD, 'OpenCRG': ROAD}


def option(
    text: str,
    metavar: str | None = None,
    complete: Completer | None = None,
    *names: str,
    least: float | None = None,
    most: float | None = None,
    panel: str | None = None,
    check: Callable[[Any], Any] | None = None,
) -> Any:
    """Return an option with its help `text`, the placeholder of its value, limits and a check of its value.

    `panel` is the group in the help; options of files and roads have theirs by the beginning of their text.
    """
    return typer.Option(
        *names, help=text, metavar=metavar, autocompletion=complete, min=least, max=most,
        rich_help_panel=panel or _panel(text), callback=check,
    )  # fmt: skip


def flag(name: str, text: str, panel: str | None = None) -> Any:
    """Return an option without a value, which is never negated."""
    return typer.Option(name, help=text, rich_help_panel=panel or _panel(text))


def _panel(text: str) -> str | None:
    return next((panel for words, panel in _BEGINNINGS.items() if text.startswith(words)), None)


def argument(text: str, metavar: str | None = None, complete: Completer | None = None) -> Any:
    """Return an argument with its help `text` and its placeholder."""
    return typer.Argument(metavar=metavar, help=text, autocompletion=complete)


def refuse_without(source: str, kind: str, **options: object) -> None:
    """Refuse `options` that are given although the option `source`, which names a `kind`, is not."""
    for name, value in options.items():
        if value not in (None, '', [], False, 0.0):
            name = name.replace('_', '-')
            raise typer.BadParameter(f'--{name} is for a {kind}: name it with --{source} FILE')


def recording_argument(metavar: str | None = None, instead: str = '') -> Any:
    """Return the argument that takes a recording by path or URI; `fetching.local` brings it here."""
    what = 'folder of a run or of a recording, one of its files, or the URI of either'
    return argument(instead or what, metavar, recordings)


def changes_of(settings: list[str] | None) -> dict[str, dict[str, Any]]:
    """Return {node: {parameter: value}} of `--set`; raises `SettingError` where it is written wrongly."""
    from engine_mount.settings.options import settings_of_options

    return settings_of_options(settings or [])


def names_in(text: str, known: Collection[str], what: str) -> list[str]:
    """Return the names of a text such as `a,b`, all `known` ones of none; refuse one that is no `what`."""
    names = list(filter(None, text.split(',')))
    for name in names:
        if name not in known:
            raise typer.BadParameter(f'{name!r} is no {what}; {nearest(name, known)}')
    return names or list(known)


def seconds(text: str) -> float:
    """Return a time such as 12s or 1500ms in s, of nothing 0; raises `ValueError`."""
    from engine_mount.settings.options import duration_in_nanoseconds

    plain = text.replace('.', '', 1).isdigit()
    return duration_in_nanoseconds(f'{text}s' if plain else text) / 1e9 if text else 0.0


def target(file: Path | None) -> Path | None:
    """Return a file that is to be written; refuse it before any work where it has no folder to be in."""
    if file is not None and (file.is_dir() or not file.absolute().parent.is_dir()):
        raise typer.BadParameter(f'{file} must be a file in an existing folder; make {file.parent} first')
    return file


def new_screen() -> 'TerminalScreen':
    """Return the screen of a command; loaded once it knows what is wanted."""
    from engine_mount.cli.screen import TerminalScreen

    return TerminalScreen()


def write_figures(figures: Figures[str, Any], file: Path | None) -> None:
    """Write figures where a file is named."""
    from engine_mount.settings.run_folder import write_json

    if file is not None:
        write_json(figures, file)


RecordingPlace = Annotated[str, recording_argument()]
RecordingPlaces = Annotated[list[str], recording_argument('RECORDING...')]
Position = Annotated[str, option('one of several mounts, such as left', 'NAME', named('place'))]
NewFolder = Annotated[Path | None, option('folder to create; default: a new one in bags', panel=OUTPUT)]
JsonFile = Annotated[
    Path | None,
    option('write all figures to this file', 'FILE', None, '--json', panel=OUTPUT, check=target),
]
From = Annotated[
    str, option('begin, from the first displacement sample, such as 12s', 'TIME', None, '--from')
]
Figure = Annotated[Path | None, option('draw the result (PNG)', 'FILE', panel=OUTPUT, check=target)]
Page = Annotated[Path | None, option('write the page, and its pictures beside it', 'FILE', panel=OUTPUT)]
Listing = Annotated[bool, flag('--list', 'list all names')]
Split = Annotated[str, option('largest file, such as 500MB; default: one file', 'SIZE', panel=OUTPUT)]
Settings = Annotated[
    list[str] | None,
    option('any parameter of any node; may be repeated', '[NODE.]NAME=VALUE', setting, '--set'),
]
Priority = Annotated[
    int,
    option('real-time priority of the 1 kHz loop where permitted; 0: none', least=0, most=90, panel=GRAPH),
]
Domain = Annotated[int | None, option('ROS domain; default: ROS_DOMAIN_ID or 0', panel=GRAPH)]
Namespace = Annotated[str, option('namespace of the mount, such as mount_right', panel=GRAPH)]
Columns = Annotated[
    list[str] | None,
    option(
        'foreign file: a column by name or number, and its unit, as in acceleration=az:g; road: the height',
        '[QUANTITY=]COLUMN[:UNIT]',
        None,
        '--column',
    ),
]
TimeColumn = Annotated[
    str,
    option(
        'foreign file: column of its times, and their unit, as in t:ms; default: by title, in s',
        'COLUMN[:UNIT]',
    ),
]
Rate = Annotated[float | None, option('foreign file without times: samples per second', 'HZ')]
MapFile = Annotated[
    Path | None,
    option('foreign file: YAML file with columns, units and times of a measuring system', 'FILE'),
]
Dbc = Annotated[Path | None, option('foreign file: database that decodes raw CAN frames', 'FILE')]
Decimal = Annotated[str, option('foreign file: decimal sign of a table that can be read in two ways', 'SIGN')]
Delimiter = Annotated[
    str,
    option('foreign file: delimiter of the cells of such a table, as ";", tab or blank', 'SIGN'),
]
Scale = Annotated[
    float | None,
    option('foreign file: factor to m/s^2 upwards, or on a column with a unit; -1: an axis that points down'),
]
Lateral = Annotated[float, option('OpenCRG: track so far left of the reference line', 'M')]
Distance = Annotated[
    str, option('road: column of the distance, or the distance between two heights', 'NAME[:UNIT]|M')
]
SpeedText = Annotated[str, option('road: 60/3.6 or 60km/h', 'M/S')]
Scheduler = Annotated[str, option('local, or tcp://HOST:PORT of a Dask cluster', 'local|ADDRESS')]
Workers = Annotated[int, option('local: processes; 0: one on each core', least=0)]


def mapping_of(map_file: Path | None) -> 'Mapping':
    """Return what a mapping file says, nothing without one; raises `SignalError`."""
    from engine_mount.signals.mapping import Mapping, mapping_in_file

    return mapping_in_file(map_file) if map_file else Mapping()


def stated(dbc: Path | None, decimal: str, delimiter: str) -> 'Stated':
    """Return what the options say of a foreign file beside its columns and times."""
    from engine_mount.signals.formats.content import Stated

    return Stated(dbc=dbc, decimal=decimal, delimiter=delimiter)


SEVERAL = ('--train', '--held-out')


def with_repeated_options(arguments: Sequence[str], several: Sequence[str] = SEVERAL) -> list[str]:
    """Return `arguments` with an option of `several` repeated before each of the values that follow it.

    Values end at the next word that begins with a dash. All else stays as it is.
    """
    result: list[str] = []
    option, filled = '', True
    for number, word in enumerate(arguments):
        if word == '--':
            return [*result, *arguments[number:]]
        if word.startswith('-') and word != '-':
            option, filled = (word, False) if word in several else ('', True)
            result.append(word)
        elif option and filled:
            result += [option, word]
        else:
            result.append(word)
            filled = True
    return result
