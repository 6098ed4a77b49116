"""Reference recordings: short drives in the repository whose setpoints a replay must meet to the bit."""

import os

import numpy as np

from engine_mount.recordings.bag.recording import Recording, open_recording
from engine_mount.recordings.compare.compare import Comparison, compare
from engine_mount.recordings.compare.quantity_text import time_text
from engine_mount.recordings.compare.words import differences
from engine_mount.recordings.messages.series import Times
from mount_ros.topics import CONTROL_TRACE, CURRENT_SETPOINT, Topic

ANSWERS = (CURRENT_SETPOINT, CONTROL_TRACE)
"""What a replay makes."""


def differences_from_reference(
    reference: Recording | str | os.PathLike[str], replayed: Recording | str | os.PathLike[str]
) -> list[str]:
    """Return how the answers in `replayed` differ from those in `reference`, in words; empty when to the bit.

    Compared are `current_setpoint` and `control_trace` by their stamps. From the first traced sample on
    every answer must be there and no other; of the ramp before it those that both have are compared. Raises
    `ReadingError` or `ComparisonError` where that cannot be told.
    """
    a, b = _opened(reference), _opened(replayed)
    comparison = compare(a, b, topics=ANSWERS)
    if not comparison.alignment.same_stamps:
        return ['the replay has other stamps than the reference: it answers other samples']
    told = differences(comparison)
    for topic in ANSWERS:
        told += _unmatched(a, b, topic, comparison)
    return told


def _opened(recording: Recording | str | os.PathLike[str]) -> Recording:
    return recording if isinstance(recording, Recording) else open_recording(recording)


def _unmatched(a: Recording, b: Recording, topic: Topic, comparison: Comparison) -> list[str]:
    traced = a[CONTROL_TRACE.name].stamps
    if not len(traced):
        return ['the reference holds no control_trace: there is nothing to meet']
    # When mount_control is deactivated it answers its last sample a second time, with 0 A; so unique.
    stamps_a, stamps_b = (_since(recording, topic, int(traced.min())) for recording in (a, b))
    told = []
    for here, there, where in ((stamps_a, stamps_b, 'the replay'), (stamps_b, stamps_a, 'the reference')):
        missing = np.setdiff1d(here, there)
        if len(missing):
            first = time_text(float(comparison.alignment.time(missing[:1])[0]))
            told.append(f'{len(missing)} samples of {topic.name} are missing in {where}, first at {first}')
    return told


def _since(recording: Recording, topic: Topic, first: int) -> Times:
    if topic.name not in recording:
        return np.empty(0, np.int64)
    stamps = np.unique(recording[topic.name].stamps)
    return stamps[stamps >= first]
