"""Signals of a recording as one table for other programs: CSV, Parquet or MATLAB."""

import re
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from engine_mount.signals.formats.reading import read
from engine_mount.signals.signal import SECOND, FloatArray, SignalError, required

Table = dict[str, tuple[FloatArray, str]]
"""Values and unit by name."""
_GRID = 'displacement.mount'
_KINDS = ('.csv', '.parquet', '.mat')


def export(recording: Path, out: Path, signals: Sequence[str] = ()) -> str:
    """Write `signals` of a recording (all by default), in their units, as the file `out`; return a summary.

    A row is a sample of the displacement, or without it of the signal that has most; other signals hold their
    last value, and have none before their first. Times are in s from the first row. Raises `SignalError`
    before anything is written.
    """
    if out.suffix not in _KINDS:
        raise SignalError(f'{out}: nothing is written as {out.suffix!r}; known are {", ".join(_KINDS)}')
    fewest = 1 if signals else 2  # a latched value has no course
    found = {}
    for name, column in read(recording, list(signals) or None).columns.items():
        known = np.count_nonzero(~np.isnan(column.values))
        if column.time is not None and known >= fewest and '[' not in name:
            # in ns, by which samples of different topics are compared exactly
            stamps = np.rint(column.time.times * SECOND).astype(np.int64) + column.time.begin
            order = np.argsort(stamps, kind='stable')
            found[name.lstrip('/')] = stamps[order], column.values[order], column.unit
    if not found:
        raise SignalError(f'{recording} holds no such signal with samples and their times')
    grid = _GRID if _GRID in found else max(found, key=lambda name: found[name][0].size)
    rows = np.unique(found[grid][0])
    table = {'time': ((rows - rows[0]) / SECOND, 's')}
    for name, (stamps, values, unit) in found.items():
        last = np.searchsorted(stamps, rows, side='right')
        table[name] = np.append(np.nan, values)[last], unit
    (_write_matlab if out.suffix == '.mat' else _write_arrow)(out, table)
    return f'{len(found)} signals, {rows.size} rows at the samples of {grid}; others hold their last value'


def _write_arrow(out: Path, table: Table) -> None:
    """Write CSV with units in the titles, or Parquet with units as metadata; an unknown value is empty."""
    arrow, csv = required('pyarrow', 'an export'), out.suffix == '.csv'
    fields, arrays = [], []
    for name, (values, unit) in table.items():
        title = f'{name} [{unit}]' if csv and unit not in ('', '1') else name
        fields.append(arrow.field(title, 'float64', metadata={'unit': unit}))
        arrays.append(arrow.array(values, from_pandas=True))
    rows = arrow.table(arrays, schema=arrow.schema(fields))
    if csv:
        required('pyarrow.csv', 'an export').write_csv(rows, out)
    else:
        required('pyarrow.parquet', 'an export').write_table(rows, out)


def _write_matlab(out: Path, table: Table) -> None:
    """Write `time`, and a struct for each signal: values in `data`, beside them their `unit`."""
    from scipy.io import savemat

    tree: dict[str, Any] = {'time': table.pop('time')[0]}
    for name, (values, unit) in table.items():
        tree[re.sub(r'\W', '_', name)] = {'data': values, 'unit': unit or ' '}
    savemat(out, tree, long_field_names=True)
