"""Own damper characteristics: points of force over velocity, written down or in a file."""

import csv
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from mount_models.plain_yaml import YamlError, plain_yaml, text_of_file

FloatArray = npt.NDArray[np.float64]

COLUMNS = ('velocity', 'force')
"""Names of the columns, m/s and N, in a file and in a mapping."""
FILE_ENDINGS = ('.csv', '.yaml', '.yml')
HIGHEST_VELOCITY = 1.0
"""A characteristic ends here (m/s, chosen): twenty times the peak velocity of 8 Hz with 1 mm."""
HIGHEST_FORCE = 1e4
"""N, chosen: far more than friction at the highest current."""
MOST_POINTS = 10_000


class DamperError(ValueError):
    """A damper characteristic cannot be built; the text says why and the remedy."""


def points_in(path: Path) -> dict[str, list[float]]:
    """Return {'velocity': m/s, 'force': N} of a file CSV or YAML with these columns; raises `DamperError`."""
    try:
        text = text_of_file(path)
        columns = _columns_of_csv(text) if path.suffix == '.csv' else plain_yaml(text)
        velocity, force = checked_points(columns)
    except YamlError as error:
        raise DamperError(f'damper file {path} {error}') from None
    except (DamperError, csv.Error) as error:
        raise DamperError(f'damper file {path}: {error}') from None
    return {'velocity': velocity.tolist(), 'force': force.tolist()}


def checked_points(columns: Any) -> tuple[FloatArray, FloatArray]:
    """Return velocities (m/s) and forces (N), (n,), of a mapping with both columns, or raise `DamperError`.

    The characteristic is odd, so both are magnitudes. It begins without force, else the pads would chatter.
    """
    if not isinstance(columns, Mapping) or sorted(map(str, columns)) != sorted(COLUMNS):
        raise DamperError(f'the points of a damper must have the columns {" and ".join(COLUMNS)}, m/s and N')
    velocity, force = (_numbers(name, columns[name]) for name in COLUMNS)
    if velocity.size != force.size:
        raise DamperError(
            f'velocity ({velocity.size} numbers) and force ({force.size} numbers) must be equally long'
        )
    if not 2 <= velocity.size <= MOST_POINTS:
        raise DamperError(f'a damper needs 2 to {MOST_POINTS} points; instead received {velocity.size}')
    if velocity[0] < 0.0 or velocity[-1] > HIGHEST_VELOCITY or not (np.diff(velocity) > 0.0).all():
        raise DamperError(
            f'velocity ({velocity[0]:g} .. {velocity[-1]:g} m/s) must rise strictly within '
            f'0 .. {HIGHEST_VELOCITY:g} m/s; give magnitudes, the characteristic is odd'
        )
    if force[0] != 0.0 or force.min() < 0.0 or force.max() > HIGHEST_FORCE:
        raise DamperError(
            f'force ({force[0]:g} N at first, {force.min():g} .. {force.max():g} N) must begin at 0 N and '
            f'lie within 0 .. {HIGHEST_FORCE:g} N; friction only opposes motion'
        )
    if not force.max() > 0.0:
        raise DamperError('force must be greater than 0 N somewhere; else choose no damping by its levels')
    return velocity, force


def _numbers(name: str, values: Any) -> FloatArray:
    try:
        if isinstance(values, (str, Mapping)) or not isinstance(values, Iterable):
            raise TypeError
        numbers = np.array([float(value) for value in values])
    except (TypeError, ValueError):
        raise DamperError(f'{name} must be a list of numbers; instead received {values!r:.60}') from None
    if not np.isfinite(numbers).all():
        place = int(np.flatnonzero(~np.isfinite(numbers))[0])
        raise DamperError(f'{name} must be finite; number {place + 1} is {numbers[place]:g}')
    return numbers


def _columns_of_csv(text: str) -> dict[str, list[float]]:
    lines = [line for line in text.splitlines() if line.strip() and not line.startswith('#')]
    rows = list(csv.reader(lines))
    header = [name.strip() for name in rows[0]] if rows else []
    if sorted(header) != sorted(COLUMNS):
        raise DamperError(f'its first line must be {",".join(COLUMNS)}; instead it is {",".join(header)!r}')
    columns: dict[str, list[float]] = {name: [] for name in header}
    for row in rows[1:]:
        try:
            for name, value in zip(header, row, strict=True):
                columns[name].append(float(value))
        except ValueError:
            raise DamperError(f'{",".join(row)!r} is not a line of two numbers') from None
    return columns
