"""Options that several sub-commands have."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from engine_mount.cli.completion import Completer, recordings, setting

if TYPE_CHECKING:
    from engine_mount.signals.formats.content import Stated
    from engine_mount.signals.mapping import Mapping


def option(text: str, metavar: str | None = None, complete: Completer | None = None, **more: Any) -> Any:
    """Return an option with its help `text` and the placeholder of its value."""
    return typer.Option(help=text, metavar=metavar, autocompletion=complete, **more)


def flag(name: str, text: str) -> Any:
    """Return an option without a value, which is never negated."""
    return typer.Option(name, help=text)


def refuse_without(source: str, kind: str, **options: object) -> None:
    """Refuse `options` that are given although the option `source`, which names a `kind`, is not."""
    for name, value in options.items():
        if value not in (None, '', [], False, 0.0):
            name = name.replace('_', '-')
            raise typer.BadParameter(f'--{name} is for a {kind}: name it with --{source} FILE')


def recording_argument(metavar: str | None = None, instead: str = '') -> Any:
    """Return the argument that takes a recording by path or URI; `fetching.local` brings it here."""
    what = 'folder of a run or of a recording, one of its files, or the URI of either'
    return typer.Argument(metavar=metavar, help=instead or what, autocompletion=recordings)


RecordingPlace = Annotated[str, recording_argument()]
RecordingPlaces = Annotated[list[str], recording_argument('RECORDING...')]
NewFolder = Annotated[Path | None, typer.Option(help='folder to create; default: a new one in bags')]
JsonFile = Annotated[
    Path | None, typer.Option('--json', metavar='FILE', help='write all figures to this file')
]
Split = Annotated[str, typer.Option(metavar='SIZE', help='largest file, such as 500MB; default: one file')]
Settings = Annotated[
    list[str] | None,
    typer.Option(
        '--set',
        metavar='[NODE.]NAME=VALUE',
        help='any parameter of any node; may be repeated',
        autocompletion=setting,
    ),
]
Domain = Annotated[int | None, typer.Option(help='ROS domain; default: ROS_DOMAIN_ID or 0')]
Namespace = Annotated[str, typer.Option(help='namespace of the mount, such as mount_right')]
Columns = Annotated[
    list[str] | None,
    typer.Option(
        '--column',
        metavar='[QUANTITY=]COLUMN[:UNIT]',
        help='recording of others: a column by name or number, and its unit, as in acceleration=az:g; '
        'road: that of the height',
    ),
]
TimeColumn = Annotated[
    str,
    typer.Option(
        '--time',
        '--time-column',
        metavar='COLUMN[:UNIT]',
        help='recording of others: column of its times, and their unit, as in t:ms; default: by title, in s',
    ),
]
RATE = 'recording of others without times: samples per second'
Rate = Annotated[float | None, typer.Option('--rate', metavar='HZ', help=RATE)]
MapFile = Annotated[
    Path | None,
    typer.Option(
        '--map-file',
        metavar='FILE',
        help='recording of others: YAML file that says columns, units and times of a measuring system',
    ),
]
Dbc = Annotated[
    Path | None,
    typer.Option('--dbc', metavar='FILE', help='CAN log, or MDF with raw frames: database that decodes them'),
]
Decimal = Annotated[
    str,
    typer.Option('--decimal', metavar='SIGN', help='text table that can be read in two ways: "." or ","'),
]
Delimiter = Annotated[
    str,
    typer.Option(
        '--delimiter',
        metavar='SIGN',
        help='text table that can be read in two ways: what separates its cells, as ";", tab or blank',
    ),
]


def mapping_of(map_file: Path | None) -> 'Mapping':
    """Return what a mapping file says, nothing without one; raises `SignalError`."""
    from engine_mount.signals.mapping import Mapping, mapping_in_file

    return mapping_in_file(map_file) if map_file else Mapping()


def stated(dbc: Path | None, decimal: str, delimiter: str) -> 'Stated':
    """Return what the options say of a file of others beside its columns and times."""
    from engine_mount.signals.formats.content import Stated

    return Stated(dbc=dbc, decimal=decimal, delimiter=delimiter)


Scheduler = Annotated[
    str, typer.Option(metavar='local|ADDRESS', help='local, or tcp://HOST:PORT of a Dask cluster')
]
Workers = Annotated[int, typer.Option(min=0, metavar='NUMBER', help='local: processes; 0: one on each core')]
