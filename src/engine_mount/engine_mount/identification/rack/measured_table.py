"""A file of any format that is read here, as a table: columns by title, number or place, on one time base."""

from collections.abc import Collection, Sequence
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from engine_mount.recordings.place import recording_place
from engine_mount.signals.formats.content import Stated
from engine_mount.signals.formats.measured import FloatArray, Measured, MeasuredColumn, TimeBase, found
from engine_mount.signals.formats.reading import headings, read
from engine_mount.signals.loading import is_recording
from engine_mount.signals.signal import SignalError
from engine_mount.signals.units.columns import may_hold_times
from engine_mount.signals.units.mapping import TimeChoice
from engine_mount.signals.units.time import times_of

Inside = NDArray[np.bool_]


def in_topics(path: Path) -> bool:
    """Return whether `path` is a recording in topics, one of its files, or the folder of a run with one."""
    return is_recording(recording_place(path))


class MeasuredTable:
    """The columns of a file: `header` holds their titles as written, `units` what these tell or ''.

    Only columns that are asked for are read. Those that a format samples at times of their own are brought
    to those of the first that is asked for, by straight lines, as long as all of them last.
    """

    def __init__(self, path: Path, stated: Stated | None = None):
        """Find the columns of `path`; raises `SignalError`, or `SourceError`."""
        self.path = path
        self._file, self._stated = recording_place(path), stated
        self._headings = headings(self._file, stated)
        self.header = tuple(one.header for one in self._headings)
        self.names = tuple(one.name for one in self._headings)
        self.units = tuple(one.unit for one in self._headings)

    @property
    def told(self) -> str:
        """What is found on reading, for refusals; '' where there is nothing to say."""
        notes = read(self._file, None, self._stated).notes
        return f' ({"; ".join(notes)})' if notes else ''

    def place(self, column: str) -> int:
        """Return the place of a column by its title, name or number; raises `SignalError`."""
        if self.header.count(column) == 1:
            return self.header.index(column)
        return self.names.index(found(column, self._headings, str(self.path)).name)

    def columns(self, *places: int) -> FloatArray:
        """Return the chosen columns, shape (columns, rows), as the file holds them."""
        columns = self._read(places).columns
        chosen = [columns[self.names[place]] for place in places]
        return _together(chosen, chosen[0].time, self.path)[1]

    def over_time(self, places: Sequence[int], choice: TimeChoice) -> tuple[FloatArray, FloatArray]:
        """Return the times (s) of the first of the chosen columns, and all of them, shape (columns, rows).

        `choice` is what is said of the times; raises as `times_of` too.
        """
        measured = self._read(places, may_hold_times(self._headings, choice, str(self.path)))
        chosen = [measured.columns[self.names[place]] for place in places]
        base, _ = times_of(measured, chosen[0], choice, {})
        return _together(chosen, base, self.path)

    def _read(self, places: Sequence[int], others: Collection[str] = ()) -> Measured:
        wanted = {*(self.names[place] for place in places), *others}
        return read(self._file, [name for name in self.names if name in wanted], self._stated)


def _together(
    columns: Sequence[MeasuredColumn], base: TimeBase | None, path: Path
) -> tuple[FloatArray, FloatArray]:
    """Return times of the first column (s; its rows where nothing tells them) and all columns at these."""
    first = columns[0]
    times = np.arange(first.values.size, dtype=np.float64) if base is None else base.times
    inside = np.full(first.values.size, True)
    rows = [_at_times_of(first, column, path, inside) for column in columns]
    return times[inside], np.array([row[inside] for row in rows])


def _at_times_of(first: MeasuredColumn, column: MeasuredColumn, path: Path, inside: Inside) -> FloatArray:
    """Return a column at the times of the first, and mark in `inside` when it does not last."""
    if column.time is first.time or column.time is None or first.time is None:
        if column.values.size != first.values.size:
            raise SignalError(
                f'{path}: {column.name} has {column.values.size} samples, {first.name} has '
                f'{first.values.size}, and no times tell which belong together; give columns of one length'
            )
        return column.values
    at = first.time.times + 1e-9 * (first.time.begin - column.time.begin)
    known = np.isfinite(column.values)
    own = column.time.times[known]
    if own.size:
        inside &= (at >= own[0] - _SAME_TIME) & (at <= own[-1] + _SAME_TIME)
    if not (own.size and inside.any()):
        raise SignalError(
            f'{path}: {column.name} and {first.name} have no time in common; give columns that were sampled '
            'together'
        )
    return np.interp(at, own, column.values[known])


_SAME_TIME = 0.5e-3  # s, chosen: half a sample at 1 kHz, for frames of one sample are not sent at once
