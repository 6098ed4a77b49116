"""Which switchings of damping appeared, vanished or moved from one recording to another."""

from bisect import bisect_left, bisect_right
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from mount_recorder.automatic_marks import PAUSE

Signal = NDArray[np.float64]

Places = NDArray[np.intp]

_REACH = 0.5  # s, chosen: switchings further apart are not the same one moved


@dataclass(frozen=True)
class Switching:
    """When damping went on and off, s."""

    on: tuple[float, ...]
    off: tuple[float, ...]


@dataclass(frozen=True)
class SwitchingChange:
    """One switching: `on` or off, its times (s) in A and B, None where there is none, and of which mount."""

    on: bool
    time_a: float | None
    time_b: float | None
    mount: str = ''  # or such as `mount_left/`

    @property
    def moved(self) -> float:
        """By how much it is later in B, s; 0 where it is in one recording alone."""
        if self.time_a is None or self.time_b is None:
            return 0.0
        return self.time_b - self.time_a

    @property
    def alone(self) -> bool:
        """Whether it appeared or vanished."""
        return self.time_a is None or self.time_b is None

    @property
    def time(self) -> float:
        """Its time in A, or in B where A has none, s."""
        return self.time_a if self.time_a is not None else float(self.time_b or 0.0)


def switching_times(time: Signal, active: Signal) -> tuple[Signal, Signal]:
    """Return when damping went on and off; active at the first sample counts as switched on there."""
    on, off = switching_places(time, active)
    return time[on], time[off]


def switching_places(time: Signal, active: Signal) -> tuple[Places, Places]:
    """Return at which samples damping went on and off: where it is active, an opening of any width.

    So it counts as on where the coil carries current. A pause shorter than `PAUSE` is none.
    """
    is_active = active > 0.0
    changes = np.flatnonzero(is_active != np.append(False, is_active)[: len(is_active)])
    on, off = changes[::2], changes[1::2]
    pauses = time[on[1:]] - time[off[: len(on) - 1]] >= PAUSE if len(on) else np.zeros(0, bool)
    return on[np.append(True, pauses)[: len(on)]], off[np.append(pauses, True)[: len(off)]]


def paired_switchings(
    a: tuple[Signal, Signal], b: tuple[Signal, Signal], least: float, mount: str = ''
) -> list[SwitchingChange]:
    """Return all switchings of both recordings (on, off) in the order of time.

    Nearest ones of a kind are taken for the same one; `least` (s) is the period of the samples, below half
    of which nothing moves.
    """
    found = [
        change
        for on, one, other in ((True, a[0], b[0]), (False, a[1], b[1]))
        for change in _paired(on, one.tolist(), other.tolist(), least, mount)
    ]
    return sorted(found, key=lambda change: change.time)


def _paired(on: bool, a: list[float], b: list[float], least: float, mount: str) -> list[SwitchingChange]:
    near = sorted(
        (abs(one - b[k]), i, k)
        for i, one in enumerate(a)
        for k in range(bisect_left(b, one - 2.0 * _REACH), bisect_right(b, one + 2.0 * _REACH))
        if abs(one - b[k]) <= _REACH
    )
    partner: dict[int, int] = {}
    taken: set[int] = set()
    for _, i, k in near:
        if i not in partner and k not in taken:
            partner[i] = k
            taken.add(k)
    changes = [
        SwitchingChange(on, time, _same(time, b[partner[i]], least) if i in partner else None, mount)
        for i, time in enumerate(a)
    ]
    return changes + [SwitchingChange(on, None, time, mount) for k, time in enumerate(b) if k not in taken]


def _same(one: float, other: float, least: float) -> float:
    """Return `other`, or `one` where they differ by rounding only."""
    return one if abs(one - other) < 0.5 * least else other
