"""What the opener of a format returns: columns with their headings, read when they are chosen."""

from collections import Counter
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field
from functools import cache, cached_property
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from engine_mount.signals.formats.measured import Heading, MeasuredColumn, TimeBase
from engine_mount.signals.signal import SECOND, FloatArray, SignalError

_DAY = 86_400 * SECOND  # ns
_LONGEST = 200  # letters of a library's own words, chosen


class NoNumbersError(SignalError):
    """A column holds something else than a number for each sample."""


@dataclass(frozen=True)
class Stated:
    """What the caller says of a file that the file does not tell; empty or None: nothing.

    `decimal` is the decimal sign of a text table (`.` or `,`), `delimiter` what separates its cells (one
    sign, or `blank` for any number of blanks). `dbc` names the database by which CAN frames are decoded.
    """

    decimal: str = ''
    delimiter: str = ''
    dbc: Path | None = None

    def __post_init__(self) -> None:
        """Raise `SignalError` for a decimal sign that is none."""
        if self.decimal not in ('', '.', ','):
            raise SignalError(f'decimal sign {self.decimal!r} must be . or ,')


NOT_STATED = Stated()


class Leaf(NamedTuple):
    """A column before it is read.

    `read` returns its samples (n,) as the file holds them, dates as datetime64; None for a column without
    numbers, which is counted and left out. `clock` returns its times, the same object for columns that were
    sampled together.
    """

    name: str
    read: Callable[[], NDArray[Any]] | None
    unit: str = ''
    header: str = ''
    date: bool = False
    clock: Callable[[], TimeBase] | None = None


@dataclass(eq=False)
class Content:
    """An opened file. `notes` are sentences on what was found, and grow while columns are read.

    `prepare` takes the numbers of the chosen columns before these are read one by one.
    """

    path: Path
    format: str
    reader: str
    leaves: Sequence[Leaf]
    notes: list[str] = field(default_factory=list)
    prepare: Callable[[Sequence[int]], None] = lambda numbers: None

    @cached_property
    def headings(self) -> tuple[Heading, ...]:
        """The columns of numbers, `#2`, `#3`, ... behind a name that stood before; or `SignalError`."""
        seen, there, lost = Counter[str](), [], []
        for number, leaf in enumerate(self.leaves):
            seen[leaf.name] += 1
            name = leaf.name if seen[leaf.name] == 1 else f'{leaf.name}#{seen[leaf.name]}'
            header, unit = leaf.header or leaf.name, 's' if leaf.date else leaf.unit
            if leaf.read is None:
                lost.append(header)
            else:
                there.append(Heading(name, header, unit, number, leaf.date))
        if lost:
            self.notes.append(f'{", ".join(lost)}: no numbers, left out')
        if not there:
            why = ''.join(f'; {note}' for note in dict.fromkeys(self.notes))
            raise SignalError(f'{self.path} holds no columns of numbers; needed are samples over time{why}')
        return tuple(there)

    def load(self, chosen: Sequence[Heading], *, named: bool) -> list[MeasuredColumn]:
        """Return the chosen columns in this order; raises `SignalError`.

        A column that turns out to hold no numbers is refused where it was `named`, else left out and noted.
        """
        columns = []
        with readable(self.path, self.format):
            self.prepare([heading.number for heading in chosen])
            for heading in chosen:
                leaf = self.leaves[heading.number]
                try:
                    values = leaf.read() if leaf.read else np.zeros(0)
                except NoNumbersError as error:
                    if named:
                        raise
                    self.notes.append(f'left out: {error}')
                    continue
                time = leaf.clock() if leaf.clock else None
                columns.append(MeasuredColumn(**vars(heading), values=_as_numbers(values), time=time))
        return columns


def with_dates(path: Path, leaves: Sequence[Leaf]) -> list[Leaf]:
    """Return the leaves of one table on the times of their first column of dates, where there is one."""
    read, header = next(((one.read, one.header or one.name) for one in leaves if one.date), (None, ''))
    if read is None:
        return list(leaves)

    @cache
    def clock() -> TimeBase:
        stamps = read().astype('datetime64[ns]')
        missing = np.flatnonzero(np.isnat(stamps))
        if missing.size or not stamps.size:
            what = f'date number {missing[0]} is missing' if missing.size else 'there is no date'
            raise SignalError(f'{path}, column {header!r}: {what}; fill it in or remove the row')
        numbers = stamps.astype(np.int64)
        if numbers.min() >= 0 and numbers.max() < _DAY:  # midnight may lie between
            midnights = np.flatnonzero(np.diff(numbers) < -_DAY // 2) + 1
            days = np.searchsorted(midnights, np.arange(numbers.size), 'right')
            return TimeBase((numbers + _DAY * days) / SECOND, 0, f'times of day in column {header!r}')
        told = f'dates in column {header!r}, taken as UTC where they name no zone'
        return TimeBase((numbers - numbers[0]) / SECOND, int(numbers[0]), told)

    return [leaf._replace(clock=clock) for leaf in leaves]


@contextmanager
def readable(
    path: Path, kind: str, remedy: str = 'is it cut off, or another format? Export it again'
) -> Iterator[None]:
    """Turn every error of a library that reads `path` as a `kind` of file into a `SignalError`.

    Libraries raise whatever a damaged file makes of their own assumptions (KeyError, struct.error,
    MemoryError, ...), so that no list of classes would be complete. Our own refusals pass as they are.
    """
    try:
        yield
    except (SignalError, ImportError, PermissionError):
        raise
    except FileNotFoundError:
        raise SignalError(f'{path} does not exist; give an existing file') from None
    except Exception as error:
        words = ' '.join(f'{type(error).__name__}: {error}'.split())[:_LONGEST]
        raise SignalError(f'{path} is no readable {kind} ({words}); {remedy}') from error


def _as_numbers(raw: NDArray[Any]) -> FloatArray:
    """Return samples as numbers, dates in s since 1970 and spans in s, NaN where there is none."""
    second = np.timedelta64(1, 's')
    if raw.dtype.kind == 'M':
        whole = raw.astype('datetime64[s]')
        return (whole - np.datetime64(0, 's')) / second + (raw - whole) / second
    return np.ascontiguousarray(raw / second if raw.dtype.kind == 'm' else raw, np.float64)
