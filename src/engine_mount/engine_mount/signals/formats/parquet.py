"""Parquet files: columns with the unit that their metadata tell, dates as times."""

from collections.abc import Iterable, Iterator
from functools import partial
from pathlib import Path
from typing import Any

from engine_mount.signals.extras import required
from engine_mount.signals.formats.cells import name_and_unit
from engine_mount.signals.formats.content import Content, Leaf, Stated, readable, with_dates

_UNITS = (b'unit', b'units', b'Unit', b'Units')
_NUMBERS = ('int', 'uint', 'float', 'double', 'halffloat', 'bool', 'timestamp', 'decimal')


def open_parquet(path: Path, stated: Stated) -> Content:
    """Return the columns of a Parquet file, one within a struct as `struct.field`."""
    parquet = required('pyarrow.parquet', 'reading Parquet files')
    with readable(path, 'Parquet file'):
        file = parquet.ParquetFile(path)
        leaves = [_leaf(file, name, field) for name, field in _fields(file.schema_arrow)]
    return Content(path, 'Parquet', 'pyarrow', with_dates(path, leaves))


def _fields(schema: Iterable[Any], above: str = '') -> Iterator[tuple[str, Any]]:
    """Yield path and field of all columns, those within structs included."""
    for field in schema:
        path = f'{above}.{field.name}'.lstrip('.')
        if str(field.type).startswith('struct'):
            yield from _fields(map(field.type.field, range(field.type.num_fields)), path)
        else:
            yield path, field


def _leaf(file: Any, path: str, field: Any) -> Leaf:
    metadata = field.metadata or {}
    told = next((metadata[key].decode(errors='replace') for key in _UNITS if key in metadata), '')
    name, unit = (path, told) if told else name_and_unit(path)
    kind = str(field.type)
    date = kind.startswith('timestamp')
    read = partial(_read, file, path, 'timestamp[ns]' if date else 'float64')
    return Leaf(name, read if kind.startswith(_NUMBERS) else None, unit, path, date)


def _read(file: Any, path: str, kind: str) -> Any:
    table = file.read(columns=[path])
    while any(str(field.type).startswith('struct') for field in table.schema):
        table = table.flatten()
    return table.column(0).cast(kind, safe=False).to_numpy()
