"""Simulated rack recordings of the friction contact: ramp and hold (Fig. 7), sawtooth (Fig. 8).

The rack is what the authors describe: a linear motor under proportional control moves the contact, a load
cell measures the friction force, another one the clamping force. The contact is the full model.
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
_DISPLACEMENT_NOISE = 0.5e-6  # m
_DRAWN = (
    'b_offset', 'b_1', 'b_2', 'a_p1', 'a_p2', 'a_p3', 'a_n1', 'a_n2', 'a_n3',
    'alpha_p1', 'alpha_p2', 'alpha_n1', 'alpha_n2', 'beta_1', 'beta_2',
)  # fmt: skip


@dataclass(frozen=True)
class RackNoise:
    """Noise of the rack's sensors: `relative` rms of each force (and of ramp displacements) over its own rms.

    `displacement` in m is that of the position sensor in the long strokes of the sawtooth (chosen: it comes
    with the motor and resolves micrometres).
    """

    relative: float = 0.01
    displacement: float = _DISPLACEMENT_NOISE
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


def drawn_friction(seed: int) -> tuple[FrictionContact, FrictionCoefficients]:
    """Return other pads, drawn around the default ones (chosen: springs 30 %, coefficients 10 %)."""
    random = np.random.default_rng([seed, 4])

    def drawn(value: float, spread: float) -> float:
        return float(value * (1.0 + spread * random.uniform(-1.0, 1.0)))

    contact, coefs = FrictionContact(), FrictionCoefficients()
    return (
        FrictionContact(*(drawn(value, 0.3) for value in contact)),
        coefs._replace(**{name: drawn(getattr(coefs, name), 0.1) for name in _DRAWN}),
    )


def write_friction(
    folder: Path, contact: FrictionContact, coefs: FrictionCoefficients, noise: float, seed: int
) -> list[Path]:
    """Write friction_ramp.csv and a sawtooth friction_*N.csv for each normal force; return the files."""
    ramp, *others = (
        RackNoise(noise, _DISPLACEMENT_NOISE if noise > 0.0 else 0.0, 100 * seed + number)
        for number in range(1 + len(SAWTOOTH_NORMAL_FORCES))
    )
    files = [folder / 'friction_ramp.csv']
    write_csv(ramp_and_hold(contact, coefs, ramp), files[0], with_desired=True)
    for load, each in zip(SAWTOOTH_NORMAL_FORCES, others, strict=True):
        files.append(folder / f'friction_{load:.0f}N.csv')
        write_csv(sawtooth(contact, coefs, each, normal_force=load), files[-1])
    return files


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

    In series with the contact, p makes one spring with c_Re: what drives the full model is the desired
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
