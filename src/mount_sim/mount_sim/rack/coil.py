"""The simulated rack: the core halves held at fixed gaps, force and coil ripple recorded, as files.

What comes out is what a real rack gives: points and samples with noise in CSV files, and no truth.
"""

import csv
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
from numpy.typing import ArrayLike, NDArray

from mount_models.quantity import ParameterError, with_values
from mount_models.sampling import HIGHEST_CURRENT, SAMPLE_RATE, SAMPLE_TIME
from mount_sim.plant.reluctance import ReluctanceActuator
from mount_sim.plant.reluctance import force as magnetic_force
from mount_sim.plant.ripple import (
    RippleCoil,
    TemperatureCoefficients,
    coil_at,
    current_rate,
    flux_rate,
)

FloatArray = NDArray[np.float64]

GAPS = np.linspace(270e-6, 550e-6, 15)
"""Gaps held one after the other while the force is taken, m (chosen)."""

RIPPLE_GAPS = np.linspace(250e-6, 550e-6, 16)
"""Gaps at which the ripple is recorded, m (chosen): a worn contact, pressed, is still on the curves."""

FORCE_CURRENTS = np.linspace(0.1, HIGHEST_CURRENT, 59)
"""Currents at which the force is taken at each gap, A (chosen)."""


@dataclass(frozen=True)
class Rack:
    """A rack with one actuator in it; `noise` is the relative standard deviation of each sensor."""

    actuator: ReluctanceActuator = field(default_factory=ReluctanceActuator)
    coil: RippleCoil = field(default_factory=RippleCoil)
    temperature: TemperatureCoefficients = field(default_factory=TemperatureCoefficients)
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

    def drawn(value: float, spread: float = 0.1) -> float:
        return float(value * (1.0 + spread * random.uniform(-1.0, 1.0)))

    return Rack(
        with_values(
            actuator,
            gap_area=drawn(actuator.gap_area),
            core_length=drawn(actuator.core_length),
            saturation_polarisation=drawn(actuator.saturation_polarisation, 0.05),
            knee_field=drawn(actuator.knee_field),
            residual_gap=drawn(actuator.residual_gap, 0.25),
            leakage_permeance=drawn(actuator.leakage_permeance),
        ),
        with_values(coil, conductivity=drawn(coil.conductivity)),
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
