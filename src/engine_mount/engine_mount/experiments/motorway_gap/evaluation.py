"""The three mounts over one gap, and what their recordings tell: delays of switching, rms, peaks."""

from dataclasses import dataclass
from typing import Any

import numpy as np

from engine_mount.reports.drive.evaluation import switching
from engine_mount.reports.drive.signals import DriveSignals, FloatArray
from mount_control.policy import switched_viscous

FRICTION, HYDRO, OFF = 'friction', 'hydromount', 'friction, 0 A'
WINDOW = (0.2, 1.2)  # s after the switch-on level was exceeded: damping has come on, the gap still rings


@dataclass(frozen=True)
class Crossing:
    """The three mounts over one gap; `exceeded` (s) is when the friction mount first left the on level."""

    drives: dict[str, DriveSignals]
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
    seen, truth = crossing.drives[FRICTION].seen, crossing.drives[FRICTION].truth
    changes = switching(seen)
    on = next((time for time in changes.on if time >= crossing.exceeded), None)
    off = None if on is None else next((time for time in changes.off if time > on), None)
    begin, end = (crossing.exceeded + edge for edge in WINDOW)
    rms, peak = {}, {}
    for name, drive in crossing.drives.items():
        time, displacement = drive.truth.time, drive.truth.displacement
        rms[name] = float(np.sqrt(np.mean(displacement[(time >= begin) & (time < end)] ** 2)))
        peak[name] = float(np.max(np.abs(displacement[time >= crossing.exceeded])))

    def left(values: FloatArray) -> float | None:
        return None if off is None else off - _last_above(seen.time, values, control.switch_off_level, off)

    return found | {
        'on_delay_s': None if on is None else on - crossing.exceeded,
        'on_duration_s': None if on is None or off is None else off - on,
        'off_delay_s': left(seen.displacement),
        'off_delay_in_band_s': left(seen.band_displacement),  # which control compares with the level
        'rms_m': rms,
        'peak_m': peak,
        'highest_current_a': float(truth.coil_current.max()),
    }


def _last_above(time: FloatArray, values: FloatArray, level: float, before: float) -> float:
    """Return when `values` were last at or beyond the `level`, earlier than `before` (s)."""
    return float(time[np.flatnonzero((time < before) & (np.abs(values) >= level))[-1]])
