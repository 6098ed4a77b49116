"""Charts as PNG."""

from pathlib import Path
from typing import Any

import matplotlib

matplotlib.use('Agg')

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from engine_mount.reports.drawing.chart import DASHED, DOTTED, SOLID, Array, Chart, Curve, Level, Panel
from engine_mount.reports.drawing.envelope import envelope
from engine_mount.reports.drawing.style import SPAN_COLOUR

_STYLES: dict[str, Any] = {SOLID: '-', DASHED: '--', DOTTED: ':'}
_WIDTH, _PANEL_HEIGHT = 10.0, 2.6  # inches, chosen: 1000 pixels wide
_POINTS = 8000  # of a curve, chosen: 4 to a pixel of both kinds, lowest and highest


def draw_chart(chart: Chart, file: Path) -> None:
    """Write the picture of `chart` to `file` (PNG, 1000 pixels wide, or by its suffix SVG)."""
    shares = [panel.share for panel in chart.panels]
    picture = Figure(figsize=(_WIDTH, 1.0 + _PANEL_HEIGHT * sum(shares)), layout='constrained')
    rows = picture.subplots(len(shares), 1, sharex=True, height_ratios=shares, squeeze=False)[:, 0]
    for axes, panel in zip(rows, chart.panels, strict=True):
        draw_panel(axes, panel, chart.view or chart.limits)
        for place, span in enumerate(chart.spans):
            name = chart.span_name if place == 0 and axes is rows[0] else None
            axes.axvspan(span.begin, span.end, color=SPAN_COLOUR, alpha=0.15, linewidth=0, label=name)
        name_lines(axes, panel)
    rows[-1].set_xlabel(chart.x_label)
    if chart.ticks:
        rows[-1].set_xticks(list(chart.ticks))
    picture.suptitle(chart.title)
    picture.savefig(file, dpi=100)


def draw_panel(axes: Axes, panel: Panel, limits: tuple[float, float] | None = None) -> None:
    """Draw curves, dots and levels of `panel`, its x axis within `limits`."""
    for curve in panel.curves:
        _draw_curve(axes, curve, limits)
    for dots in panel.dots:
        axes.plot(dots.x, dots.y, 'o', color=dots.colour, markersize=5, label=dots.name)
    for level in panel.levels:
        _draw_level(axes, level)
    if limits is not None:
        axes.set_xlim(*limits)
    if panel.log:
        axes.set_yscale('log')
    axes.set_ylabel(panel.label)
    axes.grid(alpha=0.25)


def name_lines(axes: Axes, panel: Panel) -> None:
    """Name what is drawn above the axes, in its own colour; a single curve is named by its axis."""
    handles, labels = axes.get_legend_handles_labels()
    single = len(panel.curves) + len(panel.dots) == 1
    names = {curve.name for curve in (*panel.curves, *panel.dots)}
    kept = [
        (handle, label)
        for handle, label in zip(handles, labels, strict=True)
        if not single or label not in names
    ]
    if kept:
        legend = axes.legend(
            *zip(*kept, strict=True), loc='lower right', bbox_to_anchor=(1.0, 0.99), ncols=len(kept),
            frameon=False, fontsize='small', labelcolor='linecolor', handlelength=1.4, columnspacing=1.2,
            borderaxespad=0.1,
        )  # fmt: skip
        for text, (_, label) in zip(legend.get_texts(), kept, strict=True):
            if label not in names:
                text.set_color(SPAN_COLOUR)  # a shaded stretch, whose own colour is too pale to read


def _draw_curve(axes: Axes, curve: Curve, limits: tuple[float, float] | None) -> None:
    x, y = _shown(curve.x, curve.y, limits)
    axes.plot(
        x,
        y,
        color=curve.colour,
        linestyle=_STYLES[curve.dash],
        linewidth=curve.width,
        label=curve.name,
        drawstyle='steps-post' if curve.steps else 'default',
    )


def _shown(x: Array, y: Array, limits: tuple[float, float] | None) -> tuple[Array, Array]:
    """Return what lies within the limits, of a long curve over a rising x its envelope."""
    if len(x) < 2 or not np.all(np.diff(x) > 0.0):
        return x, y
    if limits is not None:
        inside = slice(max(0, np.searchsorted(x, limits[0]) - 1), np.searchsorted(x, limits[1]) + 1)
        x, y = x[inside], y[inside]
    return envelope(x, y, _POINTS)


def _draw_level(axes: Axes, level: Level) -> None:
    for value in (level.value, -level.value) if level.both else (level.value,):
        axes.axhline(value, color=level.colour, linestyle=_STYLES[level.dash], linewidth=1.0)
    axes.annotate(
        level.name, (0.0, level.value), xycoords=('axes fraction', 'data'), textcoords='offset points',
        xytext=(4, 1), color=level.colour, fontsize='small', va='bottom',
    )  # fmt: skip
