"""`engine-mount identify`: from recordings of a rack to parameters."""

from pathlib import Path
from typing import Annotated

import typer

from engine_mount.cli.commands.options import (
    Dbc,
    Decimal,
    Delimiter,
    MapFile,
    Rate,
    TimeColumn,
    mapping_of,
    stated,
)
from engine_mount.cli.completion import recordings
from engine_mount.cli.fetching import local
from engine_mount.cli.help import Command, Group
from engine_mount.cli.terminal import terminal

app = typer.Typer(
    cls=Group,
    name='identify',
    help='Identify parameters from recordings of a rack.',
    no_args_is_help=True,
    rich_markup_mode='markdown',
)

EPILOG = """Exit code: 0 when all that was asked for is written, 1 with the reason when not.

Examples:

`engine-mount identify friction --train ramp.csv 40N.csv 120N.csv --held-out 80N.csv --base left.yaml
--name left --out left.yaml` - into the specimen file that init and control load

`engine-mount identify friction --file a.json b.json c.json` - trained on each, tried on each other one

`engine-mount identify friction --train rig.mat --column friction_force=cell:lbf --step ladder` - any format

`engine-mount identify friction --train rig.blf --dbc rig.dbc --step ladder` - or of a CAN log

`engine-mount identify friction --train a.mf4 --held-out b.mf4 --map-file rig_2.yaml` - what a team agreed on
"""


@app.callback()
def _top() -> None:
    """Keep sub-commands even while there is only one."""


@app.command(cls=Command, epilog=EPILOG)
def friction(
    train: Annotated[
        list[str] | None,
        typer.Option(metavar='FILE...', help='recordings to fit: files of any format, recordings, URIs'),
    ] = None,
    held_out: Annotated[
        list[str] | None, typer.Option(metavar='FILE...', help='recordings that no fit sees, to judge by')
    ] = None,
    file: Annotated[
        list[str] | None,
        typer.Option(metavar='FILE...', help='train on each, predict each other one; of one, its halves'),
    ] = None,
    step: Annotated[str, typer.Option(help='auto, or only: ramp (step 1), sawtooth, ladder')] = 'auto',
    channel: Annotated[
        list[str] | None,
        typer.Option(
            '--channel',
            '--column',
            metavar='NAME=COLUMN:UNIT',
            help='column, or MCAP topic.field, of a quantity; repeatable',
        ),
    ] = None,
    map_file: MapFile = None,
    time: TimeColumn = '',
    rate: Rate = None,
    dbc: Dbc = None,
    decimal: Decimal = '',
    delimiter: Delimiter = '',
    clamp: Annotated[
        str,
        typer.Option(help="JSON: normal force from the band's pull while sliding, at rest, or none"),
    ] = 'sliding',
    zero: Annotated[
        str,
        typer.Option(
            help='zero of the force: law (from the loop), rest (before the motion), recorded; default: law '
            'for JSON of a damper, else recorded'
        ),
    ] = '',
    seed: Annotated[int, typer.Option(help='seed of the starts of the searches')] = 0,
    json_file: Annotated[
        Path | None, typer.Option('--json', metavar='FILE', help='write all figures to this file')
    ] = None,
    base: Annotated[
        Path | None, typer.Option(help='specimen that gives all other values; default: the shipped one')
    ] = None,
    name: Annotated[str, typer.Option(help='name of the specimen; default: that of the base')] = '',
    out: Annotated[Path | None, typer.Option(metavar='FILE', help='write the specimen (YAML)')] = None,
    figure: Annotated[Path | None, typer.Option(metavar='FILE', help='draw every step (PNG)')] = None,
) -> None:
    """Identify the friction contact, and which law is worth its parameters.

    Ramp-and-hold recordings give its springs and damper, sawtooths the coefficient of friction; every law of
    the ladder is fitted to the same strokes. Judge by the held-out error: rms error over rms force.
    """
    from engine_mount.cli.calibration.friction_screen import print_friction
    from engine_mount.cli.calibration.written import note_foreign
    from engine_mount.cli.screen import progress_bar
    from engine_mount.identification.friction.channels import friction_mapping
    from engine_mount.identification.friction.figures import figures
    from engine_mount.identification.friction.found import IdentifyOrder
    from engine_mount.identification.friction.identify import identify
    from engine_mount.identification.specimen import check_targets, foreign_parts, with_friction
    from engine_mount.identification.specimen_file import save_specimen
    from engine_mount.reports.json_file import write_json
    from engine_mount.signals.mapping import with_options
    from mount_models.specimen import chosen_specimen, friction_contact

    console = terminal()
    check_targets(out, json_file, figure)
    starting = chosen_specimen(str(base) if base else '')
    mapping = with_options(mapping_of(map_file), (), time, rate)
    mapping = friction_mapping(channel or [], mapping, stated(dbc, decimal, delimiter))
    order = IdentifyOrder(
        *([local(each, console) for each in places or []] for places in (train, held_out, file)),
        step, clamp, zero, mapping, seed, friction_contact(starting.friction),
    )  # fmt: skip
    with progress_bar(console, transient=True) as progress:
        task = progress.add_task('reading', total=1.0)
        found = identify(order, lambda law, share: progress.update(task, description=law, completed=share))
    specimen = with_friction(starting, name, found) if out is not None else None
    print_friction(found, console)
    if figure is not None:
        from engine_mount.identification.friction.picture import draw_identification

        draw_identification(found, figure)
        console.print(f'figure {figure}', soft_wrap=True)
    if json_file is not None:
        write_json(figures(found), json_file)
    if out is not None and specimen is not None:
        save_specimen(specimen, out)
        console.print(f'specimen {out}', soft_wrap=True)
        note_foreign(console, foreign_parts(specimen), specimen.name)


DRIFT_EPILOG = """Exit code: 0 when all that was asked for is written, 1 with the reason when not.

Examples:

`engine-mount identify drift bags/monday bags/tuesday bags/friday --figure wear.png`

`engine-mount identify drift a b c --hours a=120 --hours b=180 --hours c=260` - by a counter
"""


@app.command(cls=Command, epilog=DRIFT_EPILOG)
def drift(
    recordings: Annotated[
        list[Path],
        typer.Argument(
            metavar='RECORDING...',
            help='runs or recordings with an initialisation',
            autocompletion=recordings,
        ),
    ],
    specimen: Annotated[
        Path | None, typer.Option(help='specimen file of this actuator; default: the shipped one')
    ] = None,
    hours: Annotated[
        list[str] | None,
        typer.Option(metavar='RECORDING=H', help='hours of all recordings; default: when sessions began'),
    ] = None,
    json_file: Annotated[
        Path | None, typer.Option('--json', metavar='FILE', help='write all figures to this file')
    ] = None,
    figure: Annotated[Path | None, typer.Option(metavar='FILE', help='draw it (PNG)')] = None,
) -> None:
    """Tell wear of the pads per hour, with its uncertainty, and the travel left until the law's range ends.

    A line through the contact gaps of all recordings, weighted by the deviations that the initialisations
    stated; where gaps scatter more than that, by as much less sure. Offset current and, where a rack's load
    cells are recorded, friction likewise from their scatter.
    """
    from engine_mount.identification.drift.identify import figures, identify_drift
    from engine_mount.identification.specimen import check_targets
    from engine_mount.reports.json_file import write_json
    from mount_models.specimen import chosen_specimen

    console = terminal()
    check_targets(json_file, figure)
    told = {}
    for setting in hours or []:
        named, equals, text = setting.rpartition('=')
        meant = [path for path in recordings if str(path) == named or path.name == named]
        try:
            value = float(text)
        except ValueError:
            value = float('nan')
        if not equals or len(meant) != 1 or value - value != 0.0:
            raise typer.BadParameter(f'--hours {setting}: write RECORDING=H, as in bags/monday=120')
        told[meant[0]] = value
    result = identify_drift(recordings, chosen_specimen(str(specimen) if specimen else ''), told)
    if figure is not None:
        from engine_mount.identification.drift.picture import draw_drift

        draw_drift(result, figure)
        console.print(f'figure {figure}', soft_wrap=True)
    if json_file is not None:
        write_json(figures(result), json_file)
    lines = [('contact gap', result.gap, 1e6, 'um/h'), ('offset current', result.current, 1e3, 'mA/h')]
    if result.friction is not None:
        lines.append(('friction', result.friction, 1.0, '1/h'))
    for label, line, factor, unit in lines:
        std = 'unknown' if line.slope_std != line.slope_std else f'{factor * line.slope_std:.2g}'
        console.print(f'{label}: {factor * line.slope:+.3g} +- {std} {unit} (one deviation)', soft_wrap=True)
    console.print(
        f'{1e6 * result.left:.1f} +- {1e6 * result.left_std:.2g} um left until the contact gap reaches '
        f'{1e6 * result.limit:.1f} um, where the pressed gap leaves the range of the law'
        + (
            f'; at this wear in {result.hours_left:.3g} h'
            if result.hours_left is not None
            else '; no wear beyond two deviations is seen'
        ),
        soft_wrap=True,
    )
