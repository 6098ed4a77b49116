"""`engine-mount calibrate`: from rack recordings to the specimen file that init and control load."""

from pathlib import Path
from typing import Annotated

import typer
from rich.table import Table

from engine_mount.cli.calibration.given import given_ripple, orders_of, per_file, positive, rack_mapping
from engine_mount.cli.calibration.written import write_results
from engine_mount.cli.commands.options import Dbc, Decimal, Delimiter, MapFile, mapping_of, stated
from engine_mount.cli.fetching import local
from engine_mount.cli.help import Command, Group
from engine_mount.cli.terminal import note, terminal

app = typer.Typer(
    cls=Group,
    name='calibrate',
    help='Calibrate an actuator from rack recordings: force law, gap curves, their files.',
    no_args_is_help=True,
    rich_markup_mode='markdown',
)

_ACTUATOR_EPILOG = """Exit code: 0 when all that was asked for is written, 1 with the reason when not.

Examples:

`engine-mount calibrate actuator force.csv --name left --out left.yaml`

`engine-mount calibrate actuator run1.csv run2.csv --orders 4,4,4,2,4 --figure force.png`

`engine-mount calibrate actuator F.csv --column gap=Spalt:mm --column force=Kraft:kN`

`engine-mount calibrate actuator F.blf --dbc rack.dbc --column gap=Rack.Spalt` - of a CAN log

`engine-mount calibrate actuator bags/ramp_349um bags/ramp_400um ...` - MCAP, one gap each

Columns are `gap_um`, `current_a`, `force_n`, or the same with another unit (mm, in, ma, kn, lbf), of CSV,
MATLAB, Excel, MDF4 and others.
"""
_INDUCTANCE_EPILOG = """Exit code: 0 when all that was asked for is written, 1 with the reason when not.

Examples:

`engine-mount calibrate inductance ripple_*um.csv --coil-temperature 20 --base left.yaml --out left.yaml`

`engine-mount calibrate inductance a.csv b.csv ... --gap a.csv=300 --gap b.csv=320`

`engine-mount calibrate inductance cold/*.csv warm/*.csv` - two temperatures: compensation is measured

Columns are `current_a` and `inductance_mh`, or `current_a`, `current_rate_a_per_s` and
`flux_rate_t_per_s`; `gap_um` and `coil_temperature_c` where no option and no file name (`_349um`, `_+80degC`)
tells them.
"""
_RACK_EPILOG = """Exit code: 0 when all that was asked for is written, 1 with the reason when not.

Example:

`engine-mount calibrate rack --out rack --celsius 20 --celsius 80` - then `calibrate actuator rack/force.csv`,
`calibrate inductance rack/ripple_*.csv`, `identify friction --train rack/friction_*.csv`
"""

Files = Annotated[
    list[str], typer.Argument(help='files of any format that is read, recordings or their folders, or URIs')
]
Columns = Annotated[
    list[str] | None,
    typer.Option('--column', metavar='NAME=HEADER[:UNIT]', help='which column is what, and its unit'),
]
Gaps = Annotated[
    list[str] | None, typer.Option('--gap', metavar='FILE=UM', help='air gap of a file, um; may be repeated')
]
Base = Annotated[
    Path | None, typer.Option(help='specimen that gives all other values; default: the shipped one')
]
Name = Annotated[str, typer.Option(help='name of the specimen; default: that of the base')]
Out = Annotated[Path | None, typer.Option(metavar='FILE', help='write the specimen (YAML)')]
JsonFile = Annotated[
    Path | None, typer.Option('--json', metavar='FILE', help='write parameters and errors to this file')
]
Figure = Annotated[Path | None, typer.Option(metavar='FILE', help='draw measurement and result (PNG)')]


@app.command(cls=Command, epilog=_ACTUATOR_EPILOG)
def actuator(
    files: Files,
    orders: Annotated[
        str, typer.Option(help='numbers of coefficients of a1 .. a5; 18 in all, as in Table 1')
    ] = '4,4,4,2,4',
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

    Refused are outliers, too few gaps or currents, and a law that is not positive, rising with the current
    and falling with the gap within the measured range. Then no file is written.
    """
    from engine_mount.cli.screen import progress_bar
    from engine_mount.identification.actuator.fit import fit_force_law
    from engine_mount.identification.rack.force_points import read_force
    from engine_mount.identification.rack.given import GivenValues
    from engine_mount.identification.specimen import check_targets, with_force_law
    from mount_models.specimen import chosen_specimen

    console = terminal()
    check_targets(out, json_file, figure)
    starting = chosen_specimen(str(base) if base else '')
    places = [local(file, console) for file in files]
    mapping = rack_mapping(columns or [], mapping_of(map_file), stated(dbc, decimal, delimiter))
    given = GivenValues(per_file(gaps or [], places, '--gap', 1e-6), {})
    chosen_orders = orders_of(orders)
    with progress_bar(console, transient=True) as progress:
        task = progress.add_task('reading', total=None)
        points = read_force(places, mapping, given)
        progress.update(task, description='fitting')
        fit = fit_force_law(
            points.gap,
            points.current,
            points.force,
            chosen_orders,
            force_floor=_FLOOR * float(points.force.max()),
            progress=lambda done, total: progress.update(task, completed=done, total=total),
        )
    specimen = with_force_law(starting, name, fit, places)
    law = fit.law
    table = Table(
        title=f'force law of {specimen.name!r}, {sum(chosen_orders)} parameters', title_justify='left'
    )
    table.add_column('air gap (um)', justify='right')
    table.add_column('rms error (N)', justify='right')
    for gap, rms in zip(fit.gaps, fit.gap_rms, strict=True):
        table.add_row(f'{gap * 1e6:.1f}', f'{rms:.2f}')
    console.print(table)
    console.print(
        f'{fit.points} points; error rms {fit.relative_rms:.2%} of the force above 20 N, worst '
        f'{fit.worst:.2%}; rms {fit.rms_error:.2f} N, largest {fit.largest_error:.2f} N',
        soft_wrap=True,
    )
    console.print(
        f'positive, rising with the current and falling with the gap within {law.gap_low * 1e6:.1f} .. '
        f'{law.gap_high * 1e6:.1f} um and 0 .. {law.current_high:.2f} A; refused beyond',
        soft_wrap=True,
    )
    if fit.continued:
        console.print(
            f'measured from {fit.lowest_current:.2f} A on; below, the law is continued to 0 N at 0 A',
            soft_wrap=True,
        )
    if figure is not None:
        from engine_mount.identification.calibration_pictures import draw_force_law

        draw_force_law(points, law, figure)
        console.print(f'figure     {figure}', soft_wrap=True)
    write_results(console, specimen, {'specimen': specimen.name, **fit.figures()}, json_file, out)


@app.command(cls=Command, epilog=_INDUCTANCE_EPILOG)
def inductance(
    files: Files,
    gaps: Gaps = None,
    temperatures: Annotated[
        list[str] | None,
        typer.Option(
            '--coil-temperature', metavar='[FILE=]DEGC', help='of a file, or of all that do not tell theirs'
        ),
    ] = None,
    rest_current: Annotated[float | None, typer.Option(help='A; default: that of the base')] = None,
    crossing_inductance: Annotated[float | None, typer.Option(help='mH; default: that of the base')] = None,
    turns_area: Annotated[
        float | None, typer.Option(help='turns times core area, m^2; default: that of the base')
    ] = None,
    supply: Annotated[
        float | None, typer.Option(help='voltage of the bridge meanwhile, V; default: that of the base')
    ] = None,
    coefficient: Annotated[
        float | None, typer.Option(help='rise of the resistivity of the core per kelvin, 1/K')
    ] = None,
    held_out: Annotated[
        list[float] | None,
        typer.Option('--held-out-temperature', help='degC; recordings there only judge the compensation'),
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

    The temperature with most recordings is that of the curves. With recordings at a second one the
    compensation is measured, else it is stated from the conductivity's coefficient and the base's force law.
    """
    from engine_mount.cli.screen import TerminalScreen, progress_bar
    from engine_mount.identification.coil.inductance import GapOrder, calibrate_inductance
    from engine_mount.identification.rack.ripple_recordings import read_ripple
    from engine_mount.identification.specimen import check_targets, with_gap_curves
    from mount_models.coil.temperature import CONDUCTIVITY_COEFFICIENT
    from mount_models.specimen import chosen_specimen

    console = terminal()
    check_targets(out, json_file, figure)
    starting = chosen_specimen(str(base) if base else '')
    places = [local(file, console) for file in files]
    order = GapOrder(
        rest_current=positive(rest_current, '--rest-current', 'A') or starting.rest_current,
        crossing_inductance=1e-3 * (positive(crossing_inductance, '--crossing-inductance', 'mH') or 0.0)
        or starting.crossing_inductance,
        coefficient=CONDUCTIVITY_COEFFICIENT if coefficient is None else coefficient,
        held_out=tuple(held_out or ()),
    )
    area = positive(turns_area, '--turns-area', 'm^2') or starting.turns_area
    mapping = rack_mapping(columns or [], mapping_of(map_file), stated(dbc, decimal, delimiter))
    given = given_ripple(places, gaps or [], temperatures or [])
    with progress_bar(console, transient=True) as progress:
        task = progress.add_task('reading', total=2)
        recordings = read_ripple(places, mapping, given, area)
        progress.update(task, description='fitting', completed=1)
        result = calibrate_inductance(recordings, starting.force_law, order)
        progress.update(task, completed=2)
    from dataclasses import replace

    starting = replace(
        starting,
        rest_current=order.rest_current,
        crossing_inductance=order.crossing_inductance,
        bridge=starting.bridge._replace(
            link_voltage=positive(supply, '--supply', 'V') or starting.bridge.link_voltage
        ),
    )
    specimen = with_gap_curves(
        starting, name, result.calibration, result.compensation, result.compensated_by, area, places
    )
    screen = TerminalScreen(console)
    for table in result.tables():
        screen.table(table)
    for sentence in result.sentences():
        console.print(sentence, soft_wrap=True)
    for warning in result.warnings:
        note(console, warning, 'warning')
    if figure is not None:
        from engine_mount.identification.calibration_pictures import draw_gap_curves

        draw_gap_curves(result, order, figure)
        console.print(f'figure     {figure}', soft_wrap=True)
    write_results(console, specimen, {'specimen': specimen.name, **result.figures()}, json_file, out)


@app.command(cls=Command, epilog=_RACK_EPILOG)
def rack(
    out: Annotated[Path, typer.Option(metavar='FOLDER', help='folder for the recordings')],
    seed: Annotated[int, typer.Option(help='seed of the noise, and of the actuator with --drawn')] = 0,
    noise: Annotated[float, typer.Option(help='relative standard deviation of each sensor')] = 0.01,
    drawn: Annotated[
        bool, typer.Option('--drawn', help='another actuator with other pads, drawn around the default ones')
    ] = False,
    celsius: Annotated[
        list[float] | None, typer.Option(help='coil temperature of the ripple, degC; may be repeated')
    ] = None,
) -> None:
    """Write recordings of the simulated rack: force.csv, ripple at 16 fixed gaps, friction of the pads."""
    from dataclasses import replace

    from engine_mount.cli.screen import progress_bar
    from mount_models.friction.coefficient import FrictionCoefficients
    from mount_models.friction.contact import FrictionContact
    from mount_sim.rack.coil import Rack, drawn_rack, write_force, write_ripple
    from mount_sim.rack.friction import drawn_friction, write_friction

    console = terminal()
    chosen = replace(drawn_rack(seed) if drawn else Rack(seed=seed), noise=noise)
    pads = drawn_friction(seed) if drawn else (FrictionContact(), FrictionCoefficients())
    out.mkdir(parents=True, exist_ok=True)
    with progress_bar(console, transient=True) as progress:
        each = tuple(celsius or (20.0,))
        task = progress.add_task('measuring', total=2 + len(each))
        written = [write_force(chosen, out / 'force.csv')]
        progress.advance(task)
        for temperature in each:
            written += write_ripple(chosen, out, temperature=temperature)
            progress.advance(task)
        written += write_friction(out, *pads, noise, seed)
        progress.advance(task)
    console.print(f'{len(written)} recordings in {out}', soft_wrap=True)


_FLOOR = 0.006  # chosen: weights as 2 N of 330 N
