"""What stands in the columns of a fleet's tables, declared once: files and pages are made of it.

What is unknown is null in a file, never NaN: DuckDB counts NaN as the largest number.
"""

import contextlib
import math
import os
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from datetime import datetime
from pathlib import Path
from typing import TYPE_CHECKING, Any

from engine_mount.signals.extras import required

if TYPE_CHECKING:
    import pyarrow

TABLES = 'a table of a fleet'
"""What a missing library is needed for."""

TEXT, NUMBER, COUNT, FLAG, TIME = 'string', 'double', 'int64', 'bool', 'timestamp[us]'
"""Types of columns, as pyarrow names them; times are UTC."""


class WritingError(OSError):
    """A folder of a fleet cannot be written; the text says why, and what would help."""


@dataclass(frozen=True)
class Column:
    """One column: its name, its type, its unit ('' where it has none), and a sentence about it."""

    name: str
    type: str
    unit: str
    meaning: str


def schema_of(columns: Sequence[Column]) -> 'pyarrow.Schema':
    """Return the schema of a table; unit and meaning are metadata of its fields."""
    pyarrow = required('pyarrow', TABLES)
    return pyarrow.schema(
        pyarrow.field(
            column.name,
            pyarrow.type_for_alias(column.type),
            metadata={'unit': column.unit, 'meaning': column.meaning},
        )
        for column in columns
    )


def table_of(columns: Sequence[Column], rows: Iterable[Mapping[str, Any]]) -> 'pyarrow.Table':
    """Return rows, {column: value}, as a table; what a row lacks, and NaN, is null.

    Raises `ValueError` for a name that is no column.
    """
    pyarrow = required('pyarrow', TABLES)
    known = {column.name: column.type for column in columns}
    plain = []
    for row in rows:
        if unknown := sorted(row.keys() - known.keys()):
            raise ValueError(f'{", ".join(unknown)}: no such column; there are {", ".join(sorted(known))}')
        plain.append({name: _plain(value, known[name]) for name, value in row.items()})
    return pyarrow.Table.from_pylist(plain, schema=schema_of(columns))


def write_table(table: 'pyarrow.Table', file: Path) -> None:
    """Write a table as Parquet, whole or not at all; the same table gives the same bytes.

    Raises `WritingError`.
    """
    parquet = required('pyarrow.parquet', TABLES)
    with replacing(file) as beside:
        parquet.write_table(table, beside, compression='zstd')


@contextlib.contextmanager
def replacing(file: Path) -> Iterator[Path]:
    """Give the place of a new file that takes the place of `file` when the block ends, whole or not at all.

    Raises `WritingError`.
    """
    beside = file.with_name(f'.{file.name}.{os.getpid()}')
    with writing(file):
        try:
            yield beside
            beside.replace(file)
        finally:
            beside.unlink(missing_ok=True)


@contextlib.contextmanager
def writing(file: Path) -> Iterator[None]:
    """Tell in a sentence why a file of a fleet's folder cannot be written, as on a full disk."""
    try:
        yield
    except OSError as error:
        why = os.strerror(error.errno) if error.errno else str(error)
        raise WritingError(
            f'{file} cannot be written: {why}; what was written stands, and once that is mended the same '
            'command goes on where it stopped'
        ) from error


def _plain(value: Any, kind: str) -> Any:
    if kind == TIME and isinstance(value, str):  # of a journal
        return datetime.fromisoformat(value)
    return None if isinstance(value, float) and math.isnan(value) else value
