"""Charts as the page's script takes them: long curves at a level of detail that keeps the page small."""

import base64
from collections.abc import Sequence
from typing import Any

import numpy as np

from engine_mount.reports.drawing.chart import Array, Chart, Curve, Dots, Panel
from engine_mount.reports.drawing.style import SPAN_COLOUR

NUMBERS = 400_000
"""Of all long curves of a page together, chosen: 1.1 MB as text, in which 6 signals of 60 s fit whole."""
_LONG = 3000  # points, chosen: a curve of fewer is told point by point
_UNKNOWN = -32768  # of int16; the others are values from low to high
_STEPS = 65_534  # of int16 from the lowest to the highest value of a curve
_UNEVEN = 0.1  # chosen: of the sample time, that a stamp may be off an even grid


def budget_of(charts: Sequence[Chart], numbers: int = NUMBERS) -> int:
    """Return how many numbers each long curve may have, so that all together have at most `numbers`.

    What short ones leave goes to the longer ones.
    """
    lengths = sorted(len(curve.x) for chart in charts for panel in chart.panels for curve in panel.curves)
    lengths = [length for length in lengths if length > _LONG]
    share = numbers
    for place, length in enumerate(lengths):
        share = numbers // (len(lengths) - place)
        if length > share:
            break
        numbers -= length
    return max(_LONG, share)


def browser_chart(chart: Chart, budget: int = NUMBERS) -> dict[str, Any]:
    """Return `chart` for the script; curves over a rising x have at most `budget` numbers."""
    return {
        'title': chart.title,
        'x_label': chart.x_label,
        'shared': chart.x_label.startswith('time'),
        'limits': chart.limits,
        'view': chart.view,
        'ticks': list(chart.ticks),
        'edge': any(panel.dots for panel in chart.panels),
        'spans': [[span.begin, span.end] for span in chart.spans],
        'span_name': chart.span_name,
        'span_colour': SPAN_COLOUR,
        'panels': [_panel(panel, budget) for panel in chart.panels],
    }


def _panel(panel: Panel, budget: int) -> dict[str, Any]:
    return {
        'label': ' '.join(panel.label.split()),
        'log': panel.log,
        'share': panel.share,
        'curves': [
            {
                **_named(curve),
                'dash': curve.dash,
                'steps': curve.steps,
                'width': curve.width,
                **_numbers(curve, budget),
            }
            for curve in panel.curves
        ],
        'dots': [
            {**_named(dots), 'dash': 'solid', 'rising': True, 'points': _points(dots.x, dots.y)}
            for dots in panel.dots
        ],
        'levels': [
            {
                'name': level.name,
                'value': level.value,
                'both': level.both,
                'dash': level.dash,
                'colour': level.colour,
            }
            for level in panel.levels
        ],
    }


def _named(what: Curve | Dots) -> dict[str, str]:
    return {'name': what.name, 'colour': what.colour}


def _numbers(curve: Curve, budget: int) -> dict[str, Any]:
    x, y = curve.x, curve.y
    rising = len(x) > 1 and bool(np.all(np.diff(x) > 0.0))
    if len(x) <= _LONG or not rising or not np.isfinite(y).any():
        return {'rising': rising, 'points': _points(x, y)}
    even = even_numbers(x, y, budget)
    return {'even': even}


def even_numbers(x: Array, y: Array, budget: int) -> dict[str, Any]:
    """Return a curve over rising `x` at even steps: its samples, or of each step the lowest and the highest.

    Samples if at most `budget` of them lie on an even grid. Missing and unknown ones stay unknown. Values are
    told to 1 / 65534 of their range.
    """
    step = float(np.median(np.diff(x)))
    places = (x - x[0]) / step
    count = round(float(places[-1])) + 1
    grid = np.round(places).astype(np.int64)
    even = count <= budget and np.all(np.abs(places - grid) <= _UNEVEN) and np.all(np.diff(grid) > 0)
    if even:
        columns = np.full((count, 1), np.nan)
        columns[grid, 0] = y
    else:
        step *= max(1, -(-2 * count // budget))
        columns = _ranges(((x - x[0]) / step + 1e-9).astype(np.int64), y)
    return {'begin': float(x[0]), 'step': step, 'pairs': not even, **_quantised(columns)}


def _ranges(group: np.ndarray, y: Array) -> Array:
    """Return (groups, 2): the lowest and the highest known value of each group, numbered from 0 on."""
    found = np.full((int(group[-1]) + 1, 2), np.nan)
    begins = np.flatnonzero(np.diff(group, prepend=-1))
    found[group[begins], 0] = np.fmin.reduceat(y, begins)
    found[group[begins], 1] = np.fmax.reduceat(y, begins)
    return found


def _quantised(columns: Array) -> dict[str, Any]:
    low, high = float(np.nanmin(columns)), float(np.nanmax(columns))
    size = (high - low) / _STEPS or 1.0
    steps = np.round((columns - low) / size) - 32767
    values = np.where(np.isnan(steps), _UNKNOWN, steps).astype('<i2')
    return {'low': low, 'size': size, 'values': _text(values)}


def _points(x: Array, y: Array) -> dict[str, str]:
    return {'x': _text(np.asarray(x, '<f8')), 'y': _text(np.asarray(y, '<f4'))}


def _text(values: np.ndarray) -> str:
    return base64.b64encode(np.ascontiguousarray(values).tobytes()).decode('ascii')
