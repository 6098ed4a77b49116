"""The three mounts over one gap, and what their recordings tell: delays of switching, rms, peaks."""

from dataclasses import dataclass
from typing import Any

import numpy as np

from mount_control.policy import switched_viscous
from mount_experiments.harness.closed_loop import FloatArray, Ride
from mount_report.drive.evaluation import switching

FRICTION, HYDRO, OFF = 'friction', 'hydromount', 'friction, 0 A'
WINDOW = (0.2, 1.2)  # s after the switch-on level was exceeded: damping has come on, the gap still rings


@dataclass(frozen=True)
class Crossing:
    """The three mounts over one gap; `exceeded` (s) is when the friction mount first left the on level."""

    rides: dict[str, Ride]
    exceeded: float | None


def figures_of(crossing: Crossing, control: switched_viscous.Parameters) -> dict[str, Any]:
    """Return delays and durations of damping (s), rms and peaks (m); None if the level was not exceeded."""
    found: dict[str, Any] = {'exceeded_s': crossing.exceeded}
    if crossing.exceeded is None:
        return found | dict.fromkeys(
            (
                'on_delay_s',
                'on_duration_s',
                'off_delay_s',
                'off_delay_in_band_s',
                'rms_m',
                'peak_m',
                'highest_current_a',
            )
        )
    friction = crossing.rides[FRICTION]
    changes = switching(friction.seen)
    on = next((time for time in changes.on if time >= crossing.exceeded), None)
    off = None if on is None else next((time for time in changes.off if time > on), None)
    begin, end = (crossing.exceeded + edge for edge in WINDOW)
    rms, peak = {}, {}
    for name, ridden in crossing.rides.items():
        window = (ridden.time >= begin) & (ridden.time < end)
        rms[name] = float(np.sqrt(np.mean(ridden.displacement[window] ** 2)))
        peak[name] = float(np.max(np.abs(ridden.displacement[ridden.time >= crossing.exceeded])))
    return found | {
        'on_delay_s': None if on is None else on - crossing.exceeded,
        'on_duration_s': None if on is None or off is None else off - on,
        'off_delay_s': None if off is None else off - _last_above(friction, control, off),
        'off_delay_in_band_s': None if off is None else off - _last_above_in_band(friction, control, off),
        'rms_m': rms,
        'peak_m': peak,
        'highest_current_a': float(friction.coil_current.max()),
    }


def _last_above(ridden: Ride, control: switched_viscous.Parameters, off: float) -> float:
    """Return when the displacement was last at or above the switch-off level before damping went off."""
    return _last(ridden.seen.time, ridden.seen.displacement, control.switch_off_level, off)


def _last_above_in_band(ridden: Ride, control: switched_viscous.Parameters, off: float) -> float:
    """Return the same of the band-passed displacement, which the control compares with the level."""
    return _last(ridden.band_time, ridden.band_displacement, control.switch_off_level, off)


def _last(time: FloatArray, values: FloatArray, level: float, before: float) -> float:
    return float(time[np.flatnonzero((time < before) & (np.abs(values) >= level))[-1]])
