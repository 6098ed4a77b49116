"""The picture of `engine-mount identify drift`: gap, offset current and friction over the hours."""

from pathlib import Path

import matplotlib

matplotlib.use('Agg')

import numpy as np
from matplotlib.figure import Figure

from engine_mount.identification.drift.identify import DriftResult

_BLUE, _RED, _GREY = '#1f5fa8', '#b03030', '#666666'


def draw_drift(result: DriftResult, file: Path) -> None:
    """Write points with their deviations, lines with one standard deviation, and the limit (PNG)."""
    rows = [
        ('contact gap (µm)', result.gap, [1e6 * each.contact_gap for each in result.states], 1e6),
        ('offset current (mA)', result.current, [1e3 * each.offset_current for each in result.states], 1e3),
    ]
    if result.friction is not None:
        rows.append(('|F_F| / F_N', result.friction, [each.friction for each in result.states], 1.0))
    picture = Figure(figsize=(9.0, 3.0 * len(rows)), layout='constrained')
    every = np.atleast_1d(picture.subplots(len(rows), 1, sharex=True))
    hours = np.array([each.hours for each in result.states])
    grid = np.linspace(hours.min(), hours.max(), 100)
    for axes, (label, drift, values, factor) in zip(every, rows, strict=True):
        middle, spread = factor * drift.at(grid), factor * drift.std_at(grid)
        axes.fill_between(grid, middle - spread, middle + spread, color=_BLUE, alpha=0.15, linewidth=0)
        axes.plot(grid, middle, color=_BLUE, linewidth=1.0)
        axes.plot(hours, values, 'o', color=_GREY, markersize=4)
        axes.set_ylabel(label)
        axes.grid(alpha=0.3)
    stds = [1e6 * each.contact_gap_std for each in result.states]
    every[0].errorbar(hours, rows[0][2], yerr=stds, fmt='none', color=_GREY, capsize=3)
    limit = 1e6 * result.limit
    every[0].axhline(limit, color=_RED, linewidth=1.0, linestyle='--')
    every[0].annotate(f'range of the law ends at {limit:.1f} µm', (grid[0], limit), color=_RED, va='bottom')
    every[-1].set_xlabel('time (h)')
    picture.suptitle(
        f'Contact gap {1e6 * result.gap.slope:+.3g} ± {1e6 * result.gap.slope_std:.2g} µm/h, '
        f'{1e6 * result.left:.1f} µm left'
    )
    picture.savefig(file, dpi=100)
