"""Where damping was switched in a recording of any length, its control trace read part by part."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from mount_bags.bag.column_parts import ColumnPart
from mount_bags.events.switching_changes import Places, Signal, switching_places
from mount_bags.messages.compact_times import CompactTimes, Times


class SwitchingTrace:
    """The switching in a long recording, whose control trace is read part by part."""

    COLUMN = 'damping_active'

    def __init__(self) -> None:
        self._stamps = CompactTimes()
        self._active: list[NDArray[np.bool_]] = [np.empty(0, bool)]

    def add(self, part: ColumnPart) -> None:
        """Take a part of the trace with the column `COLUMN`."""
        self._stamps.add(part.stamps)
        self._active.append(part.column(self.COLUMN) > 0.0)

    @property
    def active(self) -> int:
        """At how many samples damping was active."""
        return sum(int(np.count_nonzero(each)) for each in self._active)

    def switched(self, order: CompactTimes | None = None) -> tuple[Places, Places]:
        """Return at which samples, counted as they came, damping went on and off.

        They follow one another by their stamps, or by what is told for each of them in `order`.
        """
        active, stamps = np.concatenate(self._active), self._stamps.finished()
        if not len(active):
            return np.empty(0, np.intp), np.empty(0, np.intp)
        by = stamps if order is None else order
        if by.rising:
            return switching_places(_Seconds(stamps), active)
        places = np.argsort(by.whole(), kind='stable')
        on, off = switching_places(_Seconds(stamps, places), active[places])
        return places[on], places[off]


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
