"""Charts as the page's script takes them: long curves at a level of detail that keeps the page small."""

import base64
from collections.abc import Sequence
from typing import Any

import numpy as np

from engine_mount.reports.drawing.chart import SHADING, Array, Chart, Curve

NUMBERS = 400_000
"""Of all long curves of a page together, chosen: 1.1 MB as text, in which 6 signals of 60 s fit whole."""
_LONG = 3000  # points, chosen: a curve of fewer is told point by point
_UNKNOWN = -32768  # of int16; the others are values from low to high
_STEPS = 65_534  # of int16 from the lowest to the highest value of a curve
_UNEVEN = 0.1  # chosen: of the sample time, that a stamp may be off an even grid


def budget_of(charts: Sequence[Chart]) -> int:
    """Return how many numbers each long curve may have, so that all together have at most `NUMBERS`."""
    curves = [curve for chart in charts for panel in chart.panels for curve in panel.curves]
    curves += [chart.shade for chart in charts if chart.shade]
    return max(_LONG, NUMBERS // max(1, sum(len(curve.x) > _LONG for curve in curves)))


def browser_chart(chart: Chart, budget: int = NUMBERS) -> dict[str, Any]:
    """Return `chart` for the script; curves over a rising x have at most `budget` numbers."""
    panels = [
        {
            **vars(panel),
            'curves': [_browser_curve(curve, budget) for curve in panel.curves],
            'levels': [vars(level) for level in panel.levels],
        }
        for panel in chart.panels
    ]
    shade = chart.shade and _browser_curve(chart.shade, budget)
    return {**vars(chart), 'panels': panels, 'shade': shade, 'shading': SHADING}


def _browser_curve(curve: Curve, budget: int) -> dict[str, Any]:
    x, y = curve.x, curve.y
    found = {name: value for name, value in vars(curve).items() if name not in ('x', 'y')}
    found['rising'] = len(x) > 1 and bool(np.all(np.diff(x) > 0.0))
    if found['rising'] and len(x) > _LONG and np.isfinite(y).any():
        return {**found, 'even': even_numbers(x, y, budget)}
    points = {'x': _text(np.asarray(x, '<f8')), 'y': _text(np.asarray(y, '<f4'))}
    return {**found, 'points': points}


def even_numbers(x: Array, y: Array, budget: int) -> dict[str, Any]:
    """Return a curve over rising `x` at even steps: its samples, or of each step the lowest and the highest.

    Samples if at most `budget` of them lie on an even grid. Missing and unknown ones stay unknown. Values are
    told to 1 / 65534 of their range.
    """
    step = float(np.median(np.diff(x)))
    places = (x - x[0]) / step
    count = round(places[-1]) + 1
    grid = np.round(places).astype(np.int64)
    even = count <= budget and np.all(np.abs(places - grid) <= _UNEVEN) and np.all(np.diff(grid) > 0)
    if even:
        values = np.full(count, np.nan)
        values[grid] = y
    else:
        step *= max(1, -(-2 * count // budget))
        values = ranges(x, y, step).ravel()
    low, high = np.nanmin(values), np.nanmax(values)
    size = (high - low) / _STEPS or 1.0
    steps = np.round((values - low) / size) - 32767
    text = _text(np.where(np.isnan(steps), _UNKNOWN, steps).astype('<i2'))
    return {'begin': float(x[0]), 'step': step, 'pairs': not even, 'low': low, 'size': size, 'values': text}


def ranges(x: Array, y: Array, step: float) -> Array:
    """Return (n, 2): the lowest and the highest known value of each `step` of a rising x."""
    group = ((x - x[0]) / step + 1e-9).astype(np.int64)
    found = np.full((group[-1] + 1, 2), np.nan)
    begins = np.flatnonzero(np.diff(group, prepend=-1))
    found[group[begins], 0] = np.fmin.reduceat(y, begins)
    found[group[begins], 1] = np.fmax.reduceat(y, begins)
    return found


def _text(values: np.ndarray) -> str:
    return base64.b64encode(np.ascontiguousarray(values).tobytes()).decode('ascii')
