"""`engine-mount road`: what a measured road is, and the road behind a recorded acceleration."""

from pathlib import Path
from typing import Annotated

import typer

from engine_mount.cli.commands.road_arguments import Distance, HeightColumn, SpeedText
from engine_mount.cli.help import Command, Group
from engine_mount.cli.terminal import note, terminal

app = typer.Typer(
    cls=Group,
    name='road',
    help='Measured roads: class and waviness; a road from a recorded acceleration.',
    no_args_is_help=True,
    rich_markup_mode='markdown',
)

_SHOW_EPILOG = """Exit code: 0 when the file is a road, 1 with the reason when not.

Examples:

`engine-mount road show blocks.csv --figure road.png`

`engine-mount road show profile.csv --column Hoehe:mm --distance Weg:m --speed 60/3.6`
"""
_INVERT_EPILOG = """Exit code: 0 when the profile is written, 1 with the reason when not.

Examples:

`engine-mount road invert drive.csv --column az:m/s^2 --speed 60/3.6 --out road.csv` - then
`engine-mount drive --road road.csv --speed 60/3.6`

`engine-mount road invert imu.csv --column az:g --scale -1 --speed 60km/h --out road.csv`
"""


@app.command(cls=Command, epilog=_SHOW_EPILOG)
def show(
    file: Annotated[str, typer.Argument(metavar='FILE', help='table of height over distance')],
    column: HeightColumn = '',
    distance: Distance = '',
    speed: SpeedText = '',
    figure: Annotated[
        Path | None, typer.Option(metavar='FILE', help='draw heights and density (PNG)')
    ] = None,
) -> None:
    """Tell what a measured road is: length, class and waviness by ISO 8608.

    With `--speed` also which frequencies it holds at that speed.
    """
    from engine_mount import road
    from engine_mount.cli.screen import TerminalScreen
    from engine_mount.recordings.screen import Table

    console = terminal()
    found = road(file, column=column, distance=distance, speed=speed)
    TerminalScreen(console).table(Table(found.profile.name, 'll', found.rows()))
    for sentence in found.profile.notes:
        note(console, sentence)
    if figure is not None:
        from engine_mount.reports.road_picture import draw_road

        draw_road(found.profile, found.unevenness, figure)
        console.print(f'figure     {figure}', soft_wrap=True)


@app.command(cls=Command, epilog=_INVERT_EPILOG)
def invert(
    file: Annotated[
        str, typer.Argument(metavar='FILE', help='recorded vertical acceleration of the chassis')
    ],
    speed: SpeedText,
    out: Annotated[Path, typer.Option(metavar='FILE', help='write the profile (CSV)')],
    column: Annotated[
        str, typer.Option(metavar='NAME[:UNIT]', help='column, or topic.field, of the acceleration')
    ] = '',
    time: Annotated[str, typer.Option(metavar='NAME[:UNIT]', help='column of the time')] = '',
    rate: Annotated[
        float | None, typer.Option(metavar='HZ', help='samples per second, of a file without times')
    ] = None,
    scale: Annotated[float | None, typer.Option(help='factor; -1 for an axis that points down')] = None,
) -> None:
    """Make the road that gives the vehicle's chassis a recorded acceleration, from 0.9 to 50 Hz.

    So a recorded drive can be driven again, with feedback, by other policies and mounts. What one
    acceleration cannot tell is said here and in the file.
    """
    from engine_mount.signals.mapping import Mapping, with_options
    from engine_mount.signals.roads.driving import speed_of
    from engine_mount.signals.roads.inversion import UNKNOWN, inverted
    from engine_mount.signals.selection import select

    if not column:
        raise typer.BadParameter('name the acceleration: --column NAME:UNIT, as in --column az:m/s^2')
    console = terminal()
    mapping = with_options(Mapping(), [column], time, rate, scale, 'acceleration')
    driven = speed_of(speed)
    signal = select(file, mapping).signals['acceleration']
    road = inverted(signal, driven)
    road.write(out, Path(file).name)
    for sentence in (*signal.notes, *road.notes, *(f'not known: {word}' for word in UNKNOWN)):
        note(console, sentence)
    console.print(f'road       {out}', soft_wrap=True)
