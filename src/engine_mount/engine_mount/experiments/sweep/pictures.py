"""Pictures of the sweep, Fig. 14."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from engine_mount.experiments.harness.drawing import BLUE, finish, new_figure
from engine_mount.experiments.sweep.evaluation import ALWAYS, FRICTION, HYDRO, OFF, SweepRun
from engine_mount.reports.drawing.style import COLOURS, HYDROMOUNT_COLOUR, UNDAMPED_COLOUR

if TYPE_CHECKING:
    from engine_mount.reports.drive.signals import FloatArray

_ENVELOPE_STEP = 0.25  # Hz


def draw_sweep(friction: SweepRun, hydro: SweepRun, title: str, file: Path) -> Path:
    """Draw displacement and chassis acceleration over frequency, as envelopes, logarithmic, Fig. 14."""
    figure = new_figure(f'Front wheels on a sweep of 1 Hz per second: {title}', 6.5)
    panels = figure.subplots(2, 1, sharex=True)
    quantities = (
        ('displacement, envelope (mm)', 1e3, 'displacement'),
        ('chassis acceleration,\nenvelope (m/s$^2$)', 1.0, 'chassis_acceleration'),
    )
    for axes, (label, scale, name) in zip(panels, quantities, strict=True):
        for run, colour, mount in ((hydro, HYDROMOUNT_COLOUR, HYDRO), (friction, BLUE, FRICTION)):
            x, low, high = _envelope(run.frequency, scale * getattr(run.drive.truth, name), _ENVELOPE_STEP)
            axes.semilogy(x, np.maximum(high, -low), color=colour, linewidth=1.2, label=mount)
        axes.set_ylabel(label)
    panels[1].set_xlabel('frequency of the road (Hz)')
    panels[0].legend(loc='upper right')
    return finish(figure, file)


def draw_peaks(runs: dict[str, SweepRun], file: Path) -> Path:
    """Draw the largest displacement in each band of 1 Hz, for all mounts on the road alone."""
    figure = new_figure('Front wheels on a sweep: largest displacement of the mount over frequency')
    axes = figure.subplots()
    for name, colour, dash in (
        (FRICTION, BLUE, '-'),
        (ALWAYS, COLOURS[1], '-'),
        (OFF, UNDAMPED_COLOUR, ':'),
        (HYDRO, HYDROMOUNT_COLOUR, '--'),
    ):
        passed = runs[name]
        x, low, high = _envelope(passed.frequency, 1e3 * passed.drive.truth.displacement, 0.5)
        shown = x <= 20.0
        axes.semilogy(x[shown], np.maximum(high, -low)[shown], color=colour, linestyle=dash, label=name)
    axes.set_xlabel('frequency of the road (Hz)')
    axes.set_ylabel('largest displacement (mm)')
    axes.legend()
    return finish(figure, file)


def _envelope(
    frequency: FloatArray, values: FloatArray, width: float
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return the middles of bands of `width` (Hz), and the lowest and the highest value in each."""
    numbers = np.floor(frequency / width).astype(int)
    starts = np.flatnonzero(np.diff(numbers, prepend=numbers[0] - 1))
    return (
        (numbers[starts] + 0.5) * width,
        np.minimum.reduceat(values, starts),
        np.maximum.reduceat(values, starts),
    )
