"""What control did to the friction in a recording, from its control trace, collected part by part."""

import math
from typing import Any

import numpy as np

from engine_mount.recordings.bag.column_parts import ColumnPart
from engine_mount.recordings.events.switching_trace import SwitchingTrace
from engine_mount.recordings.messages.packed_column import BLOCK


class Trace:
    """Switching, and the work of |mu N v| by which the pads wear, mu N being Eq (9)'s friction."""

    COLUMNS = (SwitchingTrace.COLUMN, 'velocity', 'friction_coefficient', 'normal_force')

    def __init__(self) -> None:
        self._switching = SwitchingTrace()
        self._sums: list[float] = []  # of power, each of so many samples, W
        self._rest = np.empty(0)
        self._told: set[str] = set()

    def add(self, part: ColumnPart) -> None:
        """Take a part of the topic."""
        self._told |= part.columns.keys()
        self._switching.add(part)
        velocity, coefficient, force = (part.column(name) for name in self.COLUMNS[1:])
        power = np.concatenate([self._rest, np.nan_to_num(np.abs(coefficient * force * velocity))])
        # Summed in steps of the samples, so that the parts of the files do not change the sum.
        whole = len(power) - len(power) % BLOCK
        self._sums += [float(power[begin : begin + BLOCK].sum()) for begin in range(0, whole, BLOCK)]
        self._rest = power[whole:]

    def figures(self, sample_time: float) -> dict[str, Any]:
        """Return the figures, {} where the trace does not tell them; `sample_time` in s."""
        if not self._told.issuperset(self.COLUMNS):
            return {}
        on, _ = self._switching.switched()
        return {
            'switched_on': len(on),
            'damping_s': sample_time * self._switching.active,
            'pad_energy_j': sample_time * math.fsum([*self._sums, float(self._rest.sum())]),
        }
