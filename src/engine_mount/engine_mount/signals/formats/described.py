"""What a file of measured signals holds, column by column, for people who choose one."""

from typing import Any

import numpy as np

from engine_mount.recordings.screen import Table
from engine_mount.signals.formats.measured import Measured, MeasuredColumn

Facts = dict[str, Any]
"""A column in numbers: samples, how many are missing (NaN), range in its unit, mean rate (Hz) and span (s).

None where a number is not known, as rate and span where a column holds the times.
"""


def described(measured: Measured) -> list[Facts]:
    """Return the facts of every column that was read."""
    return [_facts(column) for column in measured.columns.values()]


def columns_table(facts: list[Facts]) -> Table:
    """Return the facts as a table for people."""
    rows = [
        (
            one['name'],
            one['unit'],
            str(one['samples']),
            '' if one['rate'] is None else f'{one["rate"]:.6g} Hz',
            '' if one['span'] is None else f'{one["span"]:.6g} s',
            'none' if one['mean'] is None else f'{one["least"]:.4g} .. {one["greatest"]:.4g}',
            '' if one['mean'] is None else f'{one["mean"]:.4g}',
        )
        for one in facts
    ]
    return Table('Columns', 'llrrrrr', rows, ('column', 'unit', 'samples', 'rate', 'span', 'range', 'mean'))


def _facts(column: MeasuredColumn) -> Facts:
    known = column.values[~np.isnan(column.values)]
    least, mean, greatest = (known.min(), known.mean(), known.max()) if known.size else (None,) * 3
    times = np.zeros(0) if column.time is None else column.time.times
    span = float(times[-1] - times[0]) if times.size > 1 else None
    counts = {'samples': column.values.size, 'missing': column.values.size - known.size}
    sizes = {'least': least, 'mean': mean, 'greatest': greatest}
    return {
        'name': column.name,
        'unit': column.unit,
        **counts,
        **{name: None if size is None else float(size) for name, size in sizes.items()},
        'rate': (times.size - 1) / span if span else None,
        'span': span,
    }
