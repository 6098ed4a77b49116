"""Pictures of a recorded drive."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from engine_mount.experiments.harness.drawing import BLUE, GREY, RED, finish, new_figure
from engine_mount.experiments.recorded_drive.evaluation import (
    BANDS,
    ELASTOMER,
    FRICTION,
    HYDRO,
    Spectra,
)
from engine_mount.reports.drawing.style import HYDROMOUNT_COLOUR, UNDAMPED_COLOUR

if TYPE_CHECKING:
    from engine_mount.reports.drive.signals import DriveSignals
    from mount_control.policy import switched_viscous

_LOWEST, _HIGHEST = 0.7, 45.0  # Hz, chosen: what the bands lie in, and no more than a car's sensor has
_BEFORE, _AFTER = 1.0, 4.0  # s round the largest displacement


def draw_spectra(spectra: dict[str, Spectra], file: Path) -> Path:
    """Draw displacement and chassis-side force of all mounts over frequency, the bands behind them."""
    figure = new_figure('A recorded drive: displacement of the mount and its force on the chassis', 7.5)
    panels = figure.subplots(2, 1, sharex=True)
    for axes, name, scale, label in (
        (panels[0], 'displacement', 1e6, 'displacement (µm/$\\sqrt{\\mathrm{Hz}}$)'),
        (panels[1], 'force', 1.0, 'force on the chassis (N/$\\sqrt{\\mathrm{Hz}}$)'),
    ):
        for (mount, colour, dash), width in zip(_styles(), (1.6, 1.4, 1.4), strict=True):
            each = spectra[mount]
            shown = (each.frequency >= _LOWEST) & (each.frequency <= _HIGHEST)
            values = scale * getattr(each, name)[shown]
            axes.loglog(
                each.frequency[shown], values, color=colour, linestyle=dash, linewidth=width, label=mount
            )
        for edge in sorted({edge for band in BANDS for edge in band}):
            axes.axvline(edge, color=GREY, linewidth=0.8, linestyle='-.')
        axes.set_ylabel(label)
    ticks = [1, 2, 5, 8, 12, 20, 30]
    panels[1].set_xticks(ticks, [f'{tick:g}' for tick in ticks])
    panels[1].set_xticks([], minor=True)
    panels[1].set_xlim(_LOWEST, _HIGHEST)
    panels[1].set_xlabel('frequency (Hz); vertical lines: edges of the bands')
    panels[0].legend(loc='lower left')
    return finish(figure, file)


def draw_traces(drives: dict[str, DriveSignals], control: switched_viscous.Parameters, file: Path) -> Path:
    """Draw the whole drive above, the seconds round its largest displacement below."""
    seen, truth = drives[FRICTION].seen, drives[FRICTION].truth
    middle = float(truth.time[np.argmax(np.abs(truth.displacement))])
    figure = new_figure('A recorded drive: displacement of the mount over time', 7.5)
    upper, lower = figure.subplots(2, 1)
    upper.plot(truth.time, 1e3 * truth.displacement, color=BLUE, linewidth=0.6, label=FRICTION)
    begin, end = max(0.0, middle - _BEFORE), middle + _AFTER
    for (name, colour, dash), width in zip(_styles(), (1.4, 1.2, 1.8), strict=True):
        each = drives[name].truth
        shown = (each.time >= begin) & (each.time <= end)
        lower.plot(
            each.time[shown], 1e3 * each.displacement[shown], color=colour, linestyle=dash,
            linewidth=width, label=name,
        )  # fmt: skip
    for axes, whole in ((upper, True), (lower, False)):
        within = (seen.time >= 0.0) if whole else (seen.time >= begin) & (seen.time <= end)
        axes.fill_between(
            seen.time[within], 0.0, 1.0, where=seen.damping_active[within], color=GREY, alpha=0.18,
            transform=axes.get_xaxis_transform(), label='damping on', step='post', linewidth=0.0,
        )  # fmt: skip
        for sign in (1.0, -1.0):
            axes.axhline(
                1e3 * sign * control.switch_on_level, color=RED, linestyle='--', linewidth=0.9,
                label='switch-on level' if sign > 0.0 else None,
            )  # fmt: skip
        axes.set_ylabel('displacement (mm)')
        axes.set_xlabel('time from the start of the drive (s)')
        axes.legend(loc='upper right', ncols=3, fontsize='small')
    # room for the legend
    upper.set_ylim(top=1.4e3 * float(np.max(np.abs(truth.displacement))))
    upper.set_xlim(0.0, float(truth.time[-1]))
    lower.set_xlim(begin, end)
    return finish(figure, file)


def _styles() -> list[tuple[str, str, str]]:
    """Return mount, colour and dash, the one that lies on top last."""
    return [(ELASTOMER, UNDAMPED_COLOUR, ':'), (HYDRO, HYDROMOUNT_COLOUR, '--'), (FRICTION, BLUE, '-')]
