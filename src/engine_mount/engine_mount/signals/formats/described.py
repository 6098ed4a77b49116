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
    titles = ('column', 'unit', 'samples', 'rate', 'span', 'range', 'mean')
    return Table('Columns', 'llrrrrr', [_row(one) for one in facts], titles)


def _facts(column: MeasuredColumn) -> Facts:
    known = column.values[~np.isnan(column.values)]
    sizes = (known.min, known.mean, known.max)
    least, mean, greatest = (float(size()) if known.size else None for size in sizes)
    times = np.zeros(0) if column.time is None else column.time.times
    span = float(times[-1] - times[0]) if len(times) > 1 else None
    missing = column.values.size - known.size
    return {
        'name': column.name, 'unit': column.unit, 'samples': column.values.size, 'missing': missing,
        'least': least, 'mean': mean, 'greatest': greatest,
        'rate': (len(times) - 1) / span if span else None, 'span': span,
    }  # fmt: skip


def _row(one: Facts) -> tuple[str, ...]:
    rate, span = ('' if one[key] is None else f'{one[key]:.6g}' for key in ('rate', 'span'))
    sizes = ('none', '')
    if one['mean'] is not None:
        sizes = (f'{one["least"]:.4g} .. {one["greatest"]:.4g}', f'{one["mean"]:.4g}')
    return (
        one['name'],
        one['unit'],
        str(one['samples']),
        rate and f'{rate} Hz',
        span and f'{span} s',
        *sizes,
    )
