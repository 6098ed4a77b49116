"""A drawing as plain data: what is shown, with labels and units. Both ways to draw it take it as it is."""

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from engine_mount.reports.drawing.style import COLOURS, LEVEL_COLOUR

Array = NDArray[np.float64]

SOLID, DASHED, DOTTED = 'solid', 'dash', 'dot'


class ChartError(ValueError):
    """What is to be drawn does not fit together; the text says what."""


@dataclass(frozen=True)
class Curve:
    """A line through points; NaN interrupts it. `colour` is one of `style`."""

    name: str
    x: Array
    y: Array
    colour: str = COLOURS[0]
    dash: str = SOLID
    steps: bool = False  # holds each value until the next point
    width: float = 1.2  # pixels

    def __post_init__(self) -> None:
        if len(self.x) != len(self.y):
            raise ChartError(f'curve {self.name!r}: {len(self.x)} x but {len(self.y)} y')


@dataclass(frozen=True)
class Dots:
    """Single values `y` at the places `x`."""

    name: str
    x: Array
    y: Array
    colour: str = COLOURS[0]

    def __post_init__(self) -> None:
        if len(self.x) != len(self.y):
            raise ChartError(f'dots {self.name!r}: {len(self.x)} x but {len(self.y)} y')


@dataclass(frozen=True)
class Level:
    """A horizontal line at `value`; `both` draws it at minus `value` too."""

    name: str
    value: float
    dash: str = DASHED
    both: bool = False
    colour: str = LEVEL_COLOUR


@dataclass(frozen=True)
class Span:
    """A shaded stretch of the x axis, as where damping is on."""

    begin: float
    end: float


@dataclass(frozen=True)
class Panel:
    """One pair of axes; `label` holds the unit, as in `displacement (mm)`."""

    label: str
    curves: Sequence[Curve] = ()
    dots: Sequence[Dots] = ()
    levels: Sequence[Level] = ()
    log: bool = False
    share: float = 1.0  # of the height, against the other panels


@dataclass(frozen=True)
class Chart:
    """Panels above each other over one x axis.

    `name` is that of the file, `title` stands above, `remark` below. `spans` are shaded in all panels and
    called `span_name`; `limits` are those of the x axis, None for all. `view` is the part of the x axis that
    is looked at first: a picture shows only that.
    """

    name: str
    title: str
    x_label: str
    panels: Sequence[Panel]
    spans: Sequence[Span] = ()
    span_name: str = ''
    limits: tuple[float, float] | None = None
    view: tuple[float, float] | None = None
    remark: str = ''
    ticks: Sequence[float] = field(default_factory=tuple)  # of the x axis; empty: chosen by the drawing

    def __post_init__(self) -> None:
        if not self.panels:
            raise ChartError(f'chart {self.name!r} has no panel')
