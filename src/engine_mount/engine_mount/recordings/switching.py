"""When damping was switched, and which switchings appeared, vanished or moved between two recordings."""

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from engine_mount.recordings.difference import quantity_text, time_text
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
        return 0.0 if self.time_a is None or self.time_b is None else self.time_b - self.time_a

    @property
    def alone(self) -> bool:
        """Whether it appeared or vanished."""
        return self.time_a is None or self.time_b is None

    @property
    def time(self) -> float:
        """Its time in A, or in B where A has none, s."""
        return self.time_a if self.time_a is not None else float(self.time_b or 0.0)

    def sentence(self, a: str = 'A', b: str = 'B') -> str:
        """Return the change in words; `a` and `b` name the recordings."""
        word, mount = 'on' if self.on else 'off', self.mount.replace('/', ': ')
        if self.time_b is None:
            return f'{mount}damping is not switched {word} in {b}, in {a} it is at {time_text(self.time)}'
        if self.time_a is None:
            return f'{mount}damping is switched {word} at {time_text(self.time_b)} in {b}, in {a} it is not'
        direction = 'later' if self.moved > 0.0 else 'earlier'
        by = quantity_text(abs(self.moved), 's')
        return f'{mount}switched {word} {by} {direction} in {b}, at {time_text(self.time_b)}'

    def figures(self) -> dict[str, Any]:
        """Return the figures for JSON."""
        return {
            'mount': self.mount.rstrip('/'),
            'kind': 'on' if self.on else 'off',
            'time_a_s': self.time_a,
            'time_b_s': self.time_b,
            'moved_ms': None if self.alone else round(1e3 * self.moved, 6),
        }


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

    In the order of time each is paired with the next of its kind within 0.5 s. `least` (s) is the period of
    the samples, below half of which nothing moves.
    """
    found = []
    for on, one, other in ((True, a[0].tolist(), b[0].tolist()), (False, a[1].tolist(), b[1].tolist())):
        while one or other:
            apart = other[0] - one[0] if one and other else np.inf if one else -np.inf
            time_a = one.pop(0) if apart >= -_REACH else None
            time_b = other.pop(0) if apart <= _REACH else None
            found.append(SwitchingChange(on, time_a, time_a if abs(apart) < 0.5 * least else time_b, mount))
    return sorted(found, key=lambda change: change.time)
