"""The picture of a drive in the manner of Fig. 15: displacement with the policy's levels, and current."""

from collections.abc import Mapping, Sequence
from itertools import cycle
from pathlib import Path
from typing import Any

import matplotlib
import numpy as np

matplotlib.use('Agg')

from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import NDArray

from engine_mount.reports.drawing.chart import DASHED, DOTTED, Array, Curve, Level, Panel
from engine_mount.reports.drawing.picture import draw_panel, name_lines
from engine_mount.reports.drawing.style import COLOUR_OF, SPAN_COLOUR, UNDAMPED_COLOUR
from engine_mount.reports.drive.evaluation import switching
from engine_mount.reports.drive.signals import Seen

_BEFORE, _AFTER = 0.4, 0.6  # s, chosen: shown in detail round the highest current
_SHORTEST = 1.0  # s, chosen: a drive that never reached its excitation is shown from its end
_MM = 1e3
_NAMES = {'friction': 'friction mount', 'hydro': 'hydromount'}


def draw_drive(
    seen: Seen,
    levels: Mapping[str, float],
    begin: float,
    title: str,
    files: Sequence[Path],
    undamped: tuple[Array, Array] | None = None,
    mount: str = 'friction',
) -> None:
    """Write the picture of what was `seen` to `files` (PNG, SVG); levels in m by their labels.

    Left the drive from `begin` (s) on; right, where damping was on, its strongest moment in detail as in
    Fig. 15. Grey is the displacement (m) of the `undamped` mount over its time (s); `mount` is the one
    in the seat.
    """
    columns = 2 if seen.current.any() else 1
    picture = Figure(figsize=(12.0 if columns == 2 else 9.0, 6.0), layout='constrained')
    axes = picture.subplots(2, columns, sharex='col', height_ratios=(3, 2), squeeze=False)
    panels = _panels(seen, levels, undamped, mount)
    whole = (min(begin, float(seen.time[-1]) - _SHORTEST), float(seen.time[-1]))
    _draw_column(axes[:, 0], panels, seen, whole)
    name_lines(axes[0, 0], panels[0])
    for each, panel in zip(axes[:, 0], panels, strict=True):
        each.set_ylabel(panel.label)
    if columns == 2:
        strongest = float(seen.time[np.argmax(seen.current)])
        _draw_column(axes[:, 1], panels, seen, (strongest - _BEFORE, strongest + _AFTER))
        axes[0, 1].set_title('where the current is highest', fontsize='medium')
    picture.suptitle(title)
    for file in files:
        picture.savefig(file, dpi=100)


def _panels(
    seen: Seen, levels: Mapping[str, float], undamped: tuple[Array, Array] | None, mount: str
) -> list[Panel]:
    colour = COLOUR_OF.get(mount, COLOUR_OF['displacement'])
    name = _NAMES.get(mount, mount)
    curves = [Curve(name, seen.time, _MM * seen.displacement, colour, width=0.8)]
    if undamped is not None:
        time, displacement = undamped
        curves.insert(0, Curve('undamped', time, _MM * displacement, UNDAMPED_COLOUR, width=0.8))
    lines = [
        Level(f'{name}, {_MM * value:g} mm', _MM * value, dash, both=True)
        for (name, value), dash in zip(levels.items(), cycle((DASHED, DOTTED)), strict=False)
    ]
    current = Curve('current setpoint', seen.time, seen.current, COLOUR_OF['current'], width=0.8)
    return [
        Panel('displacement (mm)', curves, levels=lines),
        Panel('current setpoint (A)', [current]),
    ]


def _draw_column(
    axes: NDArray[Any], panels: Sequence[Panel], seen: Seen, limits: tuple[float, float]
) -> None:
    for each, panel in zip(axes, panels, strict=True):
        draw_panel(each, panel, limits)
        each.set_ylabel('')
        _shade_damping(each, seen)
    lower = axes[1]
    lower.set_ylim(bottom=0.0)
    lower.set_xlabel('time from the first sample (s)')


def _shade_damping(axes: Axes, seen: Seen) -> None:
    times = switching(seen)
    ends = (*times.off, float(seen.time[-1]))
    for place, on in enumerate(times.on):
        end = min((end for end in ends if end > on), default=on)
        name = 'damping on' if place == 0 else None
        axes.axvspan(on, end, color=SPAN_COLOUR, alpha=0.15, linewidth=0, label=name)
