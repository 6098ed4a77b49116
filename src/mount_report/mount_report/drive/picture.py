"""The picture of a drive in the manner of Fig. 15: displacement with both levels, and current."""

from pathlib import Path
from typing import Any

import matplotlib

matplotlib.use('Agg')

from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import NDArray

from mount_report.drive.evaluation import switching
from mount_report.drive.signals import Seen

_SHORTEST = 1.0  # s, chosen: a drive that never reached its excitation is shown from its end
_BLUE, _RED, _GREY = '#1f5fa8', '#b03030', '#666666'


def draw_drive(seen: Seen, on_level: float, off_level: float, begin: float, title: str, file: Path) -> None:
    """Write the picture of what was `seen` to `file` (PNG); levels in m.

    Left the drive from `begin` (s) on; right, where damping was switched on, the first time in detail as in
    Fig. 15.
    """
    times = switching(seen)
    first = next(iter(times.on), None)
    picture = Figure(figsize=(12.0 if first is not None else 9.0, 6.0), layout='constrained')
    columns = 1 if first is None else 2
    axes = picture.subplots(2, columns, sharex='col', height_ratios=(3, 2), squeeze=False)
    whole = (min(begin, float(seen.time[-1]) - _SHORTEST), float(seen.time[-1]))
    _draw_column(axes[:, 0], seen, on_level, off_level, whole)
    handles, labels = axes[0, 0].get_legend_handles_labels()
    picture.legend(handles, labels, loc='outside lower center', ncols=3, fontsize='small')
    axes[0, 0].set_ylabel('displacement (mm)')
    axes[1, 0].set_ylabel('current setpoint (A)')
    if first is not None:
        end = min((off for off in times.off if off > first), default=first + 1.0)
        _draw_column(axes[:, 1], seen, on_level, off_level, (first - 0.4, min(end, first + 1.0) + 0.3))
        axes[0, 1].set_title('the first time in detail', fontsize='medium')
    picture.suptitle(title)
    picture.savefig(file, dpi=100)


def _draw_column(
    axes: NDArray[Any], seen: Seen, on_level: float, off_level: float, limits: tuple[float, float]
) -> None:
    upper, lower = axes
    shown = (seen.time >= limits[0]) & (seen.time <= limits[1])
    upper.plot(seen.time[shown], 1e3 * seen.displacement[shown], color=_BLUE, linewidth=0.8)
    lower.plot(seen.time[shown], seen.current[shown], color=_BLUE, linewidth=0.8)
    for level, style, name in ((on_level, '--', 'switch-on level'), (off_level, ':', 'switch-off level')):
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
