"""Maps of the friction mount over the hydromount, with the line on which they are even."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from matplotlib.colors import TwoSlopeNorm
from matplotlib.patheffects import withStroke

from engine_mount.drives.bands import ISOLATION_BANDS
from engine_mount.experiments.harness.drawing import finish, new_figure
from engine_mount.experiments.sensitivity.maps import lower

if TYPE_CHECKING:
    from engine_mount.experiments.sensitivity.maps import Maps
    from engine_mount.reports.drive.signals import FloatArray

_COLOURS = 'RdBu_r'  # red: the friction mount has more


def nearest(values: list[float], wanted: float) -> int:
    """Return the place of the value next to the wanted one."""
    return int(np.argmin(np.abs(np.array(values) - wanted)))


def draw_peaks(maps: Maps, file: Path) -> Path:
    """Draw the displacement's ratio over road level and decoupler, one map for each idle force."""
    axes_of_maps = maps.axes
    asymmetry = nearest(axes_of_maps.asymmetries, 0.25)
    count = len(axes_of_maps.idle_forces)
    columns = min(count, 2)
    rows = -(-count // columns)
    figure = new_figure(
        'Largest displacement from 3 to 14 Hz: friction mount over hydromount\n'
        f'chamber asymmetry {axes_of_maps.asymmetries[asymmetry]:g}; black line: even', 1.2 + 2.8 * rows
    )  # fmt: skip
    panels = np.atleast_1d(figure.subplots(rows, columns, sharex=True, sharey=True)).ravel()
    for number, panel in enumerate(panels):
        if number >= count:
            panel.set_visible(False)
            continue
        _draw_map(
            panel,
            maps.peak[:, :, asymmetry, number].T,
            [f'{level:g}' for level in axes_of_maps.levels],
            [f'{resistance:.0e}' for resistance in axes_of_maps.resistances],
        )
        panel.set_title(f'idle force {axes_of_maps.idle_forces[number]:g} N', fontsize='medium')
        panel.set_xlabel('road level V0 (m/s)')
        panel.set_ylabel('decoupler R_d (Pa s/m$^3$)')
    return _finish_maps(figure, file)


def draw_acceleration(maps: Maps, file: Path) -> Path:
    """Draw the acceleration's ratio in each band: over decoupler and idle force, over road level and it."""
    axes_of_maps = maps.axes
    asymmetry = nearest(axes_of_maps.asymmetries, 0.25)
    level, resistance = nearest(axes_of_maps.levels, 0.12), nearest(axes_of_maps.resistances, 1e8)
    forces = [f'{force:g}' for force in axes_of_maps.idle_forces]
    figure = new_figure(
        'Chassis acceleration (rms): friction mount over hydromount\n'
        f'chamber asymmetry {axes_of_maps.asymmetries[asymmetry]:g}; black line: even', 7.2
    )  # fmt: skip
    panels = figure.subplots(2, len(ISOLATION_BANDS))
    for band, (low, high) in enumerate(ISOLATION_BANDS):
        above, below = panels[:, band]
        _draw_map(
            above,
            maps.rms[band, level, :, asymmetry, :],
            forces,
            [f'{value:.0e}' for value in axes_of_maps.resistances],
        )
        above.set_title(
            f'{low:.0f} to {high:.0f} Hz, V0 = {axes_of_maps.levels[level]:g} m/s', fontsize='medium'
        )
        _draw_map(
            below,
            maps.rms[band, :, resistance, asymmetry, :],
            forces,
            [f'{value:g}' for value in axes_of_maps.levels],
        )
        below.set_title(
            f'{low:.0f} to {high:.0f} Hz, R_d = {axes_of_maps.resistances[resistance]:.0e}', fontsize='medium'
        )
        for panel in (above, below):
            panel.set_xlabel('idle force F_i (N)')
    panels[0, 0].set_ylabel('decoupler R_d (Pa s/m$^3$)')
    panels[1, 0].set_ylabel('road level V0 (m/s)')
    return _finish_maps(figure, file)


def _draw_map(panel: Any, ratios: FloatArray, across: list[str], upwards: list[str]) -> None:
    """Draw ratios (upwards, across) as colours with their numbers, and a line where they are 1."""
    panel.imshow(
        ratios, cmap=_COLOURS, norm=TwoSlopeNorm(1.0, 0.4, 2.0), origin='lower', aspect='auto', alpha=0.85
    )
    panel.set_xticks(range(len(across)), across)
    panel.set_yticks(range(len(upwards)), upwards)
    for row, column in np.ndindex(ratios.shape):
        value = ratios[row, column]
        text = '-' if np.isnan(value) else f'{value:.2f}'
        written = panel.text(column, row, text, ha='center', va='center', fontsize='small', zorder=4)
        if lower(value):
            written.set_weight('bold')
        written.set_path_effects([withStroke(linewidth=2.5, foreground='white', alpha=0.7)])
    if min(ratios.shape) > 1 and np.nanmin(ratios) < 1.0 < np.nanmax(ratios):
        panel.contour(ratios, levels=[1.0], colors='black', linewidths=1.8)


def _finish_maps(figure: Any, file: Path) -> Path:
    figure.supxlabel(
        'bold, blue: the friction mount has less; red: the hydromount has less', fontsize='small'
    )
    return finish(figure, file, grid=False)
