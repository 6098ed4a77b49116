"""Charts for the browser, as the data and the layout that plotly.js takes."""

import base64
import importlib.resources
from typing import Any

import numpy as np

from mount_report.drawing.chart import Array, Chart, ChartError, Curve, Panel, needs_legend
from mount_report.drawing.envelope import envelope
from mount_report.drawing.style import COLOURS, LEVEL_COLOUR, SPAN_COLOUR

POINTS = 12_000  # of a curve, chosen: more than a screen has columns, so that one can look closer
_WIDTH, _PANEL_HEIGHT, _FRAME = 980, 220, 150  # pixels
_GAP = 0.05  # of the height, between panels


def plotly_script() -> str:
    """Return the text of plotly.js, which draws the charts in the page; raises `ChartError`."""
    try:
        package = importlib.resources.files('plotly')
    except ModuleNotFoundError:
        raise ChartError('the page needs plotly.js from the package plotly; pip install plotly') from None
    return (package / 'package_data' / 'plotly.min.js').read_text(encoding='utf-8')


def plotly_figure(chart: Chart, points: int = POINTS) -> dict[str, Any]:
    """Return `data` and `layout` of `chart`; curves over a rising x have at most `points` points."""
    rows = len(chart.panels)
    layout = _layout(chart)
    data: list[dict[str, Any]] = []
    for place, panel in enumerate(chart.panels):
        axes = {'xaxis': 'x', 'yaxis': _axis('y', place)}
        named = {'showlegend': len(panel.curves) > 1}  # a single one is named by its axis
        data += [{**_line(curve, points), **axes, **named} for curve in panel.curves]
        data += [
            {
                'type': 'bar',
                'name': _text(bars.name),
                'x': _packed(bars.x),
                'y': _packed(bars.heights),
                'marker': {'color': COLOURS[bars.colour % len(COLOURS)]},
                **axes,
            }
            for bars in panel.bars
        ]
        layout['shapes'] += _level_shapes(panel, axes['yaxis'])
        data += _level_entries(panel, axes)
    if chart.spans:
        layout['shapes'] += [_span_shape(span.begin, span.end) for span in chart.spans]
        data.append(_span_entry(chart.span_name, _axis('y', rows - 1)))
    return {'data': data, 'layout': layout}


def _layout(chart: Chart) -> dict[str, Any]:
    shares = np.array([panel.share for panel in chart.panels])
    free = 1.0 - _GAP * (len(shares) - 1)
    heights = free * shares / shares.sum()
    layout: dict[str, Any] = {
        'width': _WIDTH,
        'height': int(_FRAME + _PANEL_HEIGHT * shares.sum()),
        'margin': {'l': 75, 'r': 15, 't': 30, 'b': 50},
        'legend': {'orientation': 'h', 'y': -70.0 / (_PANEL_HEIGHT * shares.sum()), 'yanchor': 'top'},
        'showlegend': needs_legend(chart),
        'hovermode': 'closest',
        'font': {'family': 'sans-serif', 'size': 12},
        'plot_bgcolor': 'white',
        'shapes': [],
        'barmode': 'group',
        'xaxis': {
            'title': {'text': chart.x_label},
            'anchor': _axis('y', len(shares) - 1),
            'gridcolor': '#e4e4e4',
            'zeroline': False,
            'showline': True,
            'linecolor': '#888888',
        },
    }
    if chart.limits is not None:
        layout['xaxis']['range'] = list(chart.limits)
    if chart.ticks:
        layout['xaxis']['tickvals'] = list(chart.ticks)
    top = 1.0
    for place, (panel, height) in enumerate(zip(chart.panels, heights, strict=True)):
        layout[f'yaxis{place + 1 if place else ""}'] = {
            'title': {'text': _text(panel.label).replace('\n', '<br>')},
            'domain': [max(0.0, top - height), top],
            'anchor': 'x',
            'gridcolor': '#e4e4e4',
            'zerolinecolor': '#c0c0c0',
            'showline': True,
            'linecolor': '#888888',
            **({'type': 'log', 'exponentformat': 'power'} if panel.log else {}),
        }
        top -= height + _GAP
    return layout


def _line(curve: Curve, points: int) -> dict[str, Any]:
    x, y = curve.x, curve.y
    if len(x) > points and bool(np.all(np.diff(x) > 0.0)):
        x, y = envelope(x, y, points)
    shape = {'shape': 'hv'} if curve.steps else {}
    colour = COLOURS[curve.colour % len(COLOURS)]
    return {
        'type': 'scatter',
        'mode': 'lines',
        'name': _text(curve.name),
        'x': _packed(x, np.float64),
        'y': _packed(y),
        'line': {'color': colour, 'width': 1.2, 'dash': curve.dash, **shape},
    }


def _level_shapes(panel: Panel, axis: str) -> list[dict[str, Any]]:
    return [
        {
            'type': 'line',
            'xref': 'paper',
            'x0': 0,
            'x1': 1,
            'yref': axis,
            'y0': value,
            'y1': value,
            'line': {'color': LEVEL_COLOUR, 'width': 1, 'dash': level.dash},
        }
        for level in panel.levels
        for value in ((level.value, -level.value) if level.both else (level.value,))
    ]


def _level_entries(panel: Panel, axes: dict[str, str]) -> list[dict[str, Any]]:
    """Return what puts levels, which are shapes, into the legend."""
    return [
        {
            'type': 'scatter',
            'mode': 'lines',
            'name': _text(level.name),
            'x': [None],
            'y': [None],
            'line': {'color': LEVEL_COLOUR, 'width': 1, 'dash': level.dash},
            **axes,
        }
        for level in panel.levels
    ]


def _span_shape(begin: float, end: float) -> dict[str, Any]:
    return {
        'type': 'rect',
        'xref': 'x',
        'x0': begin,
        'x1': end,
        'yref': 'paper',
        'y0': 0,
        'y1': 1,
        'fillcolor': SPAN_COLOUR,
        'opacity': 0.15,
        'line': {'width': 0},
        'layer': 'below',
    }


def _span_entry(name: str, axis: str) -> dict[str, Any]:
    return {
        'type': 'scatter',
        'mode': 'markers',
        'name': _text(name),
        'x': [None],
        'y': [None],
        'marker': {'symbol': 'square', 'size': 12, 'color': SPAN_COLOUR, 'opacity': 0.3},
        'xaxis': 'x',
        'yaxis': axis,
    }


def _axis(letter: str, place: int) -> str:
    return f'{letter}{place + 1}' if place else letter


def _text(text: str) -> str:
    """Return a text that plotly.js shows as it is: it reads tags in names."""
    return text.replace('&', '&amp;').replace('<', '&lt;').replace('>', '&gt;')


def _packed(values: Array, kind: type = np.float32) -> dict[str, str]:
    """Return numbers as bytes, which is half as long as digits and read at once."""
    raw = np.ascontiguousarray(values, np.dtype(kind).newbyteorder('<'))
    return {'dtype': f'f{raw.itemsize}', 'bdata': base64.b64encode(raw.tobytes()).decode('ascii')}
