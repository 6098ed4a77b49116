"""The figures of one mount of a recording."""

import math
from collections.abc import Mapping
from typing import Any

import numpy as np

from engine_mount.fleet.catalogue.motion import Motion
from engine_mount.fleet.catalogue.trace import Trace
from engine_mount.recordings.answers import PeakCurrent
from engine_mount.recordings.audit import TopicAudit, audit, control_spans
from engine_mount.recordings.columns import column_parts
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
    peak, trace, motion = PeakCurrent(part, control_spans(audits)), Trace(), Motion()
    columns, takers = dict(peak.columns), dict.fromkeys(peak.columns, peak.add)
    for topic, taker in ((CONTROL_TRACE, trace), (DISPLACEMENT, motion)):
        if _count(part, topic.name):
            name = part.resolve(topic.name)
            columns[name], takers[name] = taker.COLUMNS, taker.add
    for found in column_parts(part, columns):
        takers[found.topic](found)
    rate = recorded_sample_rate(part)
    figures['peak_current_a'] = peak.value
    return figures | trace.figures(1.0 / rate) | motion.figures(rate)


def _count(part: Recording, name: str) -> int:
    """Return how many messages there are of a topic."""
    return part.topics[part.resolve(name)].message_count if name in part else 0


def _highest(values: np.ndarray) -> float:
    known = values[np.isfinite(values)]
    return float(known.max()) if known.size else math.nan
