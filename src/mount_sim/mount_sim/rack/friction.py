"""Simulated rack recordings of the friction contact: ramp and hold (Fig. 7), sawtooth (Fig. 8).

The rack is what the authors describe: a linear motor under proportional control, the spring p of Fig. 6,
moves the contact, a load cell measures the friction force, another one the clamping force. The contact is
the full model; nothing else acts.
"""

from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import numpy.typing as npt

from mount_models.friction.coefficient import FrictionCoefficients
from mount_models.friction.contact import FrictionContact
from mount_models.sampling import SAMPLE_RATE
from mount_sim.plant.friction import full_response
from mount_sim.rack.coil import write_columns

FloatArray = npt.NDArray[np.float64]

MACHINE_STIFFNESS = 2e6
"""p in N/m (chosen): the proportional position control of the linear motor."""
STROKE = 2.5e-3
"""Turning points of the sawtooth at +- this displacement, m (chosen)."""
SAWTOOTH_SPEEDS = tuple(0.001 * step for step in range(1, 11))
"""Speeds in m/s: 1 mm/s more after every second turning point, as in Sec. 4."""
SAWTOOTH_NORMAL_FORCES = (40.0, 60.0, 80.0, 100.0, 120.0)
SUBSTEPS = 5
"""Steps of the simulation in each sample (chosen)."""
_REST = 0.3  # s before the ramp
_RAMP_TIME, _RAMP_HEIGHT = 0.2, 6e-6  # s, m
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


_CONTACT, _COEFFICIENTS, _NOISE = FrictionContact(), FrictionCoefficients(), RackNoise()


def move(
    contact: FrictionContact,
    coefs: FrictionCoefficients,
    corner_times: npt.ArrayLike,
    corner_positions: npt.ArrayLike,
    normal_force: float,
    *,
    machine_stiffness: float = np.inf,
    substeps: int = SUBSTEPS,
) -> RackRecording:
    """Return what is there to measure while the desired displacement (m) goes straight from corner to corner.

    `corner_times` in s from 0 on. p (`machine_stiffness`, N/m) lies in series with c_Re, so both make one
    spring between desired displacement and creeping element; the displacement itself lacks what p gives way
    (exact).
    """
    times = np.asarray(corner_times, float)
    fine = np.arange(round(times[-1] * SAMPLE_RATE * substeps)) / (SAMPLE_RATE * substeps)
    desired = np.interp(fine, times, np.asarray(corner_positions, float))
    stiffness = 1.0 / (1.0 / contact.contact_stiffness + 1.0 / machine_stiffness)
    series = contact._replace(contact_stiffness=stiffness)
    force, _, _ = full_response(series, coefs, desired, np.full(fine.size, normal_force), fine[1])
    displacement = desired - force / machine_stiffness
    time, x, x_desired, measured = (values[::substeps] for values in (fine, displacement, desired, force))
    return RackRecording(time, x, x_desired, measured, np.full(time.size, normal_force))


def with_noise(
    recording: RackRecording, force_noise: float, displacement_noise: float, seed: int
) -> RackRecording:
    """Return what a load cell and a displacement sensor of these standard deviations (N, m) would record."""
    noise = np.random.default_rng(seed).standard_normal((2, recording.time.size))
    return replace(
        recording,
        displacement=recording.displacement + displacement_noise * noise[0],
        friction_force=recording.friction_force + force_noise * noise[1],
    )


def sawtooth_corners(stroke: float, speeds: npt.ArrayLike) -> tuple[FloatArray, FloatArray]:
    """Return times (s) and positions (m) of the corners: two strokes between -+ `stroke` at each speed (m/s).

    A half stroke from the middle to `stroke` at the first speed goes ahead; a negative `stroke` begins to
    the other side.
    """
    each = np.repeat(np.asarray(speeds, float), 2)
    ways = np.full(each.size, 2.0 * abs(stroke))
    times = np.cumsum(np.concatenate([[0.0, abs(stroke) / each[0]], ways / each]))
    positions = stroke * np.where(np.arange(times.size) % 2 == 0, -1.0, 1.0)
    positions[0] = 0.0
    return times, positions


def ramp_and_hold(
    contact: FrictionContact = _CONTACT,
    coefs: FrictionCoefficients = _COEFFICIENTS,
    noise: RackNoise = _NOISE,
    duration: float = 6.0,
) -> RackRecording:
    """Return a ramp of the desired displacement at 100 N, held to `duration` (s); nothing slides so far."""
    times, positions = [0.0, _REST, _REST + _RAMP_TIME, duration], [0.0, 0.0, _RAMP_HEIGHT, _RAMP_HEIGHT]
    rack = move(contact, coefs, times, positions, 100.0, machine_stiffness=MACHINE_STIFFNESS)
    random = np.random.default_rng(noise.seed)
    return RackRecording(
        rack.time,
        _noisy(rack.displacement, noise.relative, random),
        _noisy(rack.desired_displacement, noise.relative, random),
        _noisy(rack.friction_force, noise.relative, random),
        _noisy(rack.normal_force, noise.relative, random),
    )


def sawtooth(
    contact: FrictionContact = _CONTACT,
    coefs: FrictionCoefficients = _COEFFICIENTS,
    noise: RackNoise = _NOISE,
    *,
    normal_force: float = 100.0,
    speeds: tuple[float, ...] = SAWTOOTH_SPEEDS,
    stroke: float = STROKE,
) -> RackRecording:
    """Return strokes between -+ `stroke` (m), two at each of `speeds` (m/s), after a first half stroke."""
    rack = move(contact, coefs, *sawtooth_corners(stroke, speeds), normal_force)
    random = np.random.default_rng(noise.seed)
    return RackRecording(
        rack.time,
        rack.displacement + noise.displacement * random.standard_normal(rack.time.size),
        rack.displacement,
        _noisy(rack.friction_force, noise.relative, random),
        _noisy(rack.normal_force, noise.relative, random),
    )


def drawn_friction(seed: int) -> tuple[FrictionContact, FrictionCoefficients]:
    """Return other pads, drawn around the default ones (chosen: springs 30 %, coefficients 10 %)."""
    random = np.random.default_rng([seed, 4])

    def drawn(value: float, spread: float) -> float:
        return float(value * (1.0 + spread * random.uniform(-1.0, 1.0)))

    return (
        FrictionContact(*(drawn(value, 0.3) for value in _CONTACT)),
        _COEFFICIENTS._replace(**{name: drawn(getattr(_COEFFICIENTS, name), 0.1) for name in _DRAWN}),
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
    write_columns(file, columns, line_end='\r\n')


def _noisy(values: FloatArray, relative: float, random: np.random.Generator) -> FloatArray:
    rms = float(np.sqrt(np.mean(values**2)))
    return np.asarray(values + relative * rms * random.standard_normal(values.size))
