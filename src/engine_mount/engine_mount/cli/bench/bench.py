"""Performance figures as ratios: ours and its alternative in turn, in one run, medians of several."""

import math
import statistics
import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from importlib import import_module
from pathlib import Path

from rich.console import Console
from rich.table import Table

from engine_mount.reports.json_file import write_json

GROUPS = ('calls', 'storage', 'fleet', 'graph', 'rate')
"""What can be measured alone: function `measure` of the module of this name, or of `chains`."""
_MODULES = {'graph': 'chains', 'rate': 'chains'}
_FAST = 2000.0  # Hz, of the group `rate`

Report = Callable[[str], None]


@dataclass(frozen=True)
class Comparison:
    """A figure of ours and one of its alternative, in s where `unit` says nothing else."""

    what: str
    ours: float
    beside: str
    other: float
    unit: str = 's'

    @property
    def ratio(self) -> float:
        """Ours over the other."""
        return self.ours / self.other if self.other else math.nan


@dataclass(frozen=True)
class BenchOrder:
    """Which groups are measured (empty: all), and how; `seconds` is the length of a run in real time."""

    only: Sequence[str] = ()
    rounds: int = 5
    seconds: float = 5.0
    domain: int = 0
    priority: int = 0
    json_file: Path | None = None
    sample_rate: float | None = None
    """Hz, of the graph; None: the default."""


Figures = Mapping[str, Comparison]


def median_times(
    ours: Callable[[], object], other: Callable[[], object], rounds: int, repeats: int = 1
) -> tuple[float, float]:
    """Return the median seconds of one call of each, measured A B A B ..., `repeats` calls at a time."""
    times: tuple[list[float], list[float]] = ([], [])
    for _ in range(rounds):
        for place, call in enumerate((ours, other)):
            begin = time.perf_counter()
            for _ in range(repeats):
                call()
            times[place].append((time.perf_counter() - begin) / repeats)
    return statistics.median(times[0]), statistics.median(times[1])


def print_bench(order: BenchOrder, console: Console) -> None:
    """Measure and print the comparisons, and write them to a file; an unknown group raises a `ValueError`."""
    for name in order.only:
        if name not in GROUPS:
            raise ValueError(f'{name!r} is no group of bench; known are {", ".join(GROUPS)}')
    found: dict[str, Comparison] = {}
    with console.status('measuring') as status:
        for name in order.only or GROUPS:
            status.update(f'measuring: {name}')
            found |= measure_group(name, order, status.update)
    table = Table(title='medians, in turn; ratio: ours over the other')
    for title in ('what', 'ours', 'beside', 'other', 'ratio'):
        table.add_column(title, justify='left' if title in ('what', 'beside') else 'right')
    for row in found.values():
        ours, other = _text(row.ours, row.unit), _text(row.other, row.unit)
        table.add_row(row.what, ours, row.beside, other, f'{row.ratio:.3g}')
    console.print(table)
    if order.json_file is not None:
        known = {
            name: asdict(row) | {'ratio': row.ratio if row.other else None} for name, row in found.items()
        }
        write_json(known, order.json_file)


def measure_group(name: str, order: BenchOrder, report: Report) -> Figures:
    """Return the comparisons of one group by name."""
    module = import_module(f'engine_mount.cli.bench.{_MODULES.get(name, name)}')
    if name == 'rate':
        found: Figures = module.measure(replace(order, sample_rate=_FAST), report)
        return {f'{key}_2_khz': row for key, row in found.items()}
    return module.measure(order, report)


def _text(value: float, unit: str) -> str:
    if unit == 's':
        return f'{1e6 * value:.2f} µs' if value < 0.1 else f'{value:.2f} s'
    return f'{value:.4g}' if unit == '1' else f'{value:.4g} {unit}'
