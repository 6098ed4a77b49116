"""Parquet files: columns with the unit that their metadata tell, dates as times."""

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from engine_mount.signals.extras import required
from engine_mount.signals.formats.broken import reading
from engine_mount.signals.formats.content import Stated
from engine_mount.signals.formats.headers import name_and_unit
from engine_mount.signals.formats.measured import FloatArray, Heading, MeasuredColumn, TimeBase, unique
from engine_mount.signals.signal import SignalError

_SECOND = 1_000_000_000  # ns
_UNITS = (b'unit', b'units', b'Unit', b'Units')


class Parquet:
    """A Parquet file; a column within a struct is `struct.field`. Raises `SignalError`."""

    def __init__(self, path: Path, stated: Stated):
        required('pyarrow', 'reading Parquet files')
        from pyarrow import parquet

        self.format, self.reader, self.notes = 'Parquet', 'pyarrow', []
        self._path = path
        with reading(path, 'Parquet file'):
            self._file = parquet.ParquetFile(path)
            fields = list(_flattened(self._file.schema_arrow))
        left_out = [name for name, field in fields if not _is_number(field.type)]
        if left_out:
            self.notes.append(f'{", ".join(left_out)}: no numbers, left out')
        headings = unique([_heading(name, field) for name, field in fields])
        kept = [one for one, (_, field) in zip(headings, fields, strict=True) if _is_number(field.type)]
        self._dated = next((one for one in kept if one.date), None)
        self.headings = [replace(one, timed=self._dated is not None) for one in kept]
        if not kept:
            raise SignalError(f'{path} holds no columns of numbers; needed are samples over time')

    def load(self, chosen: Sequence[Heading]) -> list[MeasuredColumn]:
        """Return the chosen columns, on the times of the first column of dates where there is one."""
        with reading(self._path, 'Parquet file'):
            time = None if self._dated is None else self._time(self._dated)
            return [one.measured(self._values(one), time) for one in chosen]

    def _time(self, dated: Heading) -> TimeBase:
        stamps = self._column(dated).cast('timestamp[ns]')
        if stamps.null_count or not len(stamps):
            raise SignalError(
                f'{self._path}, column {dated.header!r}: {stamps.null_count} of {len(stamps)} dates are '
                'missing; remove these rows'
            )
        numbers = stamps.cast('int64').to_numpy()
        begin = int(numbers[0])
        return TimeBase((numbers - begin) / _SECOND, begin, f'dates in column {dated.header!r}')

    def _values(self, heading: Heading) -> FloatArray:
        column = self._column(heading)
        if heading.date:
            return np.asarray(column.cast('timestamp[ns]').cast('int64').to_numpy(), float) / _SECOND
        return np.asarray(column.cast('float64', safe=False).to_numpy(), np.float64)

    def _column(self, heading: Heading) -> Any:
        table = self._file.read(columns=[heading.header])
        while any(str(field.type).startswith('struct') for field in table.schema):
            table = table.flatten()
        return table.column(0)


def _flattened(schema: Any, name: str = '') -> Any:
    """Yield path and field of all columns, those within structs included."""
    for field in schema:
        path = f'{name}.{field.name}'.lstrip('.')
        if str(field.type).startswith('struct'):
            yield from _flattened([field.type.field(place) for place in range(field.type.num_fields)], path)
        else:
            yield path, field


def _heading(path: str, field: Any) -> Heading:
    metadata = field.metadata or {}
    told = next((metadata[key].decode(errors='replace') for key in _UNITS if key in metadata), '')
    name, unit = (path, told) if told else name_and_unit(path)
    date = str(field.type).startswith('timestamp')
    return Heading(name, path, 's' if date else unit, 0, date=date)


def _is_number(kind: Any) -> bool:
    text = str(kind)
    return text.startswith(('int', 'uint', 'float', 'double', 'halffloat', 'bool', 'timestamp', 'decimal'))
