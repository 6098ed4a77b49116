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
        self._stamps, self._arrivals = CompactTimes(), CompactTimes()
        self._active: list[NDArray[np.bool_]] = [np.empty(0, bool)]

    def add(self, part: ColumnPart) -> None:
        """Take a part of the trace with the column `COLUMN`."""
        self._stamps.add(part.stamps)
        self._arrivals.add(part.receive_times)
        self._active.append(part.column(self.COLUMN) > 0.0)

    @property
    def active(self) -> int:
        """At how many samples damping was active."""
        return sum(int(np.count_nonzero(each)) for each in self._active)

    def by_stamps(self) -> list['Switched']:
        """Return where damping went on and where off, in the order of the stamps."""
        stamps = self._stamps.finished()
        order = None if stamps.rising else np.argsort(stamps.whole(), kind='stable')
        return self._switched(order)

    def by_arrival(self) -> list['Switched']:
        """Return where damping went on and where off, in the order in which the samples came in."""
        arrivals = self._arrivals.finished()
        order = None if arrivals.rising else np.argsort(arrivals.whole(), kind='stable')
        return self._switched(order)

    def _switched(self, order: Places | None) -> list['Switched']:
        active = np.concatenate(self._active)
        stamps, arrivals = self._stamps.finished(), self._arrivals.finished()
        if order is not None:
            active = active[order]
        if not len(active):
            return [Switched(stamps.whole(), arrivals.whole())] * 2
        found = switching_places(_Seconds(stamps, order), active)
        in_file = (places if order is None else order[places] for places in found)
        return [Switched(stamps.at(places), arrivals.at(places)) for places in in_file]


@dataclass(frozen=True)
class Switched:
    """Where damping was switched: stamps, and when these samples came in, ns."""

    stamps: Times
    receive_times: Times


class _Seconds:
    """Times (s) of samples from the first on."""

    def __init__(self, stamps: CompactTimes, order: Places | None):
        self._stamps, self._order = stamps, order
        self._first = self._at(np.zeros(1, np.intp))

    def __getitem__(self, places: Places) -> Signal:
        return np.asarray((self._at(places) - self._first) / 1e9, np.float64)

    def _at(self, places: Places) -> Times:
        return self._stamps.at(places if self._order is None else self._order[places])
