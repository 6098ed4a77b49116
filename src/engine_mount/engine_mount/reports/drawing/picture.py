"""Charts, and a measured road, as PNG or SVG."""

from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import to_rgba
from matplotlib.figure import Figure

from engine_mount.reports.drawing.chart import (
    COLOURS,
    LEVEL_COLOUR,
    POINTS,
    SHADING,
    SPAN_COLOUR,
    Array,
    Chart,
    Curve,
    Limits,
    Panel,
)
from engine_mount.reports.drawing.detail import ranges
from engine_mount.signals.roads.iso8608 import (
    CLASSES,
    FIRST_LIMIT,
    LONGEST_WAVE,
    RoadProfile,
    Unevenness,
    without_long_waves,
)
from mount_sim.excitation.road import REFERENCE_FREQUENCY

_POINTS = 4000  # of a curve, chosen: 2 to a pixel of both kinds, lowest and highest
_LINE = 1.6  # points, chosen
_SHADES = 2000  # of the width, chosen: 2 to a pixel


def draw_chart(chart: Chart, *files: Path) -> None:
    """Write the picture of `chart` to `files`, PNG or by its suffix SVG: 1000 pixels wide.

    It shows what the chart shows at first; where that is a part, the first panel over all stands below.
    """
    views = [(panel, chart.view or chart.limits, panel.share) for panel in chart.panels]
    if chart.view and chart.limits not in (None, chart.view):
        views.append((chart.panels[0], chart.limits, 0.8))  # share of the height: chosen
    shares = [share for *_, share in views]
    picture = Figure(figsize=(10.0, 1.0 + 2.6 * sum(shares)), layout='constrained')
    rows = picture.subplots(len(views), height_ratios=shares, squeeze=False)[:, 0]
    if shade := chart.shade:
        look = {'markerfacecolor': to_rgba(shade.colour, SHADING), 'markeredgewidth': 0.0, 'markersize': 10}
        rows[0].plot([], [], 's', color=shade.colour, label=shade.name, **look)
    for place, (axes, (panel, limits, _)) in enumerate(zip(rows, views, strict=True)):
        _draw_panel(axes, panel, limits, shade)
        axes.set_ylabel(panel.label)
        if place < len(chart.panels):
            axes.sharex(rows[0])
            _name_lines(axes, panel)
        else:
            axes.axvspan(*chart.view, fill=False)
        if place < len(chart.panels) - 1:
            axes.tick_params(labelbottom=False)
    rows[-1].set_xlabel(chart.x_label)
    picture.suptitle(chart.title)
    for file in files:
        # nothing of date or program in it: the same drive gives the same bytes
        picture.savefig(file, dpi=100, metadata={'Software': None} if file.suffix == '.png' else None)


def _draw_panel(axes: Axes, panel: Panel, limits: Limits | None, shade: Curve | None) -> None:
    for curve in panel.curves:
        x, y = _shown(curve, limits)
        style: Any = {'linestyle': curve.dash, 'linewidth': _LINE}
        if curve.dash == POINTS:
            style = {'linestyle': 'none', 'marker': 'o', 'markersize': 5}
        axes.plot(x, y, color=curve.colour, label=curve.name, **style)
    for level in panel.levels:
        for value in (level.value, -level.value):
            style = {'linestyle': level.dash, 'linewidth': 1.0}
            axes.axhline(value, color=level.colour, label=level.name, **style)
    for value in panel.least:
        axes.axhline(value, linewidth=0.0)
    if limits is not None:
        axes.set_xlim(*limits)
    if panel.log:
        axes.set_yscale('log')
    axes.grid(alpha=0.25)
    if shade is not None:
        first, last = axes.get_xlim()
        axes.set(xlim=(first, last), ylim=axes.get_ylim())  # the image does not move them
        time = np.linspace(first, last, _SHADES)
        image = np.full((1, _SHADES, 4), to_rgba(shade.colour))
        image[0, :, 3] = SHADING * np.interp(time, shade.x, shade.y, 0.0, 0.0)
        across = axes.get_xaxis_transform()
        axes.imshow(image, extent=(first, last, 0.0, 1.0), transform=across, aspect='auto')


def _name_lines(axes: Axes, panel: Panel) -> None:
    """Name what is drawn above the axes, in its own colour; a single curve is named by its axis."""
    names = {curve.name for curve in panel.curves}
    handles = dict(zip(*reversed(axes.get_legend_handles_labels()), strict=True))
    kept = {name: handle for name, handle in handles.items() if len(names) > 1 or name not in names}
    if not kept:
        return
    axes.legend(
        kept.values(), kept, loc='lower right', bbox_to_anchor=(1.0, 0.99), ncols=3, frameon=False,
        fontsize='small', labelcolor=[handle.get_color() for handle in kept.values()],
        handlelength=1.4, columnspacing=1.2, borderaxespad=0.1,
    )  # fmt: skip


def _shown(curve: Curve, limits: Limits | None) -> tuple[Array, Array]:
    """Return what lies within the limits; of a long curve over a rising x no peak is left out."""
    x, y = curve.x, curve.y
    if len(x) < 2 or not np.all(np.diff(x) > 0.0):
        return x, y
    if limits is not None:
        inside = slice(max(0, np.searchsorted(x, limits[0]) - 1), np.searchsorted(x, limits[1]) + 1)
        x, y = x[inside], y[inside]
    if len(x) <= _POINTS:
        return x, y
    step = 2.0 * (x[-1] - x[0]) / _POINTS
    pairs = ranges(x, y, step)
    return np.repeat(x[0] + step * (np.arange(len(pairs)) + 0.5), 2), pairs.ravel()


def draw_road(profile: RoadProfile, found: Unevenness, file: Path) -> None:
    """Write the picture to `file` (PNG): heights without long waves, and density with the fitted line."""
    picture = Figure(figsize=(10.0, 6.5), layout='constrained')
    above, below = picture.subplots(2, 1, height_ratios=(2, 3))
    heights = 1e3 * without_long_waves(profile.height, profile.spacing)
    above.plot(profile.distance, heights, color=COLOURS[0], linewidth=0.7)
    above.set(xlabel='distance (m)', ylabel=f'height (mm), waves up to {LONGEST_WAVE:g} m')
    ends = np.array([found.frequency[0], found.frequency[-1]])
    for number, letter in enumerate(CLASSES[:-1]):
        limits = FIRST_LIMIT * 4.0**number * (ends / REFERENCE_FREQUENCY) ** -2.0
        below.loglog(ends, limits, color=SPAN_COLOUR, linewidth=0.6)
        place = (ends[0], 0.5 * limits[0])
        below.annotate(letter, place, color=SPAN_COLOUR, fontsize=8, ha='right', va='center')
    below.loglog(found.frequency, found.density, color=COLOURS[0], label='measured, smoothed')
    fitted = np.array([found.lowest, found.highest])
    line = found.roughness * (fitted / REFERENCE_FREQUENCY) ** -found.waviness
    label = f'class {found.letter}, waviness {found.waviness:.2f}'
    below.loglog(fitted, line, '--', color=LEVEL_COLOUR, label=label)
    below.set(xlabel='spatial frequency (cycles/m)', ylabel='density of the height (m³)')
    below.legend(loc='lower left', fontsize='small')
    for axes in (above, below):
        axes.grid(alpha=0.25)
    picture.suptitle(f'{profile.name}: road of {profile.length:.0f} m')
    picture.savefig(file, dpi=100)
