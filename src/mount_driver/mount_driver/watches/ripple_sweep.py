"""The inductance over the current as the driver itself saw it in the ramp of the initialisation.

No bus and no clock here. The driver knows nothing of mount_init: the first sweep of the current beyond 2 A
and back to 0 A after its activation is the reference, whichever node commanded it.
"""

from typing import NamedTuple

import numpy as np

from mount_driver.watches.ripple_law import RippleLaw, crossing_per_gap
from mount_models.sampling import HIGHEST_CURRENT

NODE = 0.05
"""Distance of the reference's nodes, A, chosen: the ramp gives each some 24 readings at its steepest."""
_NODES = round(HIGHEST_CURRENT / NODE) + 1
_PEAK = 2.0  # A: the lowest peak that mount_init may have, and beyond every crossing
_BEGUN, _ENDED = 0.3, 0.5 * NODE  # A, chosen: a sweep has begun above the one and is over below the other
_FEWEST = 3  # readings, chosen: of fewer a node of the curve is not known
_SATURATED = 0.5  # of the crossing inductance, chosen: below it the core is full and the gap hardly shows
_SATURATED_LIMIT = 0.35  # 1, chosen: what the temperature changes there is up to 0.25
_CURRENT_MARGIN = 0.05  # A, chosen: mount_init has refused long before
_INDUCTANCE_MARGIN = 0.02  # 1, chosen


class Reference(NamedTuple):
    """Inductance (H) at the nodes, its slope (H/A), the relative tolerance there; NaN where not known."""

    inductance: list[float]
    slope: list[float]
    tolerance: list[float]
    crossing_current: float


class Sweep:
    """Collects readings until a sweep is complete; an incomplete one is forgotten."""

    def __init__(self) -> None:
        self._begin()

    def _begin(self) -> None:
        self._peak = 0.0
        self._currents, self._inductances = [0.0] * _NODES, [0.0] * _NODES
        self._counts = [0] * _NODES

    def take(self, current: float, inductance: float) -> bool:
        """Take a reading (A, H); return whether a sweep has ended with it."""
        place = int(current / NODE + 0.5)
        if place >= _NODES:
            place = _NODES - 1
        self._currents[place] += current
        self._inductances[place] += inductance
        self._counts[place] += 1
        if current > self._peak:
            self._peak = current
        elif current < _ENDED and self._peak > _BEGUN:
            if self._peak >= _PEAK:
                return True
            self._begin()
        return False

    def reference(self, law: RippleLaw, inductance_limit: float, gap_limit: float) -> Reference | None:
        """Return the reference of the sweep that has ended; None, and a new begin, where it has holes.

        A reading may deviate by `inductance_limit` (1), or by what a gap that differs by `gap_limit` (m)
        makes of it at the crossing, whichever is more.
        """
        counts = np.array(self._counts)
        known = counts >= _FEWEST
        currents = np.array(self._currents)[known] / counts[known]
        inductances = np.array(self._inductances)[known] / counts[known]
        self._begin()
        nodes = NODE * np.arange(_NODES)
        needed = (nodes >= law.rest_current) & (nodes <= _PEAK)
        if not known[needed].all():
            return None
        values = np.interp(nodes, currents, inductances)
        slope = np.gradient(values, NODE)
        values[nodes > currents[-1] + 0.5 * NODE] = np.nan
        above = np.flatnonzero(values[nodes >= law.rest_current] > law.crossing_inductance)
        first = int(np.argmax(nodes >= law.rest_current))
        last = first + int(above[-1]) if above.size else first
        crossing = nodes[last] + (law.crossing_inductance - values[last]) / slope[last]
        steps = gap_limit * crossing_per_gap(law)
        tolerance = np.maximum(inductance_limit, np.abs(slope) * steps / values)
        tolerance[values < _SATURATED * law.crossing_inductance] = _SATURATED_LIMIT
        return Reference(values.tolist(), slope.tolist(), tolerance.tolist(), float(crossing))


def objection(reference: Reference, law: RippleLaw, wider: float) -> str:
    """Return why the reference cannot be that of this actuator, by its specimen; empty if it may be.

    An unknown temperature makes the limits `wider` by this share of the inductance, and so many A of the
    crossing: by 0.1, 100 K shift it by 0.07 A.
    """
    margin, current = _CURRENT_MARGIN + wider, reference.crossing_current
    low, high = law.crossing_low - margin, law.crossing_high + margin
    if not low <= current <= high:
        return (
            f'coil ripple in the ramp falls through {1e3 * law.crossing_inductance:g} mH at {current:.2f} A; '
            f'with a gap of {1e6 * law.gap_low:.0f} .. {1e6 * law.gap_high:.0f} um that lies within '
            f'{low:.2f} .. {high:.2f} A: check pads, gap and ripple measurement'
        )
    margin, inductance = _INDUCTANCE_MARGIN + wider, reference.inductance[round(law.rest_current / NODE)]
    least, highest = (1.0 - margin) * law.rest_inductance_low, (1.0 + margin) * law.rest_inductance_high
    if not least <= inductance <= highest:
        return (
            f'coil ripple in the ramp gives {1e3 * inductance:.1f} mH at {law.rest_current:g} A; with a gap '
            f'of {1e6 * law.gap_low:.0f} .. {1e6 * law.gap_high:.0f} um that lies within {1e3 * least:.1f} '
            f'.. {1e3 * highest:.1f} mH: check gap, springs and ripple measurement'
        )
    return ''
