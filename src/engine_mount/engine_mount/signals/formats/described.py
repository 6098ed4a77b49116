"""What a file of measured signals holds, column by column, for people who choose one."""

from dataclasses import asdict, dataclass
from typing import Any

import numpy as np

from engine_mount.recordings.screen import Table
from engine_mount.signals.formats.measured import FloatArray, Measured, MeasuredColumn


@dataclass(frozen=True)
class ColumnFacts:
    """A column in numbers: samples, how many are missing (NaN), range in its unit, and its times.

    `rate` is the mean one in Hz, `span` from the first to the last sample in s; NaN where the format tells no
    times, as where a column holds them.
    """

    name: str
    unit: str
    samples: int
    missing: int
    least: float
    mean: float
    greatest: float
    rate: float
    span: float

    def as_json(self) -> dict[str, Any]:
        """Return all of it, null for what is not known."""
        return {name: None if value != value else value for name, value in asdict(self).items()}


def described(measured: Measured) -> list[ColumnFacts]:
    """Return the facts of every column that was read."""
    return [_facts(column) for column in measured.columns.values()]


def columns_table(facts: list[ColumnFacts]) -> Table:
    """Return the facts as a table for people."""
    rows = [
        (
            one.name,
            one.unit,
            str(one.samples),
            '' if np.isnan(one.rate) else f'{one.rate:.6g} Hz',
            '' if np.isnan(one.span) else f'{one.span:.6g} s',
            f'{one.least:.4g} .. {one.greatest:.4g}',
            f'{one.mean:.4g}',
        )
        for one in facts
    ]
    heads = ('column', 'unit', 'samples', 'rate', 'span', 'range', 'mean')
    return Table('Columns', 'llrrrrr', rows, heads)


def _facts(column: MeasuredColumn) -> ColumnFacts:
    values = column.values
    known = values[~np.isnan(values)]
    least, mean, greatest = (known.min(), known.mean(), known.max()) if known.size else (np.nan,) * 3
    span, rate = _times(column.time.times) if column.time is not None else (np.nan, np.nan)
    return ColumnFacts(
        column.name, column.unit, values.size, values.size - known.size, float(least), float(mean),
        float(greatest), rate, span,
    )  # fmt: skip


def _times(times: FloatArray) -> tuple[float, float]:
    """Return span (s) and mean rate (Hz)."""
    if times.size < 2:
        return np.nan, np.nan
    span = float(times[-1] - times[0])
    return span, (times.size - 1) / span if span > 0.0 else np.nan
