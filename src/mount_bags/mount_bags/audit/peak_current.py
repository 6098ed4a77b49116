"""The highest current that the control of a recording asked for."""

import math
from collections.abc import Mapping

import numpy as np

from mount_bags.audit.audit import TopicAudit
from mount_bags.bag.recording import ReadingError, Recording
from mount_bags.messages.series import SeriesError
from mount_ros.topics import CURRENT_SETPOINT, DISPLACEMENT


def peak_current(recording: Recording, audits: Mapping[str, TopicAudit]) -> float:
    """Return the highest setpoint (A) while control was active, NaN where none is known.

    The ramp of an initialisation does not count. `audits` is the audit of `recording`.
    """
    spans = {
        name.removesuffix(DISPLACEMENT.name) + CURRENT_SETPOINT.name: entry.answers.spans
        for name, entry in audits.items()
        if entry.answers is not None
    }
    recording.load_columns({name: ('coil_current',) for name in spans if name in recording})
    peaks = [_peak(recording, name, of_mount) for name, of_mount in spans.items()]
    return max((peak for peak in peaks if not math.isnan(peak)), default=math.nan)


def _peak(recording: Recording, name: str, spans: tuple[tuple[int, int], ...]) -> float:
    try:
        series = recording[name]
        currents, stamps = series['coil_current'], series.stamps
    except (ReadingError, SeriesError):
        return math.nan
    inside = np.zeros(len(stamps), bool)
    for begin, end in spans:
        inside |= (stamps >= begin) & (stamps <= end)
    known = currents[inside & np.isfinite(currents)]
    return float(np.max(known)) if len(known) else math.nan
