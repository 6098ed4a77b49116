"""`engine-mount import`: a file of others as a recording that every command takes."""

from pathlib import Path
from typing import Annotated, Any

import typer

from engine_mount.cli.commands.options import (
    Columns,
    Dbc,
    Decimal,
    Delimiter,
    JsonFile,
    MapFile,
    Rate,
    TimeColumn,
    recording_argument,
    stated,
)
from engine_mount.cli.fetching import local
from engine_mount.cli.terminal import note, terminal

EPILOG = """Exit code: 0 when the recording is written, 1 when the file was refused, with the reason.

A column that is named without a unit must tell it in its header. Quantities are displacement,
engine_displacement, chassis_displacement, acceleration, force, current and others; a wrong one lists them.

Examples:

`engine-mount import drive.mf4 --column acceleration=az:g --out bags/drive`

`engine-mount import rack.csv --map-file rack_2.yaml --out bags/rack` - what a team agreed on

`engine-mount import Weg.xlsx --column displacement=Weg:mm --time Zeit:ms --out bags/weg`

Of several files each is imported; `engine-mount merge --different-sessions` joins what they became, and
`engine-mount cut` takes a part.
"""


def import_file(
    file: Annotated[
        str,
        recording_argument('FILE', instead='CSV, NPY, Parquet, MATLAB, Excel, MDF4, CAN log, bag, or URI'),
    ],
    out: Annotated[
        Path, typer.Option(metavar='RECORDING', help='folder to create; of several parts RECORDING_1, ...')
    ],
    map_file: MapFile = None,
    column: Columns = None,
    time: TimeColumn = '',
    rate: Rate = None,
    dbc: Dbc = None,
    decimal: Decimal = '',
    delimiter: Delimiter = '',
    json_file: JsonFile = None,
) -> None:
    """Make a recording of a file of others, in SI units, with a session that tells what it was made of.

    The displacement and the acceleration of the chassis are brought to 1 kHz; other quantities stay as they
    were sampled. A gap of more than 0.125 s parts the recording.
    """
    from engine_mount import import_file as run_import
    from engine_mount.cli.screen import progress_bar
    from engine_mount.reports.json_file import write_json
    from engine_mount.signals.mapping import Mapping

    console = terminal()
    place = local(file, console)
    with progress_bar(console, transient=True) as progress:
        task = progress.add_task('reading', total=1.0)
        imported = run_import(
            place, out, columns=column or [], time=time, rate=rate, mapping=map_file or Mapping(),
            stated=stated(dbc, decimal, delimiter),
            progress=lambda share, what: progress.update(task, completed=share, description=what),
        )  # fmt: skip
    for topic, count in imported.samples.items():
        console.print(f'{topic:<28}{count} samples', soft_wrap=True)
    for sentence in imported.notes:
        note(console, sentence)
    for place, length in zip(imported.recordings, imported.lengths, strict=True):
        console.print(f'recording  {place} ({length:.3f} s)', soft_wrap=True)
    if json_file is not None:
        write_json(_figures(imported), json_file)


def _figures(imported: Any) -> dict[str, Any]:
    return {
        'recordings': [str(place) for place in imported.recordings],
        'lengths_s': imported.lengths,
        'samples': imported.samples,
        'notes': imported.notes,
    }
