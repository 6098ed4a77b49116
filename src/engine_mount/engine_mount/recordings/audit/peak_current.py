"""The highest current that the control of a recording asked for."""

import math
from collections.abc import Mapping

import numpy as np

from engine_mount.recordings.audit.audit import TopicAudit
from engine_mount.recordings.columns import ColumnPart, column_parts
from engine_mount.recordings.recording import Recording
from mount_recorder.topic_groups import registered_topic
from mount_ros.topics import CURRENT_SETPOINT, DISPLACEMENT

_CURRENT = CURRENT_SETPOINT.names[0]


class PeakCurrent:
    """The highest setpoint while control was active, found part by part.

    The ramp of an initialisation does not count.
    """

    def __init__(self, recording: Recording, audits: Mapping[str, TopicAudit]):
        """Take a recording and its audit."""
        self._spans = {
            name: entry.answers.spans
            for topic, entry in audits.items()
            if entry.answers is not None
            and _is_setpoint(recording, name := topic.removesuffix(DISPLACEMENT.name) + CURRENT_SETPOINT.name)
        }
        self.value = math.nan
        """In A, NaN where none is known."""

    @property
    def columns(self) -> dict[str, tuple[str, ...]]:
        """Which columns of which topics it needs."""
        return dict.fromkeys(self._spans, (_CURRENT,))

    def add(self, part: ColumnPart) -> None:
        """Look at a part of one of these topics."""
        currents = part.column(_CURRENT)
        for begin, end in self._spans[part.topic]:
            inside = currents[(part.stamps >= begin) & (part.stamps <= end)]
            known = inside[np.isfinite(inside)]
            if known.size:
                self.value = float(np.fmax(self.value, known.max()))


def peak_current(recording: Recording, audits: Mapping[str, TopicAudit]) -> float:
    """Return the highest setpoint (A) while control was active, NaN where none is known.

    `audits` is the audit of `recording`. In memory are no more than a part of its setpoints.
    """
    found = PeakCurrent(recording, audits)
    for part in column_parts(recording, found.columns):
        found.add(part)
    return found.value


def _is_setpoint(recording: Recording, name: str) -> bool:
    topic = recording.topics.get(name)
    return topic is not None and registered_topic(name, topic.type) is CURRENT_SETPOINT
