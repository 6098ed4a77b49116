"""Full and simplified model against recordings that the identification has not seen (Fig. 11)."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.signal import savgol_filter

from engine_mount.identification.friction.laws.pad import pad_force
from engine_mount.identification.friction.recording import (
    FloatArray,
    FrictionRecording,
    smoothed_displacement,
)
from engine_mount.identification.friction.steps.slip_regions import slip_regions
from mount_models.friction.coefficient import FrictionCoefficients
from mount_models.friction.contact import FrictionContact
from mount_models.friction.simplified import simplified_response


@dataclass(frozen=True)
class ModelValidation:
    """Error of both models on one recording, rms over rms of the measured force.

    `*_macroslip` leaves out what follows a turning point, where the simplified model is not defined, and
    strokes so slow that it fades mu (see `slip_regions`).
    `full`, `simplified` are the predicted forces (N, (n,)).
    """

    name: str
    full_error: float
    simplified_error: float
    full_macroslip: float
    simplified_macroslip: float
    full: FloatArray
    simplified: FloatArray


def validate(
    recording: FrictionRecording, contact: FrictionContact, coefs: FrictionCoefficients
) -> ModelValidation:
    """Return how full and simplified model predict `recording` from its displacement and normal force."""
    x = smoothed_displacement(recording)
    full = pad_force(contact, coefs, x, recording.dt, recording.normal_force)
    velocity = _velocity(x, recording.dt)
    clamp = np.where(velocity >= 0.0, recording.normal_force[:, 0], recording.normal_force[:, 1])
    simplified, _ = simplified_response(contact, coefs, velocity, clamp, recording.dt)
    sliding = slip_regions(recording, contact).macro
    if not sliding.any():
        sliding[:] = True

    def error(force: FloatArray, which: FloatArray | slice) -> float:
        difference, signal = (force - recording.force)[which], recording.force[which]
        return float(np.sqrt(np.mean(difference**2) / np.mean(signal**2)))

    everything = slice(None)
    return ModelValidation(
        recording.name,
        error(full, everything),
        error(simplified, everything),
        error(full, sliding),
        error(simplified, sliding),
        full,
        simplified,
    )


def pooled_error(validations: Sequence[ModelValidation], recordings: Sequence[FrictionRecording]) -> float:
    """Return the full model's error over all samples of all recordings."""
    weights = np.array([each.force_rms**2 * each.force.size for each in recordings])
    errors = np.array([each.full_error for each in validations])
    return float(np.sqrt((weights * errors**2).sum() / weights.sum()))


def _velocity(displacement: FloatArray, dt: float) -> FloatArray:
    window = max(3, round(0.02 / dt) | 1)  # 20 ms, chosen: less than the 30 ms or more that are left out
    if displacement.size <= window:
        return np.gradient(displacement, dt)
    return np.asarray(savgol_filter(displacement, window, 1, deriv=1, delta=dt))
