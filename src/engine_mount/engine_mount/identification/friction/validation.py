"""Full and simplified model against recordings that the identification has not seen (Fig. 11)."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.signal import savgol_filter

from engine_mount.identification.fitting import FloatArray, relative_rms
from engine_mount.identification.friction.pad_law import pad_force
from engine_mount.identification.friction.recording import FrictionRecording, smoothed_displacement
from engine_mount.identification.friction.sawtooth import slip_regions
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

    recording: FrictionRecording
    full: FloatArray
    simplified: FloatArray
    full_error: float
    simplified_error: float
    full_macroslip_error: float
    simplified_macroslip_error: float


def validate(
    recording: FrictionRecording, contact: FrictionContact, coefs: FrictionCoefficients
) -> ModelValidation:
    """Return how full and simplified model predict `recording` from its displacement and normal force."""
    dt, x, measured = recording.dt, smoothed_displacement(recording), recording.force
    full = pad_force(contact, coefs, x, dt, recording.normal_force)
    window = max(3, round(0.02 / dt) | 1)  # 20 ms, chosen: less than the 30 ms or more that are left out
    short = x.size <= window
    velocity = np.gradient(x, dt) if short else savgol_filter(x, window, 1, deriv=1, delta=dt)
    clamp = np.where(velocity >= 0.0, *recording.normal_force.T)
    simplified, _ = simplified_response(contact, coefs, velocity, clamp, dt)
    sliding = slip_regions(recording, contact).macro
    parts = slice(None), sliding if sliding.any() else slice(None)
    errors = (
        relative_rms((force - measured)[part], measured[part])
        for part in parts
        for force in (full, simplified)
    )
    return ModelValidation(recording, full, simplified, *errors)


def pooled_error(validations: Sequence[ModelValidation]) -> float:
    """Return the full model's error over all samples of all recordings."""
    weights = np.array([each.recording.force_rms**2 * each.recording.force.size for each in validations])
    errors = np.array([each.full_error for each in validations])
    return float(np.sqrt((weights * errors**2).sum() / weights.sum()))
