"""Signals of a recording as one table for other programs: CSV, Parquet or MATLAB."""

import re
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from engine_mount.signals.extras import required
from engine_mount.signals.formats.measured import MeasuredColumn
from engine_mount.signals.formats.reading import read
from engine_mount.signals.signal import SECOND, FloatArray, SignalError

Table = dict[str, tuple[FloatArray, str]]
"""Values and unit by name."""
_GRID = 'displacement.mount'


def export(recording: Path, out: Path, signals: Sequence[str] = ()) -> str:
    """Write `signals` of a recording (all by default), in their units, as the file `out`; return a summary.

    A row is a sample of the displacement, or without it of the signal that has most; other signals hold their
    last value. Times are in s from the first row. Raises `SignalError` before anything is written.
    """
    if out.suffix not in _WRITERS:
        raise SignalError(f'{out}: nothing is written as {out.suffix!r}; known are {", ".join(_WRITERS)}')
    columns = read(recording, list(signals) or None).columns.values()
    fewest = 1 if signals else 2  # a latched value is none over time
    found = {each.name.lstrip('/'): each for each in columns if _known(each) >= fewest}
    stamps = {name: _stamps(each) for name, each in found.items()}
    if not found:
        raise SignalError(f'{recording} holds no such signal with samples')
    grid = _GRID if _GRID in found else max(found, key=lambda name: stamps[name].size)
    rows = np.unique(stamps[grid])
    table = {'time': ((rows - rows[0]) / SECOND, 's')}
    table |= {name: (_held(each.values, stamps[name], rows), each.unit) for name, each in found.items()}
    _WRITERS[out.suffix](out, table)
    return f'{len(found)} signals, {rows.size} rows at the samples of {grid}; others hold their last value'


def _known(column: MeasuredColumn) -> int:
    """Return how many samples are known; none counts of a number within a list."""
    return 0 if '[' in column.name else int(np.count_nonzero(~np.isnan(column.values)))


def _stamps(column: MeasuredColumn) -> np.ndarray:
    """Return the times of the samples in ns, by which different topics are compared exactly."""
    if column.time is None:
        raise SignalError(f'{column.name} has no times of its own; export takes recordings of ROS 2')
    return np.rint(column.time.times * SECOND).astype(np.int64) + column.time.begin


def _held(values: FloatArray, stamps: np.ndarray, rows: np.ndarray) -> FloatArray:
    """Return at each of `rows` (ns) the value of the last sample until then, NaN before the first."""
    order = np.argsort(stamps, kind='stable')
    return np.append(np.nan, values[order])[np.searchsorted(stamps[order], rows, side='right')]


def _write_csv(out: Path, table: Table) -> None:
    titles = (f'{name} [{unit}]' if unit not in ('', '1') else name for name, (_, unit) in table.items())
    rows = _rows(dict(zip(titles, table.values(), strict=True)))
    required('pyarrow.csv', 'writing CSV').write_csv(rows, out)


def _write_parquet(out: Path, table: Table) -> None:
    required('pyarrow.parquet', 'writing Parquet').write_table(_rows(table), out)


def _rows(table: Table) -> Any:
    """Return the table of pyarrow; the unit is metadata of its column, an unknown value an empty cell."""
    arrow = required('pyarrow', 'an export')
    fields = [arrow.field(name, 'float64', metadata={'unit': unit}) for name, (_, unit) in table.items()]
    arrays = [arrow.array(values, from_pandas=True) for values, _ in table.values()]
    return arrow.table(arrays, schema=arrow.schema(fields))


def _write_matlab(out: Path, table: Table) -> None:
    """Write `time`, and a struct for each signal: values in `data`, beside them their `unit`."""
    from scipy.io import savemat

    structs = {
        re.sub(r'\W', '_', name): {'data': values, **({'unit': unit} if unit else {})}
        for name, (values, unit) in table.items()
    }
    savemat(out, {**structs, 'time': table['time'][0]}, long_field_names=True)


_WRITERS: dict[str, Callable[[Path, Table], None]] = {
    '.csv': _write_csv, '.parquet': _write_parquet, '.mat': _write_matlab,
}  # fmt: skip
