"""What a recording of the saw tooth tells: u, a line of mu over u for each stroke, both models beside it."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from engine_mount.experiments.harness.rack_recording import SUBSTEPS
from engine_mount.identification.friction.files import read_recording
from engine_mount.identification.friction.recording import FloatArray, FrictionRecording
from engine_mount.identification.friction.steps.sawtooth import (
    StrokeLine,
    deflection_from_force,
    stroke_lines,
)
from mount_models.friction.coefficient import FrictionCoefficients
from mount_models.friction.contact import FrictionContact
from mount_models.friction.simplified import simplified_response
from mount_sim.plant.friction import full_response


@dataclass(frozen=True)
class Run:
    """One recording at one normal force, its strokes, and both models driven by its displacement.

    The first stroke, which no turning point precedes, is not among `strokes`.
    """

    recording: FrictionRecording
    deflection: FloatArray
    strokes: list[StrokeLine]
    full_force: FloatArray
    simplified_force: FloatArray


def evaluate(path: Path, contact: FrictionContact, coefs: FrictionCoefficients) -> Run:
    """Return what steps 1 and 2 of the identification make of the recording at `path`, and the models."""
    recording = read_recording(path)
    xi = deflection_from_force(
        recording.force, recording.dt, contact.tangential_stiffness, contact.tangential_damping
    )
    x, load = recording.displacement, recording.normal_force[:, 0]
    velocity = np.diff(x, prepend=x[0]) / recording.dt
    simplified, _ = simplified_response(contact, coefs, velocity, load, recording.dt)
    return Run(
        recording,
        xi,
        [line for line in stroke_lines(recording, contact) if line.stroke.start > 0],
        _full_model_force(contact, coefs, recording),
        simplified,
    )


def _full_model_force(
    contact: FrictionContact, coefs: FrictionCoefficients, recording: FrictionRecording
) -> FloatArray:
    """Return the force (N) of the full model on the recorded displacement, straight between samples."""
    samples = np.arange(recording.displacement.size)
    fine = np.arange((samples.size - 1) * SUBSTEPS + 1) / SUBSTEPS
    x = np.interp(fine, samples, recording.displacement)
    load = np.interp(fine, samples, recording.normal_force[:, 0])
    return np.asarray(full_response(contact, coefs, x, load, recording.dt / SUBSTEPS)[0][::SUBSTEPS])
