"""The figures of one mount of a recording."""

import math
from collections.abc import Mapping
from typing import Any

import numpy as np

from engine_mount.fleet.catalogue.motion import displacement_figures
from engine_mount.fleet.catalogue.trace import TRACE_COLUMNS, trace_figures
from engine_mount.recordings.answers import peak_current
from engine_mount.recordings.audit import TopicAudit, audit, control_spans
from engine_mount.recordings.losses import losses
from engine_mount.recordings.recording import Recording
from engine_mount.recordings.session import recorded_sample_rate
from mount_ros.topics import AIR_GAP, COIL_TEMPERATURE, CONTROL_TRACE, CURRENT_SETPOINT, DISPLACEMENT

Figures = dict[str, Any]

OF_FRICTION = ('switched_on', 'damping_s', 'peak_current_a', 'pad_energy_j')
"""What control did to the friction: nothing in a mount without pads or with an open coil driver."""


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
    if _count(part, AIR_GAP.name):
        gap = part[AIR_GAP.name]
        for column, name in (
            ('rest_gap_m', 'rest_gap'),
            ('contact_gap_m', 'contact_gap'),
            ('offset_current_a', 'offset_current'),
        ):
            figures[column] = float(gap[name][-1])
    if _count(part, COIL_TEMPERATURE.name):
        figures['coil_temperature_degc'] = _highest(part[COIL_TEMPERATURE.name]['temperature'])
    rate = recorded_sample_rate(part)
    columns = {CONTROL_TRACE.name: TRACE_COLUMNS, DISPLACEMENT.name: DISPLACEMENT.names}
    columns = {name: names for name, names in columns.items() if _count(part, name)}
    part.load_columns(columns)
    if CONTROL_TRACE.name in columns:
        figures |= trace_figures(part[CONTROL_TRACE.name], 1.0 / rate)
    if DISPLACEMENT.name in columns:
        figures |= displacement_figures(part[DISPLACEMENT.name], rate)
    part.release()
    figures['peak_current_a'] = peak_current(part, control_spans(audits))
    return figures


def _count(part: Recording, name: str) -> int:
    """Return how many messages there are of a topic."""
    return part.topics[part.resolve(name)].message_count if name in part else 0


def _highest(values: np.ndarray) -> float:
    known = values[np.isfinite(values)]
    return float(known.max()) if known.size else math.nan
