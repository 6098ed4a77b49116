"""`engine-mount dev bench`: what matters for speed, beside its alternative."""

from importlib import import_module
from typing import Annotated

from engine_mount.cli.bench import GROUPS, BenchOrder, Comparison
from engine_mount.cli.commands.options import (
    Domain,
    JsonFile,
    Priority,
    names_in,
    new_screen,
    option,
    write_figures,
)
from engine_mount.cli.help import named

EPILOG = """Groups: `calls` (cost of one sample in core and in a replay), `graph` (latency of the graph in
real time, beside a chain of empty nodes).

Exit code: 0 when everything was measured, 1 when the graph refused or ended, with the reason.

Examples:

`engine-mount dev bench --only graph --json bench.json` - the graph beside the bare middleware

`engine-mount dev bench --only graph --sample-rate 2000` - the same at 2 kHz
"""


def bench(
    only: Annotated[str, option('these groups only', 'NAME,...', named('group'))] = '',
    rounds: Annotated[int, option('of each run of the graph; their median is the figure', least=1)] = 5,
    seconds: Annotated[float, option('length of a run in real time', least=1.0)] = 5.0,
    sample_rate: Annotated[float, option('samples per second of the graph and the chain', 'HZ')] = 1000.0,
    priority: Priority = 0,
    domain: Domain = None,
    json_file: JsonFile = None,
) -> None:
    """Measure speed, each figure beside its alternative in the same run."""
    from engine_mount.recordings.screen import Table
    from mount_bringup.graph.domain import chosen_domain

    chosen = names_in(only, GROUPS, 'group of bench')
    order = BenchOrder(rounds, seconds, sample_rate, chosen_domain(domain), priority)
    screen = new_screen()
    found: dict[str, Comparison] = {}
    with screen.console.status('measuring') as status:
        for name in chosen:
            status.update(f'measuring: {name}')
            measure = getattr(import_module(f'engine_mount.cli.bench.{name}'), name)
            found |= measure(order, status.update)
    rows = [
        (
            *(row.what, _text(row.ours, row.unit), row.beside, _text(row.other, row.unit)),
            '-' if row.ratio is None else f'{row.ratio:.3g}',
        )
        for row in found.values()
    ]
    heads = ('what', 'ours', 'beside', 'other', 'ratio')
    screen.table(Table('medians, in turn; ratio: ours over the other', 'lrlrr', rows, heads))
    write_figures({name: {**row._asdict(), 'ratio': row.ratio} for name, row in found.items()}, json_file)


def _text(value: float, unit: str) -> str:
    if unit == 's':
        return f'{1e6 * value:.2f} µs' if value < 0.1 else f'{value:.2f} s'
    return f'{value:.4g}' if unit == '1' else f'{value:.4g} {unit}'
