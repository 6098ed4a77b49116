"""The picture of the gap, Fig. 15."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from engine_mount.experiments.harness.drawing import BLUE, GREY, RED, finish, new_figure
from engine_mount.experiments.motorway_gap.evaluation import FRICTION, HYDRO, OFF, Crossing
from engine_mount.reports.drawing.style import HYDROMOUNT_COLOUR, UNDAMPED_COLOUR

if TYPE_CHECKING:
    from mount_control.policy import switched_viscous

_BEFORE, _AFTER = 0.3, 1.5  # s round the moment at which the switch-on level is exceeded


def draw_gap(crossing: Crossing, depth: float, control: switched_viscous.Parameters, file: Path) -> Path:
    """Draw displacement with both switching levels above, the coil's current below, Fig. 15."""
    figure = new_figure(f'Over a gap of {1e3 * depth:g} mm in the motorway (Fig. 15)', 6.5)
    upper, lower = figure.subplots(2, 1, sharex=True, height_ratios=(2, 1))
    seen, truth = crossing.drives[FRICTION].seen, crossing.drives[FRICTION].truth
    middle = float(truth.time[-1]) / 2.0 if crossing.exceeded is None else crossing.exceeded
    begin, end = middle - _BEFORE, middle + _AFTER
    for name, colour, dash in ((OFF, UNDAMPED_COLOUR, ':'), (HYDRO, HYDROMOUNT_COLOUR, '--')):
        other = crossing.drives[name].truth
        shown = (other.time >= begin) & (other.time <= end)
        upper.plot(
            other.time[shown], 1e3 * other.displacement[shown], color=colour, linestyle=dash,
            linewidth=1.0, label=name,
        )  # fmt: skip
    shown = (seen.time >= begin) & (seen.time <= end)
    upper.plot(seen.time[shown], 1e3 * seen.displacement[shown], color=BLUE, linewidth=1.8, label=FRICTION)
    for level, dash, name in (
        (control.switch_on_level, '--', 'switch-on level'),
        (control.switch_off_level, '-.', 'switch-off level'),
    ):
        for sign in (1.0, -1.0):
            upper.axhline(
                1e3 * sign * level, color=RED, linestyle=dash, linewidth=0.8,
                label=name if sign > 0.0 else None,
            )  # fmt: skip
    current = (truth.time >= begin) & (truth.time <= end)
    lower.plot(truth.time[current], truth.coil_current[current], color=BLUE)
    for axes in (upper, lower):
        axes.fill_between(
            seen.time[shown], 0.0, 1.0, where=seen.damping_active[shown], color=GREY, alpha=0.15,
            transform=axes.get_xaxis_transform(), label='damping on', step='post', linewidth=0.0,
        )  # fmt: skip
    upper.set_ylabel('displacement (mm)')
    lower.set_ylabel('coil current (A)')
    lower.set_xlabel('time from the start of the drive (s)')
    lower.set_ylim(0.0, max(0.1, 1.1 * float(np.max(truth.coil_current[current]))))
    upper.legend(loc='upper right', ncols=2, fontsize='small')
    return finish(figure, file)
