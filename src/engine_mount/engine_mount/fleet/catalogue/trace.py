"""What control did to the friction in a recording, from its control trace."""

import math
from typing import Any

import numpy as np

from engine_mount.recordings.events import switching_places
from engine_mount.recordings.series import Series, SeriesError

TRACE_COLUMNS = ('damping_active', 'velocity', 'friction_coefficient', 'normal_force')
_BLOCK = 1 << 13  # samples whose power is summed together, chosen


def trace_figures(trace: Series, sample_time: float) -> dict[str, Any]:
    """Return switching, and the work of |mu N v| by which the pads wear, mu N being Eq (9)'s friction.

    {} where the trace does not tell them; `sample_time` in s.
    """
    try:
        active, velocity, coefficient, force = (trace[name] for name in TRACE_COLUMNS)
    except SeriesError:
        return {}
    stamps = trace.stamps
    order = slice(None) if np.all(stamps[1:] >= stamps[:-1]) else np.argsort(stamps, kind='stable')
    on, _ = switching_places((stamps[order] - stamps[order][:1]) / 1e9, active[order])
    blocks = [slice(begin, begin + _BLOCK) for begin in range(0, len(active), _BLOCK)]
    power = [np.nan_to_num(np.abs(coefficient[at] * force[at] * velocity[at])).sum() for at in blocks]
    return {
        'switched_on': len(on),
        'damping_s': sample_time * np.count_nonzero(active > 0.0),
        'pad_energy_j': sample_time * math.fsum(power),
    }
