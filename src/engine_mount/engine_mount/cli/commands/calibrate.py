"""`engine-mount calibrate`: from rack recordings to the specimen file that init and control load."""

from pathlib import Path
from typing import Annotated

from engine_mount.cli.commands.options import (
    Dbc,
    Decimal,
    Delimiter,
    Figure,
    JsonFile,
    MapFile,
    argument,
    flag,
    mapping_of,
    new_screen,
    option,
    stated,
)
from engine_mount.cli.fetching import local
from engine_mount.cli.help import Command, group
from engine_mount.cli.rack import (
    EXIT_CODES,
    Base,
    Name,
    Out,
    file_values,
    progress,
    publish,
    rack_mapping,
)

app = group('calibrate', 'Calibrate an actuator from rack recordings: force law, gap curves, their files.')

_ACTUATOR_EPILOG = (
    EXIT_CODES
    + """

`engine-mount calibrate actuator force.csv --name left --out left.yaml`

`engine-mount calibrate actuator run1.csv run2.csv --figure force.png`

`engine-mount calibrate actuator F.csv --column gap=Spalt:mm --column force=Kraft:kN`

`engine-mount calibrate actuator F.blf --dbc rack.dbc --column gap=Rack.Spalt` - of a CAN log

`engine-mount calibrate actuator bags/ramp_349um bags/ramp_400um ...` - MCAP, one gap each

Columns are `gap_um`, `current_a`, `force_n`, or the same with another unit (mm, in, ma, kn, lbf), of CSV,
MATLAB, Excel, MDF4 and others.
"""
)
_INDUCTANCE_EPILOG = (
    EXIT_CODES
    + """

`engine-mount calibrate inductance cold/*.csv warm/*.csv --base left.yaml --out left.yaml`

`engine-mount calibrate inductance a.csv b.csv ... --gap a.csv=300 --coil-temperature b.csv=80`

Columns are `current_a` and `inductance_mh`, or `current_a`, `current_rate_a_per_s` and
`flux_rate_t_per_s`; `gap_um` and `coil_temperature_c` if no option and no file name (`_349um`, `_+80degC`)
gives them.
"""
)
_RACK_EPILOG = (
    EXIT_CODES
    + """

`engine-mount calibrate rack --out rack --celsius 20 --celsius 80` - then `calibrate actuator rack/force.csv`,
`calibrate inductance rack/ripple_*.csv`, `identify friction --train rack/friction_*.csv`
"""
)

Files = Annotated[
    list[str], argument('files of any format that is read, recordings or their folders, or URIs')
]
Columns = Annotated[
    list[str] | None,
    option('column of a quantity, and its unit', 'NAME=HEADER[:UNIT]', None, '--column'),
]
Gaps = Annotated[list[str] | None, option('air gap of a file, um; may be repeated', 'FILE=UM', None, '--gap')]


@app.command(cls=Command, epilog=_ACTUATOR_EPILOG)
def actuator(
    files: Files,
    columns: Columns = None,
    map_file: MapFile = None,
    dbc: Dbc = None,
    decimal: Decimal = '',
    delimiter: Delimiter = '',
    gaps: Gaps = None,
    base: Base = None,
    name: Name = '',
    out: Out = None,
    json_file: JsonFile = None,
    figure: Figure = None,
) -> None:
    """Fit the force law, Eqs (3) and (4), to measured points of gap, current and force.

    An actuator that does not saturate gets the parabola of Eq (3) alone. The law holds within the measured
    gaps and up to the largest current; there it is positive, rises with the current and falls with the gap.
    Forces that contradict this beyond their noise, outliers, a zero of the load cell, and too few gaps or
    currents are refused. Then no file is written.
    """
    from engine_mount.identification import calibrate

    screen = new_screen()
    places = [local(file, screen) for file in files]
    mapping = rack_mapping(columns or [], mapping_of(map_file), stated(dbc, decimal, delimiter))
    values = file_values(places, gaps or [])
    with progress() as bar:
        result = calibrate.actuator(places, columns=mapping, values=values, base=base or '', progress=bar)
    publish(result, json_file, figure, out, name)


@app.command(cls=Command, epilog=_INDUCTANCE_EPILOG)
def inductance(
    files: Files,
    gaps: Gaps = None,
    temperatures: Annotated[
        list[str] | None,
        option('of a file, or of all files without one', '[FILE=]DEGC', None, '--coil-temperature'),
    ] = None,
    rest_current: Annotated[float | None, option('A; default: that of the base', least=1e-3)] = None,
    crossing_inductance: Annotated[float | None, option('mH; default: that of the base', least=1e-3)] = None,
    turns_area: Annotated[
        float | None, option('turns times core area, m^2; default: that of the base', least=1e-6)
    ] = None,
    supply: Annotated[
        float | None, option('voltage of the bridge meanwhile, V; default: that of the base', least=1e-3)
    ] = None,
    coefficient: Annotated[
        float | None, option('rise of the resistivity of the core per kelvin, 1/K')
    ] = None,
    held_out: Annotated[
        list[float] | None,
        option('degC; recordings there only judge the compensation', None, None, '--held-out-temperature'),
    ] = None,
    columns: Columns = None,
    map_file: MapFile = None,
    dbc: Dbc = None,
    decimal: Decimal = '',
    delimiter: Delimiter = '',
    base: Base = None,
    name: Name = '',
    out: Out = None,
    json_file: JsonFile = None,
    figure: Figure = None,
) -> None:
    """Fit the gap curves L_0.2 and i_20 (Fig. 4) to coil ripple recorded at known gaps.

    The temperature with most recordings is that of the curves. Recordings at a second temperature measure
    the compensation; recordings at only one temperature are refused.
    """
    from engine_mount.identification import calibrate

    screen = new_screen()
    places = [local(file, screen) for file in files]
    mapping = rack_mapping(columns or [], mapping_of(map_file), stated(dbc, decimal, delimiter))
    values = file_values(places, gaps or [], temperatures or [])
    with progress():
        result = calibrate.inductance(
            places, columns=mapping, values=values, rest_current=rest_current,
            crossing_inductance=crossing_inductance and 1e-3 * crossing_inductance, turns_area=turns_area,
            supply=supply, coefficient=coefficient, held_out=held_out or (), base=base or '',
        )  # fmt: skip
    publish(result, json_file, figure, out, name)


@app.command(cls=Command, epilog=_RACK_EPILOG)
def rack(
    out: Annotated[Path, option('folder for the recordings', 'FOLDER')],
    seed: Annotated[int, option('seed of the noise, and of the actuator with --drawn')] = 0,
    noise: Annotated[float, option('relative standard deviation of each sensor')] = 0.01,
    drawn: Annotated[
        bool, flag('--drawn', 'another actuator with other pads, drawn around the default ones')
    ] = False,
    celsius: Annotated[
        list[float] | None,
        option('coil temperature of the ripple, degC; repeatable; default: 20 and 80'),
    ] = None,
) -> None:
    """Write recordings of the simulated rack: force.csv, ripple at 16 fixed gaps, friction of the pads."""
    from engine_mount.identification import calibrate

    with progress() as bar:
        files = calibrate.rack(
            out, seed=seed, noise=noise, drawn=drawn, celsius=celsius or (20.0, 80.0), progress=bar
        )
    new_screen().say(f'{len(files)} recordings in {out}')
