"""`engine-mount bench`: what matters for speed, beside its alternative."""

from typing import Annotated

import typer

from engine_mount.cli.commands.options import Domain, JsonFile
from engine_mount.cli.completion import named
from engine_mount.cli.terminal import terminal

EPILOG = """Groups: `calls` (what one call costs), `storage` (recordings), `fleet` (a recorded
second in `fleet replay`), `graph` (latency, processor time, start and memory of the graph in real time,
beside a chain of empty nodes), `rate` (the same at 2 kHz).

Exit code: 0 when everything was measured, 1 when the graph refused or ended, with the reason.

Examples:

`engine-mount bench --only graph --json bench.json` - the graph beside the bare middleware

`engine-mount bench --only graph --rounds 1 --seconds 1800` - its memory over half an hour
"""


def bench(
    only: Annotated[
        list[str] | None,
        typer.Option(
            metavar='GROUP', help='measure this group alone; may be repeated', autocompletion=named('group')
        ),
    ] = None,
    rounds: Annotated[int, typer.Option(min=1, help='of each run of the graph; the median is told')] = 5,
    seconds: Annotated[float, typer.Option(min=1.0, help='length of a run in real time')] = 5.0,
    priority: Annotated[
        int, typer.Option(min=0, max=90, help='real-time priority of the graph where permitted; 0: none')
    ] = 0,
    domain: Domain = None,
    json_file: JsonFile = None,
) -> None:
    """Measure what matters for speed, each figure beside its alternative in the same run."""
    from engine_mount.cli.bench.bench import BenchOrder, print_bench
    from mount_bringup.graph.domain import chosen_domain

    order = BenchOrder(only or (), rounds, seconds, chosen_domain(domain), priority, json_file)
    print_bench(order, terminal())
