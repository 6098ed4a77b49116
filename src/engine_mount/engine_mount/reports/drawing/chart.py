"""A drawing as plain data, and the colours of everything: the same in every picture and page."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import cycle

import numpy as np
from numpy.typing import NDArray

COLOURS = ('#1f5fa8', '#c77700', '#6a3d9a', '#0f8b8d', '#8a4b2d', '#b5408f')
"""Of recordings and of lines without a colour of their own, in their order.

Chosen: far apart in lightness too, so that they differ on paper; none is that of a level, the hydromount or
an undamped mount.
"""

LEVEL_COLOUR, SPAN_COLOUR = '#b03030', '#666666'
SHADING = 0.25  # chosen: opacity of a shade of 1
UNDAMPED_COLOUR, HYDROMOUNT_COLOUR = '#888888', '#2f7d32'
DIFFERENCE_COLOUR = '#666666'
"""Of B - A, and of what is left between two lines that coincide."""

COLOUR_OF = {
    'displacement': '#1f5fa8',
    'hydromount': HYDROMOUNT_COLOUR,
    'no current': UNDAMPED_COLOUR,
    'switched_viscous': '#c77700',
    'continuous_viscous': '#6a3d9a',
    'setpoint': '#c77700',
    'current': '#1f5fa8',
    'damping': '#1f5fa8',
    'desired_force': '#c77700',
    'latency': '#6a3d9a',
}
"""Of what has a name: mounts, policies and signals."""

Array = NDArray[np.float64]
Limits = tuple[float, float]

SOLID, DASHED, DOTTED, POINTS = 'solid', 'dashed', 'dotted', 'point'
DASH_OF = {'hydromount': DASHED, 'no current': DOTTED}
"""Of the mounts that are not solid: with their colours, their look everywhere."""


def look_of(mount: str, colour: str = COLOURS[0]) -> tuple[str, str]:
    """Return colour and dash of a mount, `colour` where it has none of its own."""
    return COLOUR_OF.get(mount, colour), DASH_OF.get(mount, SOLID)


@dataclass(frozen=True)
class Curve:
    """A line through points, or these alone; NaN interrupts it."""

    name: str
    x: Array
    y: Array
    colour: str = COLOURS[0]
    dash: str = SOLID
    key: str = ''  # of the signal that the live view adds


@dataclass(frozen=True)
class Level:
    """Horizontal lines at `value` and minus `value`."""

    name: str
    value: float
    dash: str = DASHED
    colour: str = LEVEL_COLOUR


@dataclass(frozen=True)
class Panel:
    """One pair of axes; `label` holds the unit, as in `displacement (mm)`. The last curve lies on top."""

    label: str
    curves: Sequence[Curve] = ()
    levels: Sequence[Level] = ()
    log: bool = False
    share: float = 1.0  # of the height, against the other panels
    least: Sequence[float] = ()  # values that are always shown


@dataclass(frozen=True)
class Chart:
    """Panels above each other over one x axis.

    `name` is that of the file, `title` stands above. `shade` (0 to 1) is drawn as shading of all panels;
    `limits` are those of the x axis, None for all. `view` is the part of it that is seen first: a picture
    shows that and, where there are `limits`, below it the first panel within these.
    """

    name: str
    title: str
    x_label: str
    panels: Sequence[Panel]
    shade: Curve | None = None
    limits: Limits | None = None
    view: Limits | None = None


def level_lines(levels: Mapping[str, float]) -> list[Level]:
    """Return displacements (m) by their labels as lines over mm, by turns dashed and dotted."""
    return [
        Level(f'{name}, {1e3 * value:g} mm', 1e3 * value, dash)
        for (name, value), dash in zip(levels.items(), cycle((DASHED, DOTTED)), strict=False)
    ]
