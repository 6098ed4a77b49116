"""Charts as PNG or SVG."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import matplotlib

matplotlib.use('Agg')

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from engine_mount.reports.drawing.chart import (
    DASHED,
    DOTTED,
    SOLID,
    SPAN_COLOUR,
    Array,
    Chart,
    Curve,
    Limits,
    Panel,
)
from engine_mount.reports.drawing.detail import ranges

_STYLES: dict[str, Any] = {SOLID: '-', DASHED: '--', DOTTED: ':'}
_POINTS = 8000  # of a curve, chosen: 4 to a pixel of both kinds, lowest and highest


def draw_chart(chart: Chart, *files: Path, views: Mapping[str, Limits | None] | None = None) -> None:
    """Write the picture of `chart` to `files`, PNG or by its suffix SVG: 1000 pixels wide, 1200 of two views.

    `views` are {title: limits of the x axis}, beside one another; by default what the chart shows at first.
    """
    views = views or {'': chart.view or chart.limits}
    shares = [panel.share for panel in chart.panels]
    size = (10.0, 1.0 + 2.6 * sum(shares)) if len(views) == 1 else (12.0, 1.0 + 2.0 * sum(shares))
    picture = Figure(figsize=size, layout='constrained')
    rows = picture.subplots(len(shares), len(views), sharex='col', height_ratios=shares, squeeze=False)
    for column, (title, limits) in zip(rows.T, views.items(), strict=True):
        for axes, panel in zip(column, chart.panels, strict=True):
            first = axes is rows[0, 0]
            _draw_panel(axes, panel, limits)
            for place, span in enumerate(chart.spans):
                name = chart.span_name if place == 0 and first else None
                axes.axvspan(span.begin, span.end, color=SPAN_COLOUR, alpha=0.15, linewidth=0, label=name)
            if axes in rows[:, 0]:
                axes.set_ylabel(panel.label)
                _name_lines(axes, panel)
        column[0].set_title(title, fontsize='medium')
        column[-1].set_xlabel(chart.x_label)
        if chart.ticks:
            column[-1].set_xticks(list(chart.ticks))
    picture.suptitle(chart.title)
    for file in files:
        picture.savefig(file, dpi=100)


def _draw_panel(axes: Axes, panel: Panel, limits: Limits | None) -> None:
    for curve in panel.curves:
        x, y = _shown(curve, limits)
        steps = 'steps-post' if curve.steps else 'default'
        style = {'linestyle': _STYLES[curve.dash], 'linewidth': curve.width, 'drawstyle': steps}
        axes.plot(x, y, color=curve.colour, label=curve.name, **style)
    for dots in panel.dots:
        axes.plot(dots.x, dots.y, 'o', color=dots.colour, markersize=5, label=dots.name)
    for level in panel.levels:
        for value in (level.value, -level.value):
            axes.axhline(value, color=level.colour, linestyle=_STYLES[level.dash], linewidth=1.0)
        axes.annotate(
            level.name, (0.0, level.value), xycoords=('axes fraction', 'data'), textcoords='offset points',
            xytext=(4, 1), color=level.colour, fontsize='small', va='bottom',
        )  # fmt: skip
    if limits is not None:
        axes.set_xlim(*limits)
    if panel.log:
        axes.set_yscale('log')
    axes.grid(alpha=0.25)


def _name_lines(axes: Axes, panel: Panel) -> None:
    """Name what is drawn above the axes, in its own colour; a single curve is named by its axis."""
    names = {curve.name for curve in (*panel.curves, *panel.dots)}
    handles = dict(zip(*reversed(axes.get_legend_handles_labels()), strict=True))
    kept = {name: handle for name, handle in handles.items() if len(names) > 1 or name not in names}
    if not kept:
        return
    legend = axes.legend(
        kept.values(), kept, loc='lower right', bbox_to_anchor=(1.0, 0.99), ncols=len(kept),
        frameon=False, fontsize='small', labelcolor='linecolor', handlelength=1.4, columnspacing=1.2,
        borderaxespad=0.1,
    )  # fmt: skip
    for text, name in zip(legend.get_texts(), kept, strict=True):
        if name not in names:
            text.set_color(SPAN_COLOUR)  # a shaded stretch, whose own colour is too pale to read


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
