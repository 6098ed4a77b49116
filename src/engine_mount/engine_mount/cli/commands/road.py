"""`engine-mount road`: what a measured road is, and the road behind a recorded acceleration."""

from pathlib import Path
from typing import Annotated

import typer

from engine_mount.cli.commands.options import (
    Distance,
    Figure,
    Lateral,
    Rate,
    Scale,
    SpeedText,
    TimeColumn,
    argument,
    new_screen,
    option,
)
from engine_mount.cli.help import Command, group

app = group('road', 'Measured roads: class and waviness; a road from a recorded acceleration.')

_SHOW_EPILOG = """Exit code: 0 when the file is a road, 2 with the reason when not.

Examples:

`engine-mount road show blocks.crg --lateral 0.75 --figure road.png`

`engine-mount road show profile.csv --column Hoehe:mm --distance Weg:m --speed 60/3.6`
"""
_INVERT_EPILOG = """Exit code: 0 when the profile is written, 2 with the reason when not.

Examples:

`engine-mount road invert drive.csv --column az:m/s^2 --speed 60/3.6 --out road.csv` - then
`engine-mount drive --road road.csv --speed 60/3.6`

`engine-mount road invert imu.csv --column az:g --scale -1 --speed 60km/h --out road.csv`
"""


@app.command(cls=Command, epilog=_SHOW_EPILOG)
def show(
    file: Annotated[str, argument('height over distance: a table, or OpenCRG', 'FILE')],
    lateral: Lateral = 0.0,
    column: Annotated[str, option('column of the height', 'NAME[:UNIT]')] = '',
    distance: Distance = '',
    speed: SpeedText = '',
    figure: Figure = None,
) -> None:
    """Print length, class and waviness (ISO 8608) of a measured road.

    With `--speed` also its frequencies at that speed.
    """
    from engine_mount import road
    from engine_mount.recordings.screen import Table

    screen = new_screen()
    found = road(file, lateral=lateral, column=column, distance=distance, speed=speed)
    screen.table(Table(found.profile.name, 'll', found.rows()))
    for sentence in found.profile.notes:
        screen.note(sentence)
    if figure is not None:
        from engine_mount.reports.drawing.picture import draw_road

        draw_road(found.profile, found.unevenness, figure)
        screen.say(f'figure     {figure}')


@app.command(cls=Command, epilog=_INVERT_EPILOG)
def invert(
    file: Annotated[str, argument('recorded vertical acceleration of the chassis', 'FILE')],
    speed: SpeedText,
    out: Annotated[Path, option('write the profile (CSV)', 'FILE')],
    column: Annotated[str, option('column, or topic.field, of the acceleration', 'NAME[:UNIT]')] = '',
    time: TimeColumn = '',
    rate: Rate = None,
    scale: Scale = None,
) -> None:
    """Make the road that gives the vehicle's chassis a recorded acceleration, from 0.9 to 50 Hz.

    So other policies and mounts can repeat a recorded drive, with feedback. The command and the file list
    the limits of one acceleration.
    """
    from engine_mount.signals.mapping import Mapping, with_options
    from engine_mount.signals.roads.driving import speed_of
    from engine_mount.signals.roads.inversion import UNKNOWN, inverted
    from engine_mount.signals.selection import select

    if not column:
        raise typer.BadParameter('name the acceleration: --column NAME:UNIT, as in --column az:m/s^2')
    screen = new_screen()
    mapping = with_options(Mapping(), [column], time, rate, scale, 'acceleration')
    driven = speed_of(speed)
    signal = select(file, mapping).signals['acceleration']
    road = inverted(signal, driven)
    road.write(out, Path(file).name)
    for sentence in (*signal.notes, *road.notes, *(f'not known: {word}' for word in UNKNOWN)):
        screen.note(sentence)
    screen.say(f'road       {out}')
