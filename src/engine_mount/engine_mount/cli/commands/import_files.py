"""`engine-mount import`: a foreign file as a recording that every command takes."""

from pathlib import Path
from typing import Annotated

from engine_mount.cli.commands.options import (
    Columns,
    Dbc,
    Decimal,
    Delimiter,
    JsonFile,
    MapFile,
    Rate,
    TimeColumn,
    new_screen,
    option,
    recording_argument,
    stated,
    write_figures,
)
from engine_mount.cli.fetching import local

EPILOG = """Exit code: 0 when the recording is written, 2 when the file was refused, with the reason.

A column that is named without a unit needs one in its header. Quantities are displacement,
engine_displacement, chassis_displacement, acceleration, force, current and others; a wrong one lists them.

Examples:

`engine-mount import drive.mf4 --column acceleration=az:g --out bags/drive`

`engine-mount import rack.csv --map-file rack_2.yaml --out bags/rack` - the mapping of a team

`engine-mount import Weg.xlsx --column displacement=Weg:mm --time Zeit:ms --out bags/weg`

Import several files one by one; `rosbags-convert --src A B --dst C --dst-storage mcap` joins their
recordings, and `engine-mount edit cut` takes a part.
"""


def import_file(
    file: Annotated[
        str,
        recording_argument('FILE', 'CSV, NPY, Parquet, MATLAB, Excel, MDF4, CAN log, bag, or URI'),
    ],
    out: Annotated[Path, option('folder to create; of several parts RECORDING_1, ...', 'RECORDING')],
    map_file: MapFile = None,
    column: Columns = None,
    time: TimeColumn = '',
    rate: Rate = None,
    dbc: Dbc = None,
    decimal: Decimal = '',
    delimiter: Delimiter = '',
    json_file: JsonFile = None,
) -> None:
    """Make a recording of a foreign file, in SI units, with its origin in the session.

    Displacement and acceleration of the chassis are resampled at 1 kHz; other quantities keep their samples.
    A gap of more than 0.125 s splits the recording.
    """
    from engine_mount import import_file as run_import
    from engine_mount.signals.mapping import Mapping

    screen = new_screen()
    place = local(file, screen)
    with screen.bar('reading', transient=True) as show:
        imported = run_import(
            place, out, columns=column or [], time=time, rate=rate, mapping=map_file or Mapping(),
            stated=stated(dbc, decimal, delimiter), progress=show,
        )  # fmt: skip
    for topic, count in imported.samples.items():
        screen.say(f'{topic:<28}{count} samples')
    for sentence in imported.notes:
        screen.note(sentence)
    for place, length in zip(imported.recordings, imported.lengths, strict=True):
        screen.say(f'recording  {place} ({length:.3f} s)')
    figures = {
        'recordings': [str(place) for place in imported.recordings],
        'lengths_s': imported.lengths,
        'samples': imported.samples,
        'notes': imported.notes,
    }
    write_figures(figures, json_file)
