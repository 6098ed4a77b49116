"""Options that say which road, and how it is driven; for `drive` and `road`."""

from collections.abc import Sequence
from typing import TYPE_CHECKING, Annotated

import typer

if TYPE_CHECKING:
    pass

HeightColumn = Annotated[str, typer.Option('--column', metavar='NAME[:UNIT]', help='column of the height')]
Distance = Annotated[
    str,
    typer.Option(
        metavar='NAME[:UNIT]|M', help='road: column of the distance, or the distance between two heights'
    ),
]
SpeedText = Annotated[str, typer.Option(metavar='M/S', help='road: 60/3.6 or 60km/h')]
ContactLength = Annotated[
    float | None,
    typer.Option(metavar='M', min=0.0, max=0.5, help='road: on so much of it the tyre stands; default: 0.1'),
]
Repeat = Annotated[bool, typer.Option('--repeat', help='road: drive it forth and back until the end')]


def height_column(columns: Sequence[str]) -> str:
    """Return the one column of the height, '' where none is named."""
    if len(columns) > 1:
        raise typer.BadParameter('--column is given once for a road: the column of its height')
    return columns[0] if columns else ''
