"""The look that the experiments' pictures share: 1000 pixels wide, units at every axis."""

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import matplotlib

matplotlib.use('Agg')

from matplotlib import colormaps
from matplotlib.figure import Figure

BLUE, RED, GREY, GREEN = '#1f5fa8', '#b03030', '#666666', '#3a8a4d'
_WIDTH = 10.0  # inches
_DPI = 100


def new_figure(title: str, height: float = 5.0) -> Figure:
    """Return an empty picture of 1000 pixels width and `height` (inches)."""
    figure = Figure(figsize=(_WIDTH, height), layout='constrained')
    figure.suptitle(title)
    return figure


def family(count: int) -> Sequence[Any]:
    """Return `count` colours in an order that is seen as one, also in grey print."""
    return [colormaps['viridis'](0.9 * k / max(count - 1, 1)) for k in range(count)]


def finish(figure: Figure, file: Path) -> Path:
    """Put a grid behind all axes, write `figure` to `file` (PNG) and return it."""
    for axes in figure.axes:
        axes.grid(alpha=0.25)
    file.parent.mkdir(parents=True, exist_ok=True)
    # no version of the program in the file: the same figures give the same bytes
    figure.savefig(file, dpi=_DPI, metadata={'Software': None})
    return file
