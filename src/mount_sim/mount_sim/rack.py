"""The simulated rack: force and coil ripple at held gaps, friction on ramps and sawtooths (Figs. 7, 8).

What comes out is what a real rack gives: points and samples with noise in CSV files, and no truth. For
friction the rack is what the authors describe: a linear motor under proportional control, the spring p of
Fig. 6, moves the contact, a load cell measures the friction force, another one the clamping force. The
contact is the full model; nothing else acts.
"""

import csv
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import NamedTuple

import numpy as np
import numpy.typing as npt
from numpy.typing import ArrayLike

from mount_models.arrays import FloatArray
from mount_models.friction.coefficient import FrictionCoefficients
from mount_models.friction.contact import FrictionContact
from mount_models.quantity import ParameterError
from mount_models.sampling import HIGHEST_CURRENT, SAMPLE_RATE, SAMPLE_TIME
from mount_sim.plant.friction import full_response
from mount_sim.plant.reluctance import ReluctanceActuator
from mount_sim.plant.reluctance import force as magnetic_force
from mount_sim.plant.ripple import (
    RippleCoil,
    TemperatureCoefficients,
    coil_at,
    current_rate,
    flux_rate,
)

GAPS = np.linspace(270e-6, 550e-6, 15)
"""Gaps held one after the other while the force is taken, m (chosen)."""

RIPPLE_GAPS = np.linspace(250e-6, 550e-6, 16)
"""Gaps at which the ripple is recorded, m (chosen): a worn contact, pressed, is still on the curves."""

FORCE_CURRENTS = np.linspace(0.1, HIGHEST_CURRENT, 59)
"""Currents at which the force is taken at each gap, A (chosen)."""


class Rack(NamedTuple):
    """A rack with one actuator in it; `noise` is the relative standard deviation of each sensor."""

    actuator: ReluctanceActuator = ReluctanceActuator()
    coil: RippleCoil = RippleCoil()
    temperature: TemperatureCoefficients = TemperatureCoefficients()
    noise: float = 0.01
    seed: int = 0


def measure_force(
    rack: Rack, gaps: ArrayLike = GAPS, currents: ArrayLike = FORCE_CURRENTS
) -> dict[str, FloatArray]:
    """Return the columns gap_um, current_a and force_n of one point for each gap (m) and current (A)."""
    gap, current = (array.ravel() for array in np.meshgrid(gaps, currents, indexing='ij'))
    truth = np.array(
        [magnetic_force(rack.actuator, i, d) for i, d in zip(current.tolist(), gap.tolist(), strict=True)]
    )
    noise = np.random.default_rng([rack.seed, 1]).standard_normal(truth.shape)
    return {'gap_um': gap * 1e6, 'current_a': current, 'force_n': truth * (1.0 + rack.noise * noise)}


def record_ripple(
    rack: Rack,
    gap: float,
    temperature: float = 20.0,
    rest_current: float = 0.2,
    peak_current: float = HIGHEST_CURRENT,
    duration: float = 3.0,
) -> dict[str, FloatArray]:
    """Return the ripple at a fixed `gap` (m), 1 kHz: one third of `duration` (s) at rest, then a ramp.

    Columns: time_s, gap_um, coil_temperature_c, current_a, current_rate_a_per_s and flux_rate_t_per_s. Noise
    is on both slopes, so that their quotient has `rack.noise`. Raises `ParameterError`.
    """
    coil = coil_at(rack.coil, rack.temperature, temperature)
    count = round(duration * SAMPLE_RATE)
    dwell = count // 3
    current = np.concatenate(
        [np.full(dwell, rest_current), np.linspace(rest_current, peak_current, count - dwell)]
    )
    rates = np.array([current_rate(coil, rack.actuator, i, gap) for i in current.tolist()])
    flux = np.array([flux_rate(coil, rack.actuator, i) for i in current.tolist()])
    if not np.isfinite(rates).all():
        raise ParameterError(
            f'the bridge cannot hold {current[~np.isfinite(rates)][0]:.2f} A at {temperature:.0f} degC and '
            f'{coil.link_voltage:g} V; lower peak_current ({peak_current:.2f} A)'
        )
    random = np.random.default_rng([rack.seed, 2, round(gap * 1e9), round((temperature + 300.0) * 10.0)])
    each = rack.noise / math.sqrt(2.0)
    return {
        'time_s': np.arange(count) * SAMPLE_TIME,
        'gap_um': np.full(count, gap * 1e6),
        'coil_temperature_c': np.full(count, temperature),
        'current_a': current,
        'current_rate_a_per_s': rates * (1.0 + each * random.standard_normal(count)),
        'flux_rate_t_per_s': flux * (1.0 + each * random.standard_normal(count)),
    }


def drawn_rack(seed: int, noise: float = 0.01) -> Rack:
    """Return a rack with another actuator, drawn around the default one (chosen: 10 %, joints 25 %)."""
    random = np.random.default_rng([seed, 3])
    actuator, coil = ReluctanceActuator(), RippleCoil()
    drawn = partial(_drawn, random)
    return Rack(
        actuator._replace(
            gap_area=drawn(actuator.gap_area),
            core_length=drawn(actuator.core_length),
            saturation_polarisation=drawn(actuator.saturation_polarisation, 0.05),
            knee_field=drawn(actuator.knee_field),
            residual_gap=drawn(actuator.residual_gap, 0.25),
            leakage_permeance=drawn(actuator.leakage_permeance),
        ),
        coil._replace(conductivity=drawn(coil.conductivity)),
        TemperatureCoefficients(core=drawn(0.0043, 0.2)),
        noise,
        seed,
    )


def write_force(rack: Rack, file: Path) -> Path:
    """Write `measure_force` at all gaps to one CSV `file`; return it."""
    return write_columns(file, measure_force(rack), f'force of the simulated actuator, seed {rack.seed}')


def write_ripple(
    rack: Rack, folder: Path, gaps: Sequence[float] = tuple(RIPPLE_GAPS.tolist()), temperature: float = 20.0
) -> list[Path]:
    """Write `record_ripple` at each gap (m) to a CSV file of its own in `folder`; return them."""
    folder.mkdir(parents=True, exist_ok=True)
    files = []
    for gap in gaps:
        name = f'ripple_{gap * 1e6:.0f}um_{temperature:+.0f}degC.csv'
        remark = f'coil ripple of the simulated actuator, seed {rack.seed}'
        files.append(write_columns(folder / name, record_ripple(rack, gap, temperature), remark))
    return files


def write_columns(
    file: Path, columns: Mapping[str, FloatArray], remark: str = '', line_end: str = '\n'
) -> Path:
    """Write columns of one length to a CSV file, units in their names; a `remark` leads as comment."""
    with file.open('w', newline='', encoding='utf-8') as stream:
        if remark:
            stream.write(f'# {remark}\n')
        writer = csv.writer(stream, lineterminator=line_end)
        writer.writerow(columns)
        for row in zip(*(column.tolist() for column in columns.values()), strict=True):
            writer.writerow([f'{value:.9g}' for value in row])
    return file


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


class RackNoise(NamedTuple):
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
    measured = rack.displacement, rack.desired_displacement, rack.friction_force, rack.normal_force
    return RackRecording(rack.time, *(_noisy(values, noise.relative, random) for values in measured))


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
    drawn = partial(_drawn, np.random.default_rng([seed, 4]))
    return (
        FrictionContact(*(drawn(value, 0.3) for value in _CONTACT)),
        _COEFFICIENTS._replace(**{name: drawn(getattr(_COEFFICIENTS, name)) for name in _DRAWN}),
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


def _drawn(random: np.random.Generator, value: float, spread: float = 0.1) -> float:
    return float(value * (1.0 + spread * random.uniform(-1.0, 1.0)))
