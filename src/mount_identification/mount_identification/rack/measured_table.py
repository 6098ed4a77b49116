"""A file of any format that is read here, as a table: columns by title, number or place, on one time base."""

from pathlib import Path

import numpy as np

from mount_bags.run.place import recording_place
from mount_bags.signals.loading import is_recording
from mount_bags.signals.signal import SignalError
from mount_signals.formats.measured import FloatArray, Measured, MeasuredColumn, found
from mount_signals.formats.reading import read

_TIME_NAMES = ('t', 'time', 'timestamp', 'time_s', 't_s', 'seconds')


def in_topics(path: Path) -> bool:
    """Return whether `path` is a recording in topics, one of its files, or the folder of a run with one."""
    return is_recording(recording_place(path))


class MeasuredTable:
    """The columns of a file: `header` holds their titles as written, `units` what these tell or ''.

    Columns that a format samples at times of their own are brought to those of the first that is asked for,
    by straight lines.
    """

    def __init__(self, path: Path):
        """Read `path`; raises `SignalError`, or `SourceError`."""
        self.path = path
        self._measured: Measured = read(path)
        self._columns: list[MeasuredColumn] = list(self._measured.columns.values())
        self.header = tuple(one.header for one in self._columns)
        self.names = tuple(one.name for one in self._columns)
        self.units = tuple(one.unit for one in self._columns)

    @property
    def told(self) -> str:
        """What was found on reading, for refusals; '' where there was nothing to say."""
        return f' ({"; ".join(self._measured.notes)})' if self._measured.notes else ''

    def place(self, column: str, what: str = 'column') -> int:
        """Return the place of a column by its title, name or number; raises `SignalError`."""
        if column in self.header:
            return self.header.index(column)
        try:
            return self._columns.index(self._measured.column(found(column, self._columns, '').name))
        except SignalError:
            raise SignalError(
                f'{what} {column!r} is not in {self.path}; its columns are {", ".join(self.header)}'
            ) from None

    def time_place(self, column: str = '') -> int:
        """Return the place of the times: `column`, else one by its usual names, else the first."""
        if column:
            return self.place(column, 'time column')
        usual = (place for place, name in enumerate(self.header) if name.lower() in _TIME_NAMES)
        return next(usual, 0)

    def columns(self, *places: int) -> FloatArray:
        """Return the chosen columns, shape (columns, rows), as the file holds them."""
        chosen = [self._columns[place] for place in places]
        first = chosen[0]
        return np.array([_at_times_of(first, each, self.path) for each in chosen])

    def times(self, place: int) -> FloatArray | None:
        """Return when the samples of a column were taken (s) where the format tells it."""
        base = self._columns[place].time
        return None if base is None else base.times + 1e-9 * (base.begin - self._begin())

    def _begin(self) -> int:
        return min((one.time.begin for one in self._columns if one.time is not None), default=0)


def _at_times_of(first: MeasuredColumn, column: MeasuredColumn, path: Path) -> FloatArray:
    same = column.time is first.time or column.time is None or first.time is None
    if same:
        if column.values.size != first.values.size:
            raise SignalError(
                f'{path}: {column.name} has {column.values.size} samples, {first.name} has '
                f'{first.values.size}, and no times tell which belong together; give columns of one length'
            )
        return column.values
    assert column.time is not None
    assert first.time is not None
    shift = 1e-9 * (first.time.begin - column.time.begin)
    known = np.isfinite(column.values)
    return np.interp(
        first.time.times + shift, column.time.times[known], column.values[known], left=np.nan, right=np.nan
    )
