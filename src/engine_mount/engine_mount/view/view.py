"""One look at a graph or a recording: feed, model, and what shows them, from the beginning to the end."""

import threading
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass
from pathlib import Path

from engine_mount.view.feed.feed import Feed, FeedError, Message, Receive
from engine_mount.view.window.model import Model
from mount_bringup.graph.shutdown import ending_signals

PAGE_PORT, FOXGLOVE_PORT = 8137, 8765


@dataclass(frozen=True)
class ViewOrder:
    """What is to be looked at, and where it is shown; without a recording, the running graph."""

    recording: Path | None = None
    rate: float = 1.0
    begin: float = 0.0
    domain: int = 0
    namespace: str = ''
    host: str = '127.0.0.1'
    port: int = PAGE_PORT
    foxglove_port: int = FOXGLOVE_PORT  # 0: none
    beside: bool = True


def open_feed(order: ViewOrder) -> Feed:
    """Return the feed that is ordered; raises `FeedError` or `ReadingError`."""
    if order.recording is not None:
        from engine_mount.view.feed.recorded import Recorded

        return Recorded(order.recording, order.rate, order.begin, order.namespace)
    from engine_mount.view.feed.running_graph import RunningGraph

    return RunningGraph(order.domain, order.namespace)


@contextmanager
def model_of(order: ViewOrder) -> Iterator[tuple[Feed, Model]]:
    """Give feed and model at work."""
    feed = open_feed(order)
    with ExitStack() as stack:
        stack.callback(feed.stop)
        yield feed, stack.enter_context(_at_work(feed, order, (), lambda: None))


@contextmanager
def _at_work(
    feed: Feed, order: ViewOrder, others: Sequence[Receive], on_failure: Callable[[], None]
) -> Iterator[Model]:
    """Give the model of a feed that has begun; `others` get every message too."""
    model = Model(feed, beside=order.beside, on_failure=on_failure)
    receivers = (model.take, *others)

    def receive(message: Message) -> None:
        for take in receivers:
            take(message)

    feed.start(receive, model.fail)
    model.start()
    try:
        yield model
    finally:
        feed.stop()
        model.stop()


def serve_view(order: ViewOrder, say: Callable[[str], None]) -> None:
    """Serve page and Foxglove until Ctrl-C; `say` takes where to look. Raises `FeedError`, also amid it."""
    from engine_mount.view.foxglove_server import FoxgloveServer
    from engine_mount.view.page.web import Web

    ending = threading.Event()
    with ExitStack() as stack:
        stack.enter_context(ending_signals(ending.set))
        feed = open_feed(order)
        stack.callback(feed.stop)
        others = []
        if order.foxglove_port:
            server = FoxgloveServer(feed.topics, order.host, order.foxglove_port)
            stack.callback(server.stop)
            others.append(server.take)
            say(f'Foxglove   {server.address} (Foxglove or Lichtblick: open connection, Foxglove WebSocket)')
        model = stack.enter_context(_at_work(feed, order, others, ending.set))
        page = Web(model, feed.title, feed.mark, order.host, order.port)
        stack.callback(page.stop)
        page.start()
        say(f'page       {page.address}')
        say('Ctrl-C ends the view; what is looked at goes on')
        ending.wait()
        if model.failure:
            raise FeedError(model.failure)


def wait_for_state(model: Model, limit: float) -> None:
    """Return when a node has told its state, or `limit` s have passed."""
    end = time.monotonic() + limit
    while not model.state.nodes and time.monotonic() < end:
        time.sleep(0.05)
