"""`engine-mount identify`: from recordings of a rack to parameters."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer
from rich.console import Console
from rich.table import Table

from mount_cli.completion.values import recordings
from mount_cli.help import Command, Group
from mount_cli.terminal import note, terminal

if TYPE_CHECKING:
    from mount_identification.friction.identify import Identification

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

`engine-mount identify friction --train rig.csv --channel friction_force=cell:kN --step ladder`
"""


@app.callback()
def _top() -> None:
    """Keep sub-commands even while there is only one."""


@app.command(cls=Command, epilog=EPILOG)
def friction(
    train: Annotated[
        list[Path] | None, typer.Option(metavar='FILE...', help='recordings to fit: CSV, MCAP or JSON')
    ] = None,
    held_out: Annotated[
        list[Path] | None, typer.Option(metavar='FILE...', help='recordings that no fit sees, to judge by')
    ] = None,
    file: Annotated[
        list[Path] | None,
        typer.Option(metavar='FILE...', help='train on each, predict each other one; of one, its halves'),
    ] = None,
    step: Annotated[str, typer.Option(help='auto, or only: ramp (step 1), sawtooth, ladder')] = 'auto',
    channel: Annotated[
        list[str] | None,
        typer.Option(
            metavar='NAME=COLUMN:UNIT',
            help='CSV or JSON column, or MCAP topic.field, of a quantity; repeatable',
        ),
    ] = None,
    clamp: Annotated[
        str,
        typer.Option(help="JSON: normal force from the band's pull while sliding, at rest, or none"),
    ] = 'sliding',
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
    from mount_cli.commands.calibrate import note_foreign
    from mount_cli.screen import progress_bar
    from mount_identification.friction.files import parsed_channels
    from mount_identification.friction.identify import IdentifyOrder, figures, identify
    from mount_identification.specimen import check_targets, foreign_parts, with_friction
    from mount_models.specimen import chosen_specimen, friction_contact, save_specimen
    from mount_report.json_file import write_json

    console = terminal()
    check_targets(out, json_file, figure)
    starting = chosen_specimen(str(base) if base else '')
    order = IdentifyOrder(
        train or [], held_out or [], file or [], step, clamp, parsed_channels(channel or []), seed,
        friction_contact(starting.friction),
    )  # fmt: skip
    with progress_bar(console, transient=True) as progress:
        task = progress.add_task('reading', total=1.0)
        found = identify(order, lambda law, share: progress.update(task, description=law, completed=share))
    specimen = with_friction(starting, name, found) if out is not None else None
    _print(found, console)
    if figure is not None:
        from mount_identification.friction.picture import draw_identification

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
    from mount_identification.drift.identify import figures, identify_drift
    from mount_identification.specimen import check_targets
    from mount_models.specimen import chosen_specimen
    from mount_report.json_file import write_json

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
        from mount_identification.drift.picture import draw_drift

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


def _print(found: 'Identification', console: Console) -> None:
    from mount_identification.friction.identify import chosen_fit, figures

    for sentence in found.notes:
        note(console, sentence)
    result = figures(found)
    if found.ramps:
        console.print(_step_1(result['step_1']))
    if found.coefficients is not None:
        fit = chosen_fit(found)
        console.print(
            f'steps 2, 3: {len(found.lines)} strokes; Eqs (13), (14) meet them within {fit.a_rms:.4f} (a) '
            f'and {fit.b_rms_mm:.2f} 1/mm (b) rms',
            soft_wrap=True,
        )
        for variant, values in result['variants'].items():
            if values['held_out_error'] is not None:
                console.print(
                    f'  form of b: {variant}: {_percent(values["held_out_error"])} held out',
                    soft_wrap=True,
                )
    for each in result.get('validation', []):
        console.print(
            f'held out {each["recording"]}: full model {_percent(each["full_error"])}, simplified '
            f'{_percent(each["simplified_error"])}; macroslip {_percent(each["full_macroslip_error"])}, '
            f'{_percent(each["simplified_macroslip_error"])}',
            soft_wrap=True,
        )
    if 'pairs' in result:
        console.print(_pairs(result['pairs']))
    if 'ladder' in result:
        console.print(_ladder(result['ladder']))
        console.print(f'best: {result["best"]}', soft_wrap=True)


def _step_1(ramps: list[dict]) -> Table:
    table = Table('step 1', 'c_Re (N/m)', 'c_R (N/m)', 'd_R (N s/m)', 'p (N/m)', 'T (s)')
    for each in ramps:
        contact, spread, printed = each['contact'], each['deviation'], each['printed']
        table.add_row(
            each['recording'],
            *(
                f'{contact[name]:.4g} ± {spread[name]:.1g}'
                for name in ('contact_stiffness', 'tangential_stiffness', 'tangential_damping')
            ),
            f'{each["machine_stiffness"]:.4g}',
            f'{each["time_constant"]:.4f}',
        )
        with_p, without = (printed[f'tangential_stiffness_c_xi_{which}'] for which in ('with_p', 'without_p'))
        table.add_row(
            '  Eqs (10), (11) as printed',
            _printed(printed['contact_stiffness']),
            f'{_printed(with_p)}, {_printed(without)} (c_xi with, without p)',
            _printed(printed['tangential_damping']),
            style='dim',
        )
    return table


def _printed(entry: dict[str, float]) -> str:
    return f'{entry["value"]:.4g} ({100 * entry["error"]:+.1f} %)'


def _pairs(pairs: list[dict]) -> Table:
    names = list(dict.fromkeys(pair['train'] for pair in pairs))
    table = Table('held-out error', *(name for name in pairs[0]['ladder']))
    table.caption = ', '.join(f'{number}: {name}' for number, name in enumerate(names, 1))
    for pair in pairs:
        table.add_row(
            f'{names.index(pair["train"]) + 1} -> {names.index(pair["held_out"]) + 1}',
            *(_percent(entry['held_out_error']) for entry in pair['ladder'].values()),
        )
    return table


def _ladder(ladder: dict[str, dict]) -> Table:
    table = Table('law', 'held out', 'training', 'parameters')
    for name, entry in ladder.items():
        first = next(iter(entry['parameters'].values()))
        count = len(first) if isinstance(first, dict) else len(entry['parameters'])
        table.add_row(name, _percent(entry['held_out_error']), _percent(entry['train_error']), str(count))
    return table


def _percent(value: float | None) -> str:
    return '-' if value is None else f'{100 * value:.1f} %'
