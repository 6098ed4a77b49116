"""The picture of a drive in the manner of Fig. 15: displacement with both levels, and current."""

from pathlib import Path

import matplotlib

matplotlib.use('Agg')

from matplotlib.axes import Axes
from matplotlib.figure import Figure

from mount_bringup.evaluation import Drive, switching

_BLUE, _RED, _GREY = '#1f5fa8', '#b03030', '#666666'


def draw_drive(drive: Drive, on_level: float, off_level: float, title: str, file: Path) -> None:
    """Write the picture of `drive` to `file` (PNG); levels in m."""
    picture = Figure(figsize=(10.0, 6.0), layout='constrained')
    upper, lower = picture.subplots(2, 1, sharex=True, height_ratios=(3, 2))
    _draw_displacement(upper, drive, on_level, off_level)
    lower.plot(drive.time, drive.current, color=_BLUE, linewidth=0.8)
    lower.set_ylabel('current setpoint (A)')
    lower.set_xlabel('time from the start of the excitation (s)')
    for axes in (upper, lower):
        _shade_damping(axes, drive)
        axes.grid(alpha=0.25)
        axes.margins(x=0.0)
    picture.suptitle(title)
    picture.savefig(file, dpi=110)


def _draw_displacement(axes: Axes, drive: Drive, on_level: float, off_level: float) -> None:
    axes.plot(drive.time, 1e3 * drive.displacement, color=_BLUE, linewidth=0.8, label='displacement')
    for level, style, name in ((on_level, '--', 'switch-on level'), (off_level, ':', 'switch-off level')):
        for sign in (1.0, -1.0):
            label = f'{name}, {1e3 * level:g} mm' if sign > 0 else None
            axes.axhline(1e3 * sign * level, color=_RED, linestyle=style, linewidth=1.0, label=label)
    axes.set_ylabel('displacement (mm)')
    axes.plot([], [], color=_GREY, alpha=0.3, linewidth=8, label='damping on')
    axes.legend(loc='upper right', ncols=2, fontsize='small')


def _shade_damping(axes: Axes, drive: Drive) -> None:
    times = switching(drive)
    ends = (*times.off, float(drive.time[-1]))
    for on in times.on:
        axes.axvspan(on, min(end for end in ends if end > on), color=_GREY, alpha=0.15, linewidth=0)
