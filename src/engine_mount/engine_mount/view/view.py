"""One look at a graph or a recording: feed, model, and what shows them, from the beginning to the end."""

import threading
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import ExitStack, contextmanager
from pathlib import Path
from typing import TYPE_CHECKING

from engine_mount.view.feed import Feed, FeedError, Receive, RecordedFeed, RunningGraph
from engine_mount.view.model import BESIDE, Model, namespace_of
from mount_bringup.graph.shutdown import ending_signals

if TYPE_CHECKING:
    from rich.console import RenderableType


@contextmanager
def open_feed(
    recording: Path | None = None,
    *,
    rate: float = 1.0,
    begin: float = 0.0,
    domain: int = 0,
    namespace: str = '',
) -> Iterator[Feed]:
    """Give the feed of a recording from `begin` (s) on, or of the running graph.

    Raises `FeedError` or a `ValueError`.
    """
    feed = RecordedFeed(recording, rate, begin, namespace) if recording else RunningGraph(domain, namespace)
    try:
        yield feed
    finally:
        feed.stop()


@contextmanager
def running_model(
    feed: Feed,
    *,
    beside: bool,
    receivers: Sequence[Receive] = (),
    on_failure: Callable[[], None] = lambda: None,
) -> Iterator[Model]:
    """Give the model of a feed that has begun; `receivers` get every message too, and those of `BESIDE`."""

    model = Model(feed, beside=beside, receivers=receivers, on_failure=on_failure)
    feed.start(model.take, model.fail)
    model.start()
    try:
        yield model
    finally:
        feed.stop()
        model.stop()


def serve_view(
    feed: Feed,
    say: Callable[[str], None],
    *,
    host: str = '127.0.0.1',
    port: int,
    foxglove_port: int = 0,
    beside: bool = True,
) -> None:
    """Serve page and, at a port, Foxglove until Ctrl-C; `say` takes where to look.

    Raises `FeedError`, also amid it.
    """
    from engine_mount.view.web import FoxgloveServer, Web

    ending = threading.Event()
    with ExitStack() as stack:
        stack.enter_context(ending_signals(ending.set))
        receivers = []
        if foxglove_port:
            others = {f'{namespace_of(feed)}/{BESIDE.name}': BESIDE} if beside else {}
            server = FoxgloveServer({**feed.topics, **others}, foxglove_port)
            stack.callback(server.stop)
            receivers.append(server.take)
            say(f'Foxglove   {server.address} (Foxglove or Lichtblick: open connection, Foxglove WebSocket)')
        look = running_model(feed, beside=beside, receivers=receivers, on_failure=ending.set)
        model = stack.enter_context(look)
        page = Web(model, feed.title, host, port)
        stack.callback(page.stop)
        page.start()
        say(f'page       {page.address}')
        say('Ctrl-C ends the view; what is looked at goes on')
        ending.wait()
        if model.failure:
            raise FeedError(model.failure)


def wait_for_state(model: Model, limit: float) -> None:
    """Return when the state of a node is known, or `limit` s have passed."""
    end = time.monotonic() + limit
    while not model.state.nodes and time.monotonic() < end:
        time.sleep(0.05)


_STYLES = {'ok': 'green', 'warning': 'yellow', 'error': 'red', 'idle': 'bright_black'}
_EVENTS = 6  # chosen: the last ones


def status_screen(model: Model, title: str) -> 'RenderableType':
    """Return nodes, figures and events, for 80 columns."""
    from rich.console import Group  # the page needs none of it
    from rich.table import Table
    from rich.text import Text

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
