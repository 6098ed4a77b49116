"""Reference recordings against replays of them: the answers must be those of the reference to the bit."""

import os

import numpy as np

from engine_mount.recordings.compare import compare
from engine_mount.recordings.difference import time_text
from engine_mount.recordings.recording import Recording, open_recording
from engine_mount.recordings.reference import ANSWERS
from engine_mount.recordings.times import distinct
from mount_ros.topics import CONTROL_TRACE


def differences_from_reference(
    reference: Recording | str | os.PathLike[str], replayed: Recording | str | os.PathLike[str]
) -> list[str]:
    """Return how the answers in `replayed` differ from those in `reference`, in words; empty when to the bit.

    Compared are `current_setpoint` and `control_trace` by their stamps. From the first traced sample on
    every answer must be there and no other; of the ramp before it those that both have are compared. Raises
    `ReadingError` or `ComparisonError` where that cannot be told.
    """
    a, b = (each if isinstance(each, Recording) else open_recording(each) for each in (reference, replayed))
    comparison = compare(a, b, topics=ANSWERS)
    if not comparison.alignment.same_stamps:
        return ['the replay has other stamps than the reference: it answers other samples']
    traced = a[CONTROL_TRACE.name].stamps
    if not len(traced):
        return ['the reference holds no control_trace: there is nothing to meet']
    sentences = comparison.difference_sentences()
    for topic in ANSWERS:
        # When mount_control is deactivated it answers its last sample a second time, with 0 A; so distinct.
        stamps = [
            distinct(each[topic.name].stamps) if topic.name in each else np.empty(0, np.int64)
            for each in (a, b)
        ]
        for here, there, where in ((*stamps, 'the replay'), (*stamps[::-1], 'the reference')):
            missing = np.setdiff1d(here[here >= traced.min()], there)
            if len(missing):
                first = time_text(float(comparison.alignment.axis.of_stamps(missing[:1])[0]))
                sentences.append(
                    f'{len(missing)} samples of {topic.name} are missing in {where}, first at {first}'
                )
    return sentences
