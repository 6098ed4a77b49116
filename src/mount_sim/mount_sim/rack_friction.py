"""Simulated rack recordings of the friction contact: ramp and hold (Fig. 7), sawtooth (Fig. 8).

The rack is what the authors describe: a linear motor under proportional control moves the contact, a load
cell
measures the friction force, another one the clamping force. The contact is the full model.
"""

import csv
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import numpy.typing as npt

from mount_models.friction.coefficient import FrictionCoefficients
from mount_models.friction.contact import FrictionContact
from mount_models.friction.full import full_response

FloatArray = npt.NDArray[np.float64]

MACHINE_STIFFNESS = 2e6
"""p in N/m (chosen): the proportional position control of the linear motor."""
STROKE = 2.5e-3
"""Turning points of the sawtooth at +- this displacement, m (chosen)."""
SAWTOOTH_SPEEDS = tuple(0.001 * step for step in range(1, 11))
"""Speeds in m/s: 1 mm/s more after every second turning point, as in Sec. 4."""
SAWTOOTH_NORMAL_FORCES = (40.0, 60.0, 80.0, 100.0, 120.0)
_SUBSTEPS = 5


@dataclass(frozen=True)
class RackNoise:
    """Noise of the rack's sensors: `relative` rms of each force (and of ramp displacements) over its own rms.

    `displacement` in m is that of the position sensor in the long strokes of the sawtooth (chosen: it comes
    with the motor and resolves micrometres).
    """

    relative: float = 0.01
    displacement: float = 0.5e-6
    seed: int = 0


@dataclass(frozen=True)
class RackRecording:
    """What the rack records: time (s), displacement, desired displacement (m), forces (N), all (n,)."""

    time: FloatArray
    displacement: FloatArray
    desired_displacement: FloatArray
    friction_force: FloatArray
    normal_force: FloatArray


def ramp_and_hold(
    contact: FrictionContact | None = None,
    coefs: FrictionCoefficients | None = None,
    noise: RackNoise | None = None,
    *,
    normal_force: float = 100.0,
    height: float = 6e-6,
    ramp_time: float = 0.2,
    duration: float = 6.0,
    machine_stiffness: float = MACHINE_STIFFNESS,
    rate: float = 1000.0,
) -> RackRecording:
    """Return a ramp of the desired displacement to `height` (m), held; nothing slides at this height."""
    contact = contact or FrictionContact()
    coefs = coefs or FrictionCoefficients()
    time = np.arange(round(duration * rate)) / rate
    desired = height * np.clip((time - 0.3) / ramp_time, 0.0, 1.0)
    displacement, force = _pushed(contact, coefs, desired, normal_force, machine_stiffness, 1.0 / rate)
    noise = noise or RackNoise()
    random = np.random.default_rng(noise.seed)
    return RackRecording(
        time,
        _noisy(displacement, noise.relative, random),
        _noisy(desired, noise.relative, random),
        _noisy(force, noise.relative, random),
        _noisy(np.full(time.size, normal_force), noise.relative, random),
    )


def sawtooth(
    contact: FrictionContact | None = None,
    coefs: FrictionCoefficients | None = None,
    noise: RackNoise | None = None,
    *,
    normal_force: float = 100.0,
    speeds: tuple[float, ...] = SAWTOOTH_SPEEDS,
    stroke: float = STROKE,
    rate: float = 1000.0,
) -> RackRecording:
    """Return strokes between -+ `stroke` (m), two at each of `speeds` (m/s), after a first half stroke."""
    contact = contact or FrictionContact()
    coefs = coefs or FrictionCoefficients()
    corners, times = [0.0, stroke], [0.0, stroke / speeds[0]]
    for speed in speeds:
        for corner in (-stroke, stroke):
            corners.append(corner)
            times.append(times[-1] + 2.0 * stroke / speed)
    fine = np.arange(round(times[-1] * rate * _SUBSTEPS)) / (rate * _SUBSTEPS)
    path = np.interp(fine, times, corners)
    force, _, _ = full_response(contact, coefs, path, np.full(path.size, normal_force), fine[1])
    displacement, force = path[::_SUBSTEPS], force[::_SUBSTEPS]
    noise = noise or RackNoise()
    random = np.random.default_rng(noise.seed)
    return RackRecording(
        fine[::_SUBSTEPS],
        displacement + noise.displacement * random.standard_normal(displacement.size),
        displacement,
        _noisy(force, noise.relative, random),
        _noisy(np.full(force.size, normal_force), noise.relative, random),
    )


def write_csv(recording: RackRecording, file: Path, *, with_desired: bool = False) -> None:
    """Write time_s, displacement_mm, friction_force_n, normal_force_n (and desired_displacement_mm)."""
    columns = {
        'time_s': recording.time,
        'displacement_mm': 1e3 * recording.displacement,
        'friction_force_n': recording.friction_force,
        'normal_force_n': recording.normal_force,
    }
    if with_desired:
        columns['desired_displacement_mm'] = 1e3 * recording.desired_displacement
    with file.open('w', newline='', encoding='utf-8') as stream:
        writer = csv.writer(stream)
        writer.writerow(columns)
        for row in zip(*columns.values(), strict=True):
            writer.writerow([f'{value:.9g}' for value in row])


def _pushed(
    contact: FrictionContact,
    coefs: FrictionCoefficients,
    desired: FloatArray,
    normal_force: float,
    machine_stiffness: float,
    dt: float,
) -> tuple[FloatArray, FloatArray]:
    """Return displacement and force behind the machine's spring p.

    In series with the contact, p makes one spring with c_Re: the full model is driven by the desired
    displacement.
    """
    soft = contact.contact_stiffness * machine_stiffness / (contact.contact_stiffness + machine_stiffness)
    series = contact._replace(contact_stiffness=soft)
    fine = np.interp(np.arange(desired.size * _SUBSTEPS) / _SUBSTEPS, np.arange(desired.size), desired)
    force, _, _ = full_response(series, coefs, fine, np.full(fine.size, normal_force), dt / _SUBSTEPS)
    measured = force[::_SUBSTEPS]
    return desired - measured / machine_stiffness, measured


def _noisy(values: FloatArray, relative: float, random: np.random.Generator) -> FloatArray:
    rms = float(np.sqrt(np.mean(values**2)))
    return np.asarray(values + relative * rms * random.standard_normal(values.size))
