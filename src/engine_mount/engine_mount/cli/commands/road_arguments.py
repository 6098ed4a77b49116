"""Options that say which road, and how it is driven; for `drive` and `road`."""

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING, Annotated, Any

import typer

if TYPE_CHECKING:
    from engine_mount.drives.external_excitation import ExternalExcitation
    from engine_mount.signals.roads.iso8608 import RoadProfile

Lateral = Annotated[
    float, typer.Option(metavar='M', help='road: track of an OpenCRG file, m left of its reference line')
]
HeightColumn = Annotated[str, typer.Option('--column', metavar='NAME[:UNIT]', help='column of the height')]
Distance = Annotated[
    str,
    typer.Option(
        metavar='NAME[:UNIT]|M', help='road: column of the distance, or the distance between two heights'
    ),
]
SpeedText = Annotated[
    str, typer.Option(metavar='M/S|FILE', help='road: 60/3.6, 60km/h, or a file of the speed over time')
]
ContactLength = Annotated[
    float | None,
    typer.Option(metavar='M', min=0.0, max=0.5, help='road: on so much of it the tyre stands; default: 0.1'),
]
Repeat = Annotated[bool, typer.Option('--repeat', help='road: drive it forth and back until the end')]


def road_of_options(road: str, lateral: float, column: str, distance: str) -> 'RoadProfile':
    """Return the road that the options name."""
    from engine_mount.signals.roads.table import road_profile

    spacing = _number(distance)
    return road_profile(
        road,
        lateral=lateral,
        column=column,
        distance='' if math.isfinite(spacing) else distance,
        spacing=spacing,
    )


def road_excitation(
    road: str,
    speed: str,
    column: str,
    duration: float,
    *,
    lateral: float,
    distance: str,
    contact_length: float | None,
    repeat: bool,
) -> 'ExternalExcitation':
    """Return the road that the options name as excitation: at their speed, for `duration` s (0: once)."""
    from engine_mount.drives.external_excitation import ExternalExcitation
    from engine_mount.signals.roads.driving import speed_of, wheel_height
    from engine_mount.signals.roads.iso8608 import unevenness

    if not speed:
        raise typer.BadParameter(
            '--road needs a speed: --speed 60/3.6 (m/s), or a file of the speed over time'
        )
    profile = road_of_options(road, lateral, column, distance)
    over = wheel_height(
        profile,
        speed_of(speed),
        contact_length=contact_length,
        duration=float(duration),
        repeat=repeat,
    )
    notes = (f'{profile.name}: {sentence}' for sentence in (*unevenness(profile).sentences(), *over.notes))
    return ExternalExcitation('road.file', over.write, over.told, tuple(notes))


def height_column(columns: Sequence[str]) -> str:
    """Return the one column of the height, '' where none is named."""
    if len(columns) > 1:
        raise typer.BadParameter('--column is given once for a road: the column of its height')
    return columns[0] if columns else ''


def given_without_road(**options: Any) -> None:
    """Refuse options that say something of a road where there is none."""
    for name, value in options.items():
        if value not in (None, '', False, 0.0):
            raise typer.BadParameter(f'--{name.replace("_", "-")} is for a road: name it with --road FILE')


def _number(text: str) -> float:
    try:
        return float(text)
    except ValueError:
        return math.nan
