"""Performance figures as ratios: ours and its alternative in turn, in one run, medians of several."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from rich.console import Console
from rich.table import Table

from engine_mount.cli.bench.comparison import Comparison
from engine_mount.reports.json_file import write_json

Figures = Mapping[str, Comparison]


@dataclass(frozen=True)
class BenchOrder:
    """Which groups are measured (empty: all), and how; `seconds` is the length of a run in real time."""

    only: Sequence[str] = ()
    rounds: int = 5
    seconds: float = 5.0
    domain: int = 0
    priority: int = 0
    json_file: Path | None = None


def print_bench(order: BenchOrder, console: Console) -> None:
    """Measure and print the comparisons, and write them to a file; an unknown group raises a `ValueError`."""
    for name in order.only:
        if name not in GROUPS:
            raise ValueError(f'{name!r} is no group of bench; known are {", ".join(GROUPS)}')
    table = Table(title='medians, in turn; ratio: ours over the other')
    for title in ('what', 'ours', 'beside', 'other', 'ratio'):
        table.add_column(title, justify='left' if title in ('what', 'beside') else 'right')
    found: dict[str, Comparison] = {}
    with console.status('measuring') as status:
        for name, measure in GROUPS.items():
            if not order.only or name in order.only:
                status.update(f'measuring: {name}')
                found.update(measure(order, status.update))
    for row in found.values():
        values = _text(row.ours, row.unit), row.other_name, _text(row.other, row.unit), f'{row.ratio:.3g}'
        table.add_row(row.what, *values)
    console.print(table)
    if order.json_file is not None:
        write_json({name: row.figures for name, row in found.items()}, order.json_file)


def _calls(order: BenchOrder, say: Callable[[str], None]) -> Figures:
    from engine_mount.cli.bench import in_process

    return {
        'pack': in_process.packing(),
        'unpack': in_process.unpacking(),
        'decode': in_process.coding(),
        'control': in_process.control(),
        'core': in_process.closed_loop(),
        'replay': in_process.replay(),
    }


def _storage(order: BenchOrder, say: Callable[[str], None]) -> Figures:
    from engine_mount.cli.bench.storage import storage_figures

    return dict(zip(('write', 'load'), storage_figures(), strict=False))  # one without `rosbags`


def _fleet(order: BenchOrder, say: Callable[[str], None]) -> Figures:
    from engine_mount.cli.bench.fleet import fleet_figures

    return fleet_figures(say)


def _graph(order: BenchOrder, say: Callable[[str], None]) -> Figures:
    from engine_mount.cli.bench.chain_runs import Place
    from engine_mount.cli.bench.in_real_time import graph_figures

    return graph_figures(Place(order.domain, order.priority), order.seconds, order.rounds, say)


def _fast(order: BenchOrder, say: Callable[[str], None]) -> Figures:
    from engine_mount.cli.bench.chain_runs import Place
    from engine_mount.cli.bench.in_real_time import fast_figures

    return fast_figures(Place(order.domain, order.priority), order.seconds, order.rounds, say)


def _lockstep(order: BenchOrder, say: Callable[[str], None]) -> Figures:
    from engine_mount.cli.bench.chain_runs import Place
    from engine_mount.cli.bench.in_real_time import lockstep_figures

    return lockstep_figures(Place(order.domain), order.seconds, order.rounds, say)


GROUPS: dict[str, Callable[[BenchOrder, Callable[[str], None]], Figures]] = {
    'calls': _calls,
    'storage': _storage,
    'fleet': _fleet,
    'lockstep': _lockstep,
    'graph': _graph,
    'rate': _fast,
}
"""What can be measured alone."""


def _text(value: float, unit: str) -> str:
    if unit == 's':
        return f'{1e6 * value:.2f} µs' if value < 0.1 else f'{value:.2f} s'
    return f'{value:.4g}' if unit == '1' else f'{value:.4g} {unit}'
