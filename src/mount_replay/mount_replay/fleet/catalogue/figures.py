"""The figures of one mount of a recording."""

import math
from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from mount_bags.audit.audit import TopicAudit, audit
from mount_bags.audit.losses import losses
from mount_bags.audit.peak_current import peak_current
from mount_bags.bag.recording import Recording
from mount_bags.events.switching_changes import switching_places
from mount_bags.messages.series import Series
from mount_bags.run.session import recorded_sample_rate
from mount_replay.fleet.catalogue.columns import BANDS, band_name
from mount_replay.fleet.catalogue.in_bands import in_bands
from mount_ros.topics import AIR_GAP, COIL_TEMPERATURE, CONTROL_TRACE, CURRENT_SETPOINT, DISPLACEMENT

Figures = dict[str, Any]

OF_FRICTION = ('switched_on', 'damping_s', 'peak_current_a', 'pad_energy_j')
"""What control did to the friction: nothing in a mount without pads or with an open coil driver."""
_TRACED = ('damping_active', 'velocity', 'friction_coefficient', 'normal_force')


def lost_figures(part: Recording) -> tuple[Figures, dict[str, TopicAudit]]:
    """Return what a recording lacks and what went wrong in it, and the audit that tells it."""
    audits = audit(part)
    found = losses(part, audits)
    first = found.faults[0] if found.faults else None
    figures = {
        **found.as_json(),
        'faults': len(found.faults),
        'first_fault': str(first) if first else '',
    }
    for name, entry in audits.items():
        if entry.latency is not None and name.endswith(f'/{CURRENT_SETPOINT.name}'):
            told = entry.latency
            figures |= {
                'latency_median_s': told.median,
                'latency_p99_s': told.p99,
                'latency_worst_s': told.worst,
            }
    return figures, audits


def state_figures(part: Recording, audits: Mapping[str, TopicAudit]) -> Figures:
    """Return gaps, temperature, switching, currents and motion, as far as they were recorded."""
    figures: Figures = {}
    if _has(part, AIR_GAP.name):
        gap = part[AIR_GAP.name]
        for column, name in (
            ('rest_gap_m', 'rest_gap'),
            ('contact_gap_m', 'contact_gap'),
            ('offset_current_a', 'offset_current'),
        ):
            figures[column] = float(gap[name][-1])
    if _has(part, COIL_TEMPERATURE.name):
        figures['coil_temperature_degc'] = _highest(part[COIL_TEMPERATURE.name]['temperature'])
    figures['peak_current_a'] = peak_current(part, audits)
    if _has(part, CONTROL_TRACE.name):
        part.load_columns({CONTROL_TRACE.name: _TRACED})
        figures |= _of_trace(part[CONTROL_TRACE.name], 1.0 / recorded_sample_rate(part))
    if _has(part, DISPLACEMENT.name):
        part.load_columns({DISPLACEMENT.name: DISPLACEMENT.names})
        series = part[DISPLACEMENT.name]
        stamps, first = np.unique(series.stamps, return_index=True)
        figures |= displacement_figures(stamps, series['mount'][first], recorded_sample_rate(part))
    return figures


def _of_trace(trace: Series, sample_time: float) -> Figures:
    """Return the switching, and the work of |mu N v| by which the pads wear, mu N being Eq (9)'s friction."""
    order = np.argsort(trace.stamps, kind='stable')
    seconds = (trace.stamps[order] - trace.stamps[order[:1]]) * 1e-9
    active = trace['damping_active'][order]
    on, _ = switching_places(seconds, active)
    power = np.abs(trace['friction_coefficient'] * trace['normal_force'] * trace['velocity'])
    return {
        'switched_on': len(on),
        'damping_s': sample_time * int(np.count_nonzero(active > 0.0)),
        'pad_energy_j': sample_time * float(np.nansum(power)),
    }


def displacement_figures(stamps: NDArray[np.int64], values: NDArray[np.float64], rate: float) -> Figures:
    """Return the size of a displacement (m) with rising `stamps` (ns), also in bands; `rate` in Hz."""
    known = values[np.isfinite(values)]
    if not known.size:
        return {}
    figures: Figures = {
        'peak_displacement_m': float(np.abs(known).max()),
        'rms_displacement_m': float(np.std(known)),
    }
    seconds = (stamps - stamps[0]) * 1e-9
    for band, found in zip(BANDS, in_bands(seconds, values, rate, BANDS), strict=True):
        figures |= {band_name('peak', band): found.peak, band_name('rms', band): found.rms}
    return figures


def _has(part: Recording, name: str) -> bool:
    return name in part and part.topics[part.resolve(name)].message_count > 0


def _highest(values: np.ndarray) -> float:
    known = values[np.isfinite(values)]
    return float(known.max()) if known.size else math.nan
