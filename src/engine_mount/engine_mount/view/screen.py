"""The state of the graph on one screen of a terminal."""

from rich.console import Group, RenderableType
from rich.table import Table
from rich.text import Text

from engine_mount.view.model import Model

_STYLES = {'ok': 'green', 'warning': 'yellow', 'error': 'red', 'silent': 'bright_black'}
_EVENTS = 6  # chosen: the last ones


def status_screen(model: Model, title: str) -> RenderableType:
    """Return nodes, figures and events, for 80 columns."""
    state = model.state_json()
    nodes, figures = (Table.grid(padding=(0, 2)) for _ in range(2))
    for node in state['nodes']:
        sentence = f'{node["state"]}: {node["sentence"]}' if node['state'] else node['sentence']
        nodes.add_row(Text(node['name'], _STYLES[node['level']]), Text(sentence))
    if not state['nodes']:
        nodes.add_row(Text('no node has told anything yet'))
    for entry in state['values']:
        figures.add_row(entry['name'], Text(entry['value'], justify='right'))
    events = [
        Text(f'{event["time"]:9.2f} s  {event["kind"]}: {event["text"]}')
        for event in state['events'][:_EVENTS]
    ]
    return Group(Text(title, 'bold'), nodes, figures, *events)
