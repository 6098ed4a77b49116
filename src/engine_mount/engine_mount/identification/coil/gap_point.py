"""What ripple recorded at one known gap says: inductance at the rest current, current of the crossing."""

import math
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from engine_mount.identification.coil.few_points import (
    MOST_POINTS,
    InductanceTable,
    TableError,
    falling_sentence,
)
from mount_models.coil.crossing import CrossingError, find_crossing
from mount_models.quantity import LawRefusedError

FloatArray = npt.NDArray[np.float64]


@dataclass(frozen=True)
class RippleRecording:
    """Ripple at one gap (m) and coil temperature (degC): currents (A) and inductances (H), shape (N,)."""

    name: str
    gap: float
    celsius: float
    current: FloatArray
    inductance: FloatArray


@dataclass(frozen=True)
class GapPoint:
    """What one recording says: L_0.2 (H) and i_20 (A) with standard deviations, dL/di there (H/A)."""

    name: str
    gap: float
    celsius: float
    inductance: float
    inductance_std: float
    crossing_current: float
    crossing_std: float
    crossing_slope: float
    table: tuple[float, float] | None = None
    """Lowest and highest current (A) of a table of few points that it was interpolated from."""


def measured_point(
    recording: RippleRecording,
    rest_current: float = 0.2,
    crossing_inductance: float = 20e-3,
    crossing_half_width: float = 0.2,
) -> GapPoint:
    """Return L_0.2 and i_20 of one recording; raises `LawRefusedError` naming it."""
    current, inductance = recording.current, recording.inductance
    if is_table(recording, rest_current):
        return _from_table(recording, rest_current, crossing_inductance)
    finite = np.isfinite(current) & np.isfinite(inductance)
    at_rest, rest_std = _rest_inductance(recording.name, current[finite], inductance[finite], rest_current)
    try:
        crossing = find_crossing(current, inductance, crossing_inductance, crossing_half_width)
    except CrossingError as error:
        steps = in_steps(recording)
        beyond = steps[1].max() < crossing_inductance or steps[1].min() > crossing_inductance
        sentence = falling_sentence(*steps, crossing_inductance) if beyond else error
        raise LawRefusedError(f'{recording.name}: {sentence}') from error
    return GapPoint(
        recording.name,
        recording.gap,
        recording.celsius,
        at_rest,
        rest_std,
        crossing.current,
        crossing.current_std,
        crossing.inductance_slope,
    )


def is_table(recording: RippleRecording, rest_current: float) -> bool:
    """Return whether it holds few points, as a table does, rather than samples of a ramp."""
    finite = np.isfinite(recording.current) & np.isfinite(recording.inductance)
    held = np.abs(recording.current[finite] - rest_current) <= _REST_HALF_WIDTH
    return bool(finite.sum() <= MOST_POINTS and held.sum() < _FEWEST_AT_REST)


def in_steps(recording: RippleRecording) -> tuple[FloatArray, FloatArray]:
    """Return means of currents (A), rising, and inductances (H) over up to 20 like parts of a recording."""
    finite = np.isfinite(recording.current) & np.isfinite(recording.inductance)
    order = np.argsort(recording.current[finite], kind='stable')
    parts = np.array_split(order, min(_STEPS, order.size))
    current, inductance = recording.current[finite], recording.inductance[finite]
    return (
        np.array([current[part].mean() for part in parts]),
        np.array([inductance[part].mean() for part in parts]),
    )


_STEPS = 20  # chosen: enough to see rise and fall
_FEWEST_AT_REST = 20  # chosen
_REST_HALF_WIDTH = 0.02  # A, chosen: there the inductance is straight over the current


def _from_table(recording: RippleRecording, rest_current: float, crossing_inductance: float) -> GapPoint:
    finite = np.isfinite(recording.current) & np.isfinite(recording.inductance)
    try:
        table = InductanceTable(recording.current[finite], recording.inductance[finite])
        at_rest, rest_std = table.at(rest_current)
        crossing, crossing_std, crossing_slope = table.falls_through(crossing_inductance)
    except TableError as error:
        raise LawRefusedError(f'{recording.name}: {error}') from error
    return GapPoint(
        recording.name, recording.gap, recording.celsius, at_rest, rest_std, crossing, crossing_std,
        crossing_slope, (float(table.current[0]), float(table.current[-1])),
    )  # fmt: skip


def _rest_inductance(
    name: str, current: FloatArray, inductance: FloatArray, rest_current: float
) -> tuple[float, float]:
    """Return the inductance (H) at the rest current and its std: a line through the samples around it."""
    near = np.abs(current - rest_current) <= _REST_HALF_WIDTH
    if near.sum() < _FEWEST_AT_REST:
        raise LawRefusedError(
            f'{name}: samples within {_REST_HALF_WIDTH:.2f} A of the rest current ({rest_current:.2f} A) '
            f'must be at least {_FEWEST_AT_REST}, {int(near.sum())} are; hold that current for longer'
        )
    z, values = (current[near] - rest_current) / _REST_HALF_WIDTH, inductance[near]
    deviation = np.abs(values - np.median(values))
    kept = deviation <= max(4.0 * 1.4826 * float(np.median(deviation)), 0.02 * abs(float(np.median(values))))
    z, values = z[kept], values[kept]
    powers = np.stack([np.ones_like(z), z], axis=1)
    if np.ptp(z) < 0.1:
        powers = powers[:, :1]  # the current was held: nothing to be said of a slope
    solution, *_ = np.linalg.lstsq(powers, values, rcond=None)
    scatter = float(np.sum((values - powers @ solution) ** 2)) / max(1, values.size - powers.shape[1])
    spread = float(np.linalg.inv(powers.T @ powers)[0, 0])
    return float(solution[0]), math.sqrt(scatter * spread)
