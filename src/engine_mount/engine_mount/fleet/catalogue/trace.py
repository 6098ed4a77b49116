"""What control did to the friction in a recording, from its control trace, collected part by part."""

import math
from typing import Any

import numpy as np

from engine_mount.recordings.columns import ColumnPart
from engine_mount.recordings.switching import switching_places

_ACTIVE = 'damping_active'
_BLOCK = 1 << 13  # samples whose power is summed together, chosen


class Trace:
    """Switching, and the work of |mu N v| by which the pads wear, mu N being Eq (9)'s friction."""

    COLUMNS = (_ACTIVE, 'velocity', 'friction_coefficient', 'normal_force')

    def __init__(self) -> None:
        self._stamps = [np.empty(0, np.int64)]
        self._active = [np.empty(0)]
        self._sums: list[float] = []  # of power, each of so many samples, W
        self._rest = np.empty(0)
        self._told: set[str] = set()

    def add(self, part: ColumnPart) -> None:
        """Take a part of the topic."""
        self._told |= part.columns.keys()
        self._stamps.append(part.stamps)
        self._active.append(part.column(_ACTIVE))
        velocity, coefficient, force = (part.column(name) for name in self.COLUMNS[1:])
        power = np.concatenate([self._rest, np.nan_to_num(np.abs(coefficient * force * velocity))])
        # Summed in steps of the samples, so that the parts of the files do not change the sum.
        whole = len(power) - len(power) % _BLOCK
        self._sums += [float(power[begin : begin + _BLOCK].sum()) for begin in range(0, whole, _BLOCK)]
        self._rest = power[whole:]

    def figures(self, sample_time: float) -> dict[str, Any]:
        """Return the figures, {} where the trace does not tell them; `sample_time` in s."""
        if not self._told.issuperset(self.COLUMNS):
            return {}
        stamps, active = np.concatenate(self._stamps), np.concatenate(self._active)
        order = np.argsort(stamps, kind='stable')
        on, _ = switching_places((stamps[order] - stamps[order[:1]]) / 1e9, active[order])
        return {
            'switched_on': len(on),
            'damping_s': sample_time * np.count_nonzero(active > 0.0),
            'pad_energy_j': sample_time * math.fsum([*self._sums, float(self._rest.sum())]),
        }
