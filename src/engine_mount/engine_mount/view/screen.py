"""The state of the graph on one screen of a terminal."""

from rich.console import Group, RenderableType
from rich.table import Table
from rich.text import Text

from engine_mount.view.model import INTERVALS_PER_SECOND, PANELS, Model

_STYLES = {'ok': 'green', 'warning': 'yellow', 'error': 'red', 'silent': 'bright_black'}
_EVENTS = 6  # chosen: the last ones
_SHOWN = 3 * INTERVALS_PER_SECOND  # intervals whose extent is shown: 3 s


def status_screen(model: Model, title: str) -> RenderableType:
    """Return nodes, signals of the last 3 s, figures and events, for 80 columns."""
    state = model.state_json()
    nodes = _table()
    for node in state['nodes']:
        sentence = f'{node["state"]}: {node["sentence"]}' if node['state'] else node['sentence']
        nodes.add_row(Text(node['name'], _STYLES[node['level']]), Text(sentence))
    if not state['nodes']:
        nodes.add_row(Text('no node has told anything yet'))
    figures = _table()
    for entry in state['values']:
        figures.add_row(entry['name'], Text(entry['value'], justify='right'))
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
    for trace in model.traces:
        known = [interval.extents[trace.key] for interval in intervals if trace.key in interval.extents]
        if known:
            low, high = min(low for low, _ in known), max(high for _, high in known)
            label = f'{trace.panel}, {trace.label}'
            table.add_row(label, f'{low:.3g}', f'{high:.3g}', PANELS[trace.panel][0])
    return table


def _table() -> Table:
    return Table(box=None, show_header=False, padding=(0, 1))
