"""The look that the experiments' pictures share: 1000 pixels wide, units at every axis."""

from collections.abc import Sequence
from pathlib import Path
from typing import Any, Literal

import numpy as np
from matplotlib import colormaps
from matplotlib.figure import Figure

from engine_mount.reports.drawing.chart import (
    COLOURS,
    HYDROMOUNT_COLOUR,
    LEVEL_COLOUR,
    SPAN_COLOUR,
    UNDAMPED_COLOUR,
    Chart,
)
from engine_mount.reports.drawing.picture import draw_chart

BLUE, RED, GREY = COLOURS[0], LEVEL_COLOUR, SPAN_COLOUR
"""Of the friction mount and other lines; of levels and what stands out; of shades."""
HYDRO_LINE = {'color': HYDROMOUNT_COLOUR, 'linestyle': '--'}
OFF_LINE = {'color': UNDAMPED_COLOUR, 'linestyle': ':'}
"""Of the hydromount; of a mount without current or without friction."""
_WIDTH = 10.0  # inches
_DPI = 100
_LAYOUT: Literal['constrained'] | None = 'constrained'


def new_panels(title: str, rows: int = 1, columns: int = 1, height: float = 5.0, **more: Any) -> Any:
    """Return a picture of 1000 pixels width and `height` (inches), and its panels, one or an array."""
    figure = _empty(title, height)
    return figure, figure.subplots(rows, columns, **more)


def new_mosaic(title: str, places: Any, height: float, **more: Any) -> Any:
    """Return the same with panels by the names in `places`."""
    figure = _empty(title, height)
    return figure, figure.subplot_mosaic(places, **more)


def _empty(title: str, height: float) -> Figure:
    figure = Figure(figsize=(_WIDTH, height), layout=_LAYOUT)
    figure.suptitle(title)
    return figure


def family(count: int) -> Sequence[Any]:
    """Return `count` colours in an order that is seen as one, also in grey print."""
    return list(colormaps['viridis'](np.linspace(0.0, 0.9, count)))


def legend_below(figure: Any, axes: Any, columns: int, **more: Any) -> None:
    """Put the legend of `axes` below all panels."""
    figure.legend(*axes.get_legend_handles_labels(), loc='outside lower center', ncols=columns, **more)


def finish(figure: Any, file: Path) -> Path:
    """Write `figure`, a chart or with a grid behind all axes without an image, to `file` (PNG); return it."""
    file.parent.mkdir(parents=True, exist_ok=True)
    if isinstance(figure, Chart):
        draw_chart(figure, file)
        return file
    for axes in figure.axes:
        if not axes.images:
            axes.grid(alpha=0.25)
    # nothing of date or program in it: the same figures give the same bytes
    figure.savefig(file, dpi=_DPI, metadata={'Software': None})
    return file
