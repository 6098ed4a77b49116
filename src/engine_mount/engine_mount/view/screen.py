"""The state of the graph on one screen of a terminal."""

import math

from rich.console import Group, RenderableType
from rich.table import Table
from rich.text import Text

from engine_mount.view.window.model import Model
from engine_mount.view.window.told import told_state, values
from engine_mount.view.window.traces import INTERVALS_PER_SECOND, LATENCY, TRACES, Extent

_STYLES = {'ok': 'green', 'warning': 'yellow', 'error': 'red', 'silent': 'bright_black'}
_EVENTS = 6  # chosen: the last ones
_SHOWN = 3 * INTERVALS_PER_SECOND  # intervals whose extent is shown: 3 s


def status_screen(model: Model, title: str) -> RenderableType:
    """Return nodes, signals of the last 3 s, figures and events, for 80 columns."""
    state = told_state(model)
    nodes = Table(box=None, show_header=False, padding=(0, 1))
    for node in state['nodes']:
        told = f'{node["state"]}: {node["sentence"]}' if node['state'] else node['sentence']
        nodes.add_row(Text(node['name'], _STYLES[node['level']]), Text(told))
    if not state['nodes']:
        nodes.add_row(Text('no node has told anything yet'))
    figures = Table(box=None, show_header=False, padding=(0, 1))
    for name, value in values(model.state):
        figures.add_row(name, Text(value, justify='right'))
    events = [
        Text(f'{event["time"]:9.2f} s  {event["kind"]}: {event["text"]}')
        for event in state['events'][:_EVENTS]
    ]
    return Group(Text(title, 'bold'), nodes, _signals(model), figures, *events)


def _signals(model: Model) -> Table:
    table = Table(box=None, padding=(0, 1))
    for name in ('last 3 s', 'least', 'highest', 'unit'):
        table.add_column(name, justify='left' if name in ('last 3 s', 'unit') else 'right')
    intervals = list(model.intervals)[-_SHOWN:]
    beside = model.beside.alternatives if model.beside is not None else ()
    lines = [(trace.key, f'{trace.panel}, {trace.label}', trace.unit) for trace in (*TRACES, LATENCY)]
    lines[1:1] = [(f'beside.{one.key}', f'displacement, {one.label}', 'mm') for one in beside]
    for key, label, unit in lines:
        low, high = _over([interval.extents[key] for interval in intervals if key in interval.extents])
        if low == low:
            table.add_row(label, f'{low:.3g}', f'{high:.3g}', '' if unit == '1' else unit)
    return table


def _over(extents: list[Extent]) -> Extent:
    known = [extent for extent in extents if extent[0] == extent[0]]
    if not known:
        return math.nan, math.nan
    return min(low for low, _ in known), max(high for _, high in known)
