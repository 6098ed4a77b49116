"""The look that the experiments' pictures share: 1000 pixels wide, units at every axis."""

from collections.abc import Sequence
from pathlib import Path
from typing import Any, Literal

import matplotlib

matplotlib.use('Agg')

import numpy as np
from matplotlib import colormaps
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from PIL import Image

from engine_mount.reports.drawing.style import COLOURS, LEVEL_COLOUR, SPAN_COLOUR

BLUE, RED, GREY = COLOURS[0], LEVEL_COLOUR, SPAN_COLOUR
"""Of the friction mount and other lines; of levels and what stands out; of shades."""
_WIDTH = 10.0  # inches
_DPI = 100
_LAYOUT: Literal['constrained'] | None = 'constrained'
_COLOURS = 256  # the most that a palette holds


def new_figure(title: str, height: float = 5.0) -> Figure:
    """Return an empty picture of 1000 pixels width and `height` (inches)."""
    figure = Figure(figsize=(_WIDTH, height), layout=_LAYOUT)
    figure.suptitle(title)
    return figure


def family(count: int) -> Sequence[Any]:
    """Return `count` colours in an order that is seen as one, also in grey print."""
    return [colormaps['viridis'](0.9 * k / max(count - 1, 1)) for k in range(count)]


def finish(figure: Figure, file: Path, *, grid: bool = True) -> Path:
    """Put a grid behind all axes, write `figure` to `file` (PNG) and return it."""
    if grid:
        for axes in figure.axes:
            axes.grid(alpha=0.25)
    file.parent.mkdir(parents=True, exist_ok=True)
    figure.set_dpi(_DPI)
    canvas = FigureCanvasAgg(figure)
    canvas.draw()  # once; savefig draws twice
    picture = Image.fromarray(np.asarray(canvas.buffer_rgba())).convert('RGB')
    # a palette halves the file; nothing of date or program in it: the same figures give the same bytes
    picture.quantize(_COLOURS, dither=Image.Dither.NONE).save(file, optimize=True)
    return file
