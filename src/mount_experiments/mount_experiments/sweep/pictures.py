"""Pictures of the sweep, Fig. 14."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from mount_experiments.harness.drawing import BLUE, GREEN, GREY, RED, finish, new_figure
from mount_experiments.sweep.evaluation import ALWAYS, FRICTION, HYDRO, OFF, SweepRun

if TYPE_CHECKING:
    from mount_report.drive.signals import FloatArray

_OUTLINE_STEP = 0.25  # Hz


def draw_sweep(friction: SweepRun, hydro: SweepRun, title: str, file: Path) -> Path:
    """Draw displacement and chassis acceleration over frequency, the hydromount as outline, Fig. 14."""
    figure = new_figure(f'Front wheels on a sweep of 1 Hz per second: {title}', 6.5)
    panels = figure.subplots(2, 1, sharex=True)
    quantities = (
        ('displacement (mm)', 1e3, 'displacement'),
        ('chassis acceleration (m/s$^2$)', 1.0, 'chassis_acceleration'),
    )
    for axes, (label, scale, name) in zip(panels, quantities, strict=True):
        # samples in pairs of lowest and highest: a picture of this width shows no more
        x, low, high = _envelope(friction.frequency, scale * getattr(friction.drive.truth, name), 0.02)
        axes.fill_between(x, low, high, color=BLUE, linewidth=0.4, label='friction mount')
        x, low, high = _envelope(hydro.frequency, scale * getattr(hydro.drive.truth, name), _OUTLINE_STEP)
        axes.plot(x, high, color=RED, linewidth=1.4, label='hydromount (outline)')
        axes.plot(x, low, color=RED, linewidth=1.4)
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
        (ALWAYS, GREEN, '-'),
        (OFF, GREY, ':'),
        (HYDRO, RED, '--'),
    ):
        passed = runs[name]
        x, low, high = _envelope(passed.frequency, 1e3 * passed.drive.truth.displacement, 0.5)
        shown = x <= 20.0
        axes.plot(x[shown], np.maximum(high, -low)[shown], color=colour, linestyle=dash, label=name)
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
