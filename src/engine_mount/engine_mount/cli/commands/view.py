"""`engine-mount view` and `status`: what the graph does now, or a recording by the clock."""

from typing import Annotated

import typer

from engine_mount.cli.commands.options import (
    Domain,
    From,
    JsonFile,
    Namespace,
    flag,
    new_screen,
    option,
    recording_argument,
    seconds,
    write_figures,
)
from engine_mount.cli.fetching import local

EPILOG = """Exit code: 0 after Ctrl-C; 1 when there is nothing to show or a port is taken, with the reason.

Examples:

`engine-mount view` - beside a running drive: a page at localhost, and a server for Foxglove and Lichtblick

`engine-mount view bags/first --playback-speed 0.2` - a recording, five times slower

`engine-mount view --host 0.0.0.0` - from a phone in the same network, with the printed token

Beside the driven mount, the page shows the motion of the hydromount and of the mount without damping on the
same acceleration of the chassis. The page needs no internet.
"""

STATUS_EPILOG = """Exit code: 0; 1 with `--once` when no node of the graph reports within 3 s.

Examples:

`engine-mount status` - beside a running drive, until Ctrl-C

`engine-mount status --once --json status.json` - once, for scripts
"""

_ONCE_LIMIT = 3.0  # s, chosen
_REFRESHES = 4  # a second, chosen


def view(
    recording: Annotated[
        str | None,
        recording_argument(
            instead='folder of a run or of a recording, or its URI; without: the running graph'
        ),
    ] = None,
    playback_speed: Annotated[
        float, option('recording: speed against the clock', least=0.01, most=1000.0)
    ] = 1.0,
    begin: From = '',
    host: Annotated[str, option('address of the page; beyond this machine: with a token')] = '127.0.0.1',
    port: Annotated[int, option('of the page')] = 8137,
    foxglove_port: Annotated[int, option('of the Foxglove server on this machine, 0: none')] = 8765,
    beside: Annotated[bool, typer.Option('--beside/--no-beside', help='simulate other mounts beside')] = True,
    domain: Domain = None,
    namespace: Namespace = '',
) -> None:
    """Show the running graph, or a recording, as a page in the browser and in Foxglove."""
    from engine_mount.view.view import open_feed, serve_view
    from mount_bringup.graph.domain import chosen_domain

    screen = new_screen()
    place = None if recording is None else local(recording, screen)
    number, start = chosen_domain(domain), seconds(begin)
    with open_feed(place, rate=playback_speed, begin=start, domain=number, namespace=namespace) as feed:
        serve_view(feed, screen.say, host=host, port=port, foxglove_port=foxglove_port, beside=beside)


def status(
    once: Annotated[bool, flag('--once', 'print the state once and end')] = False,
    json_file: JsonFile = None,
    domain: Domain = None,
    namespace: Namespace = '',
) -> None:
    """Show the state of the running graph on one screen of the terminal."""
    import threading

    from rich.live import Live

    from engine_mount.view.feed import FeedError
    from engine_mount.view.view import open_feed, running_model, status_screen, wait_for_state
    from mount_bringup.graph.domain import chosen_domain
    from mount_bringup.graph.shutdown import ending_signals

    console = new_screen().console
    ending = threading.Event()
    with (
        ending_signals(ending.set),
        open_feed(domain=chosen_domain(domain), namespace=namespace) as feed,
        running_model(feed, beside=False) as model,
    ):
        if once or json_file is not None:
            wait_for_state(model, _ONCE_LIMIT)
            console.print(status_screen(model, feed.title))
            write_figures(model.state_json(), json_file)
            if not model.state.nodes:
                raise typer.Exit(1)
            return
        with Live(status_screen(model, feed.title), console=console, refresh_per_second=_REFRESHES) as live:
            while not model.failure and not ending.wait(1.0 / _REFRESHES):
                live.update(status_screen(model, feed.title))
        if model.failure:
            raise FeedError(model.failure)
