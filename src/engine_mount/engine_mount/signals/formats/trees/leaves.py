"""Arrays of a nested file by their paths, as columns: `imu.acc.z`, `accelerometer.2`."""

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from engine_mount.signals.formats.broken import reading
from engine_mount.signals.formats.measured import FloatArray, Heading, MeasuredColumn, TimeBase, unique

_SECOND = 1_000_000_000  # ns
_WIDEST = 256  # columns, chosen: a wider array is an image or a matrix, not signals over time
_NUMBERS = 'fiub'


@dataclass(frozen=True, eq=False)
class Leaf:
    """One column of an array: `array` is anything with shape and dtype that numpy can slice.

    `place` chooses a column of a two-dimensional array, whose samples run along `axis`. `field` chooses one
    of a structured array. `time` is the leaf of its times in s, and `told` the words on these.
    """

    name: str
    array: Any
    unit: str = ''
    place: int | None = None
    axis: int = 0
    field: str = ''
    time: 'Leaf | None' = None
    told: str = ''
    begin: int = 0
    header: str = ''

    @property
    def is_date(self) -> bool:
        """Whether the array holds dates."""
        return self._kind == 'M'

    @property
    def count(self) -> int:
        """How many samples there are."""
        return int(self.array.shape[self.axis]) if self.array.shape else 1

    @property
    def _kind(self) -> str:
        dtype = self.array.dtype
        return str((dtype[self.field] if self.field else dtype).kind)

    def raw(self) -> np.ndarray:
        """Return the samples as they are stored, shape (n,)."""
        if self.place is None:
            part = self.array[...]
        else:
            part = self.array[:, self.place] if self.axis == 0 else self.array[self.place, :]
        return np.asarray(part[self.field] if self.field else part).reshape(-1)

    def values(self) -> FloatArray:
        """Return the samples, shape (n,); dates in s since 1970."""
        raw = self.raw()
        if self._kind == 'M':
            return np.where(np.isnat(raw), np.nan, self.nanoseconds() / _SECOND)
        if self._kind == 'm':
            return raw.astype('timedelta64[ns]').astype(np.int64) / _SECOND
        return raw.astype(np.float64)

    def nanoseconds(self) -> np.ndarray:
        """Return dates in ns since 1970."""
        return self.raw().astype('datetime64[ns]').astype(np.int64)


class Leaves:
    """Chosen columns of nested arrays; a `Content`."""

    def __init__(self, path: Path, kind: str, reader: str, leaves: Iterable[Leaf], notes: Iterable[str] = ()):
        self._path = path
        self.format = kind
        self.reader = reader
        self.notes = list(notes)
        self._leaves = list(leaves)
        self.headings: Sequence[Heading] = unique([
            Heading(
                leaf.name, leaf.header or leaf.name, 's' if leaf.is_date else leaf.unit, 0,
                timed=leaf.time is not None, date=leaf.is_date,
            )
            for leaf in self._leaves
        ])  # fmt: skip

    def load(self, chosen: Sequence[Heading]) -> list[MeasuredColumn]:
        """Return the chosen columns; those with the same times share one time base."""
        times: dict[int, TimeBase] = {}
        found = []
        with reading(self._path, self.format):
            for heading in chosen:
                leaf = self._leaves[heading.number]
                if leaf.time is not None and id(leaf.time) not in times:
                    times[id(leaf.time)] = _time_base(leaf.time, leaf.told, leaf.begin)
                time = None if leaf.time is None else times[id(leaf.time)]
                found.append(heading.measured(leaf.values(), time))
        return found


def leaves_of(name: str, array: Any, notes: list[str], unit: str = '') -> list[Leaf]:
    """Return the columns of one array; what is no signal is told in `notes`, single numbers aside."""
    shape, dtype = tuple(array.shape), array.dtype
    if dtype.names:
        whole = [Leaf(f'{name}.{field}'.lstrip('.'), array, field=field) for field in dtype.names]
        return [leaf for leaf in whole if _is_column(leaf.name, dtype[leaf.field], shape, notes)]
    size = math.prod(shape)
    if size <= 1:
        return []
    if not _is_column(name, dtype, shape, notes):
        return []
    if len(shape) == 2 and 1 not in shape:
        return _columns(name, array, notes, unit)
    axis = int(np.argmax(shape))
    return [Leaf(name or 'value', array, unit, axis=axis)]


def with_dates(leaves: list[Leaf]) -> list[Leaf]:
    """Return leaves of one table on the times of their first column of dates, where there is one."""
    dated = next((leaf for leaf in leaves if leaf.is_date), None)
    if dated is None:
        return leaves
    stamps = dated.nanoseconds()
    begin = int(stamps[0]) if stamps.size else 0
    times = Leaf(dated.name, (stamps - begin) / _SECOND)
    told = f'dates in {dated.name!r}, taken as UTC where they name no zone'
    return [replace(leaf, time=times, told=told, begin=begin) for leaf in leaves]


def _time_base(leaf: Leaf, told: str, begin: int) -> TimeBase:
    return TimeBase(leaf.values(), begin, told)


def _is_column(name: str, dtype: np.dtype, shape: tuple[int, ...], notes: list[str]) -> bool:
    what = name or 'the array'
    if dtype.kind not in _NUMBERS + 'mM':
        kind = {'c': 'complex numbers', 'O': 'objects', 'U': 'text', 'S': 'text'}.get(dtype.kind, str(dtype))
        notes.append(f'{what}: {kind}, left out')
        return False
    if sum(side > 1 for side in shape) > 2:
        notes.append(f'{what}: an array of {" x ".join(map(str, shape))}, left out')
        return False
    return True


def _columns(name: str, array: Any, notes: list[str], unit: str) -> list[Leaf]:
    """Return the columns of a table; the samples run along its longer side."""
    rows, columns = array.shape
    axis = 0 if rows >= columns else 1
    width = min(rows, columns)
    if width > _WIDEST:
        notes.append(f'{name or "the array"}: {rows} x {columns} numbers are no signals, left out')
        return []
    if axis == 1:
        notes.append(f'{name or "the array"}: {rows} x {columns}, samples taken along the rows')
    return [
        Leaf(f'{name}.{place}'.lstrip('.'), array, unit, place=place, axis=axis) for place in range(width)
    ]
