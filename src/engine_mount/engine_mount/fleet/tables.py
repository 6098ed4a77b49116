"""The tables of a fleet: declared in columns.yaml, written whole or not at all."""

import contextlib
import os
from collections.abc import Iterable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import yaml

from engine_mount.signals.extras import required

if TYPE_CHECKING:
    import pyarrow

NEEDED_FOR = 'a table of a fleet'
"""What a missing library is needed for."""

Row = dict[str, Any]


class WritingError(OSError):
    """A folder of a fleet cannot be written; the text says why, and what would help."""


class Column(NamedTuple):
    """One column: its name, its type as pyarrow names it, its unit ('': none), and a sentence about it."""

    name: str
    type: str
    unit: str
    meaning: str


def _declared_columns() -> dict[str, tuple[Column, ...]]:
    text = Path(__file__).with_name('columns.yaml').read_text(encoding='utf-8')
    return {
        table: tuple(Column(name, *declared) for name, declared in columns.items())
        for table, columns in yaml.safe_load(text).items()
    }


COLUMNS = _declared_columns()
"""{table: its columns} of `recordings`, `events` and `result`."""


def schema_of(columns: Sequence[Column]) -> 'pyarrow.Schema':
    """Return the schema of a table; unit and meaning are metadata of its fields."""
    pyarrow = required('pyarrow', NEEDED_FOR)
    return pyarrow.schema(
        pyarrow.field(name, pyarrow.type_for_alias(kind), metadata={'unit': unit, 'meaning': meaning})
        for name, kind, unit, meaning in columns
    )


def table_of(columns: Sequence[Column], rows: Iterable[Mapping[str, Any]]) -> 'pyarrow.Table':
    """Return rows, {column: value}, as a table; a value that a row lacks, and NaN, is null.

    Times are ISO texts in rows. Raises `ValueError` for a name that is no column.
    """
    pyarrow = required('pyarrow', NEEDED_FOR)
    rows, schema = list(rows), schema_of(columns)
    if unknown := {name for row in rows for name in row} - set(schema.names):
        raise ValueError(
            f'{", ".join(sorted(unknown))}: no such column; there are {", ".join(sorted(schema.names))}'
        )
    arrays = [
        pyarrow.array([row.get(field.name) for row in rows], from_pandas=True).cast(field.type)  # NaN: null
        for field in schema
    ]
    return pyarrow.table(arrays, schema=schema)


def write_table(table: 'pyarrow.Table', file: Path) -> None:
    """Write a table as Parquet, whole or not at all; the same table gives the same bytes.

    Raises `WritingError`.
    """
    parquet = required('pyarrow.parquet', NEEDED_FOR)
    with replaced(file) as beside:
        parquet.write_table(table, beside, compression='zstd')


@contextlib.contextmanager
def replaced(file: Path) -> Iterator[Path]:
    """Give the place of a new file that takes the place of `file` when the block ends, whole or not at all.

    Raises `WritingError`.
    """
    beside = file.with_name(f'.{file.name}.{os.getpid()}')
    with explained_errors(file):
        try:
            yield beside
            beside.replace(file)
        finally:
            beside.unlink(missing_ok=True)


@contextlib.contextmanager
def explained_errors(file: Path) -> Iterator[None]:
    """Raise a `WritingError` where `file` cannot be written in the block, as on a full disk."""
    try:
        yield
    except OSError as error:
        why = os.strerror(error.errno) if error.errno else str(error)
        raise WritingError(
            f'{file} cannot be written: {why}; what was written stands, and once that is mended the same '
            'command goes on where it stopped'
        ) from error
