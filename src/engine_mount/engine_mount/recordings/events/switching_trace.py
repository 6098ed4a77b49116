"""Where damping was switched in a recording of any length, its control trace read part by part."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from engine_mount.recordings.bag.column_parts import ColumnPart
from engine_mount.recordings.events.switching_changes import (
    Places,
    Signal,
    changed_places,
    switching_places,
    without_pauses,
)
from engine_mount.recordings.messages.compact_times import CompactTimes, Times


class SwitchingTrace:
    """The switching in a long recording, whose control trace is read part by part."""

    COLUMN = 'damping_active'

    def __init__(self) -> None:
        self.active = 0
        """At how many samples damping was active."""
        self._stamps = CompactTimes()
        self._changes = [np.empty(0, np.intp)]  # samples at which it went on, off, on, ...
        self._is_active = False  # at the last sample

    def add(self, part: ColumnPart) -> None:
        """Take a part of the trace with the column `COLUMN`."""
        active = part.column(self.COLUMN) > 0.0
        self.active += int(np.count_nonzero(active))
        self._changes.append(len(self._stamps) + changed_places(active, self._is_active))
        self._is_active = bool(active[-1])
        self._stamps.add(part.stamps)

    def switched(self, order: CompactTimes | None = None) -> tuple[Places, Places]:
        """Return at which samples, counted as they came, damping went on and off.

        They follow one another by their stamps, or by what is told for each of them in `order`.
        """
        changes, stamps = np.concatenate(self._changes), self._stamps.finished()
        if not len(changes):
            return changes, changes
        by = stamps if order is None else order
        if by.rising:
            return without_pauses(_Seconds(stamps), changes[::2], changes[1::2])
        places = np.argsort(by.whole(), kind='stable')
        on, off = switching_places(_Seconds(stamps, places), self._all_active(changes)[places])
        return places[on], places[off]

    def _all_active(self, changes: Places) -> NDArray[np.bool_]:
        """Return at which samples damping was active."""
        changed = np.zeros(len(self._stamps), bool)
        changed[changes] = True
        return np.logical_xor.accumulate(changed)


class ArrivedSwitching(SwitchingTrace):
    """The same with the times at which the samples came in."""

    def __init__(self) -> None:
        super().__init__()
        self._arrivals = CompactTimes()

    def add(self, part: ColumnPart) -> None:
        """Take a part of the trace with the column `COLUMN`."""
        super().add(part)
        self._arrivals.add(part.receive_times)

    def by_arrival(self) -> tuple['Switched', 'Switched']:
        """Return where damping went on and where off, in the order in which the samples came in."""
        arrivals = self._arrivals.finished()
        on, off = (Switched(self._stamps.at(each), arrivals.at(each)) for each in self.switched(arrivals))
        return on, off


@dataclass(frozen=True)
class Switched:
    """Where damping was switched: stamps, and when these samples came in, ns."""

    stamps: Times
    receive_times: Times


class _Seconds:
    """Times (s) of samples from the first on."""

    def __init__(self, stamps: CompactTimes, order: Places | None = None):
        self._stamps, self._order = stamps, order
        self._first = self._at(np.zeros(1, np.intp))

    def __getitem__(self, places: Places) -> Signal:
        return np.asarray((self._at(places) - self._first) / 1e9, np.float64)

    def _at(self, places: Places) -> Times:
        return self._stamps.at(places if self._order is None else self._order[places])
