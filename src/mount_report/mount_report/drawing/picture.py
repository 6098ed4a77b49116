"""Charts as PNG."""

from pathlib import Path
from typing import Any

import matplotlib

matplotlib.use('Agg')

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from mount_report.drawing.chart import DASHED, DOTTED, SOLID, Bars, Chart, Panel, Span, needs_legend
from mount_report.drawing.style import COLOURS, LEVEL_COLOUR, SPAN_COLOUR

_STYLES: dict[str, Any] = {SOLID: '-', DASHED: '--', DOTTED: ':'}
_WIDTH, _PANEL_HEIGHT = 10.0, 2.6  # inches, chosen: 1000 pixels wide


def draw_chart(chart: Chart, file: Path) -> None:
    """Write the picture of `chart` to `file` (PNG, 1000 pixels wide)."""
    shares = [panel.share for panel in chart.panels]
    picture = Figure(figsize=(_WIDTH, 1.0 + _PANEL_HEIGHT * sum(shares)), layout='constrained')
    rows = picture.subplots(len(shares), 1, sharex=True, height_ratios=shares, squeeze=False)[:, 0]
    for axes, panel in zip(rows, chart.panels, strict=True):
        _draw_panel(axes, panel, chart.spans, chart.span_name)
    rows[-1].set_xlabel(chart.x_label)
    if chart.limits is not None:
        rows[-1].set_xlim(*chart.limits)
    if chart.ticks:
        rows[-1].set_xticks(list(chart.ticks))
    named = {
        label: handle
        for axes in rows
        for handle, label in zip(*axes.get_legend_handles_labels(), strict=True)
    }
    if needs_legend(chart):
        picture.legend(
            list(named.values()), list(named), loc='outside lower center', ncols=3, fontsize='small'
        )
    picture.suptitle(chart.title)
    picture.savefig(file, dpi=100)


def _draw_panel(axes: Axes, panel: Panel, spans: Any, span_name: str) -> None:
    for curve in panel.curves:
        colour = COLOURS[curve.colour % len(COLOURS)]
        axes.plot(
            curve.x,
            curve.y,
            color=colour,
            linestyle=_STYLES[curve.dash],
            linewidth=1.0,
            label=curve.name if len(panel.curves) > 1 else None,  # a single one is named by its axis
            drawstyle='steps-post' if curve.steps else 'default',
        )
    for place, bars in enumerate(panel.bars):
        _draw_bars(axes, bars, place, len(panel.bars))
    for level in panel.levels:
        style = {'color': LEVEL_COLOUR, 'linestyle': _STYLES[level.dash], 'linewidth': 1.0}
        axes.axhline(level.value, label=level.name, **style)
        if level.both:
            axes.axhline(-level.value, **style)
    for place, span in enumerate(spans):
        _draw_span(axes, span, span_name if place == 0 else '')
    if panel.log:
        axes.set_yscale('log')
    axes.set_ylabel(panel.label)
    axes.grid(alpha=0.25)


def _draw_bars(axes: Axes, bars: Bars, place: int, of: int) -> None:
    width = 0.8 / of
    positions = np.asarray(bars.x) + (place - 0.5 * (of - 1)) * width
    axes.bar(positions, bars.heights, width, color=COLOURS[bars.colour % len(COLOURS)], label=bars.name)


def _draw_span(axes: Axes, span: Span, name: str) -> None:
    axes.axvspan(
        span.begin, span.end, color=SPAN_COLOUR, alpha=0.15, linewidth=0, label=name if name else None
    )
