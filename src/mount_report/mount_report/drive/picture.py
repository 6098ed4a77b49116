"""The picture of a drive in the manner of Fig. 15: displacement with the policy's levels, and current."""

from collections.abc import Mapping
from itertools import cycle
from pathlib import Path
from typing import Any

import matplotlib
import numpy as np

matplotlib.use('Agg')

from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import NDArray

from mount_report.drive.evaluation import switching
from mount_report.drive.signals import Seen

_BEFORE, _AFTER = 0.4, 0.6  # s, chosen: shown in detail round the highest current
_SHORTEST = 1.0  # s, chosen: a drive that never reached its excitation is shown from its end
_BLUE, _RED, _GREY = '#1f5fa8', '#b03030', '#666666'


def draw_drive(seen: Seen, levels: Mapping[str, float], begin: float, title: str, file: Path) -> None:
    """Write the picture of what was `seen` to `file` (PNG); levels in m by their labels.

    Left the drive from `begin` (s) on; right, where damping was on, its strongest moment in detail as in
    Fig. 15.
    """
    columns = 2 if seen.current.any() else 1
    picture = Figure(figsize=(12.0 if columns == 2 else 9.0, 6.0), layout='constrained')
    axes = picture.subplots(2, columns, sharex='col', height_ratios=(3, 2), squeeze=False)
    whole = (min(begin, float(seen.time[-1]) - _SHORTEST), float(seen.time[-1]))
    _draw_column(axes[:, 0], seen, levels, whole)
    handles, labels = axes[0, 0].get_legend_handles_labels()
    picture.legend(handles, labels, loc='outside lower center', ncols=3, fontsize='small')
    axes[0, 0].set_ylabel('displacement (mm)')
    axes[1, 0].set_ylabel('current setpoint (A)')
    if columns == 2:
        strongest = float(seen.time[np.argmax(seen.current)])
        _draw_column(axes[:, 1], seen, levels, (strongest - _BEFORE, strongest + _AFTER))
        axes[0, 1].set_title('where the current is highest', fontsize='medium')
    picture.suptitle(title)
    picture.savefig(file, dpi=100)


def _draw_column(
    axes: NDArray[Any], seen: Seen, levels: Mapping[str, float], limits: tuple[float, float]
) -> None:
    upper, lower = axes
    shown = (seen.time >= limits[0]) & (seen.time <= limits[1])
    upper.plot(seen.time[shown], 1e3 * seen.displacement[shown], color=_BLUE, linewidth=0.8)
    lower.plot(seen.time[shown], seen.current[shown], color=_BLUE, linewidth=0.8)
    for (name, level), style in zip(levels.items(), cycle(('--', ':')), strict=False):
        label = f'{name}, {1e3 * level:g} mm'
        upper.axhline(1e3 * level, color=_RED, linestyle=style, linewidth=1.0, label=label)
        upper.axhline(-1e3 * level, color=_RED, linestyle=style, linewidth=1.0)
    upper.fill_between([], [], color=_GREY, alpha=0.15, label='damping on')
    for each in (upper, lower):
        _shade_damping(each, seen)
        each.grid(alpha=0.25)
        each.set_xlim(*limits)
    lower.set_ylim(bottom=0.0)
    lower.set_xlabel('time from the first sample (s)')


def _shade_damping(axes: Axes, seen: Seen) -> None:
    times = switching(seen)
    ends = (*times.off, float(seen.time[-1]))
    for on in times.on:
        end = min((end for end in ends if end > on), default=on)
        axes.axvspan(on, end, color=_GREY, alpha=0.15, linewidth=0)
