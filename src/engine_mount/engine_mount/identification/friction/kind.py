"""What a recording is: ramp and hold, sawtooth, or any other motion."""

import numpy as np

from engine_mount.identification.friction.recording import (
    FrictionRecording,
    IdentificationError,
    smoothed_displacement,
)
from engine_mount.identification.friction.steps.sawtooth import strokes, turning_points

RAMP, SAWTOOTH, OTHER = 'ramp', 'sawtooth', 'other motion'
_HELD = 0.4  # of the recording within a quarter of the range of its end
_STRAIGHT = 0.015  # of a stroke: rms distance from a line; an arc of a sine has 0.05


def recognised(recording: FrictionRecording) -> str:
    """Return 'ramp', 'sawtooth' or 'other motion'; a motion to one side only that is no ramp is refused."""
    x = smoothed_displacement(recording)
    span = float(np.ptp(x))
    held = np.abs(x - x[-max(1, x.size // 20) :].mean()) < 0.25 * span
    if not turning_points(x):
        if held.mean() > _HELD:
            return RAMP
        side = 'positive' if x[-1] > x[0] else 'negative'
        raise IdentificationError(
            f'{recording.name} moves to the {side} side only (0 turning points in {1e3 * span:.3g} mm); at '
            'least 1 is needed: record strokes to and fro, or a ramp that is held'
        )
    return SAWTOOTH if _is_straight(recording) else OTHER


def _is_straight(recording: FrictionRecording) -> bool:
    time, x = recording.time, recording.displacement
    full = [each for each in strokes(recording) if np.ptp(x[each[0] : each[1]]) > 0.5 * np.ptp(x)]
    straight = 0
    for first, last, _ in full:
        edge = (last - first) // 10
        inside = slice(first + edge, last - edge)
        line = np.polyval(np.polyfit(time[inside], x[inside], 1), time[inside])
        straight += bool(np.std(x[inside] - line) < _STRAIGHT * np.ptp(x[inside]))
    return len(full) >= 2 and straight > 0.8 * len(full)
