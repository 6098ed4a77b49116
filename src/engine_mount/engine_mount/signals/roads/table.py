"""Height over distance from the columns of any table."""

import math
from collections.abc import Sequence

import numpy as np

from engine_mount.signals.formats.measured import Heading, Measured, MeasuredColumn, listed
from engine_mount.signals.roads.profile import FloatArray, ProfileError
from engine_mount.signals.units import is_unit, unit_of

_DISTANCES = (
    'distance', 'dist', 'x', 's', 'u', 'station', 'chainage', 'position', 'weg', 'strecke', 'wegstrecke',
    'laenge', 'länge',
)  # fmt: skip
_HEIGHTS = (
    'height', 'effective_height', 'z', 'h', 'elevation', 'profile', 'road', 'hoehe', 'höhe', 'unevenness',
    'unebenheit',
)  # fmt: skip
_TIME_NAMES = ('t', 'time', 'timestamp', 'zeit')
_ACCELERATIONS = ('acc', 'accel', 'acceleration', 'beschleunigung', 'az', 'ax', 'ay')
EFFECTIVE = 'effective_height'
"""Name of a height that is already the one behind the tyre."""

Chosen = tuple[FloatArray, FloatArray, str, float, bool]
"""Distances and heights (n,) in m, the heights' unit and its size in m, whether they are effective ones."""


def heights_of(measured: Measured, column: str = '', distance: str = '', spacing: float = math.nan) -> Chosen:
    """Return the chosen columns in m; `column` and `distance` are NAME or NAME:UNIT.

    Without them columns are known by their names and units. `spacing` (m) stands in for a distance. Raises
    `ProfileError`, or `SignalError` where a named column is missing.
    """
    headings = [*measured.columns.values(), *measured.others]
    name = measured.provenance.uri.rpartition('/')[2]
    height, height_unit = _chosen(measured, column, _HEIGHTS, 'height', '--column', headings)
    _refuse_acceleration(name, height, height_unit)
    height_size = _size(name, height, height_unit, '--column')
    heights = height_size * height.values
    effective = height.name.casefold() == EFFECTIVE
    if math.isfinite(spacing):
        return spacing * np.arange(heights.size), heights, height_unit, height_size, effective
    along, unit = _chosen(measured, distance, _DISTANCES, 'distance', '--distance', headings)
    if along.number == height.number:
        raise ProfileError(f'{name}: column {height.name!r} is both height and distance; name the other one')
    if _dimension(unit) == 'time' or along.name.casefold() in _TIME_NAMES:
        raise ProfileError(
            f'{name}: column {along.name!r} is a time; a road is height over distance: name a distance with '
            '--distance, or multiply by the speed at which it was measured'
        )
    size = _size(name, along, unit, '--distance')
    return size * along.values, heights, height_unit, height_size, effective


def _chosen(
    measured: Measured, told: str, names: Sequence[str], what: str, option: str, headings: Sequence[Heading]
) -> tuple[MeasuredColumn, str]:
    """Return a column and its unit: the one that is told, else the first of the usual names."""
    if told:
        name, _, unit = told.rpartition(':') if ':' in told else (told, '', '')
        column = measured.column(name)
        return column, unit or column.unit
    by_name = {column.name.casefold(): column for column in reversed(measured.columns.values())}
    for name in names:
        if name in by_name:
            return by_name[name], by_name[name].unit
    file = measured.provenance.uri.rpartition('/')[2]
    times = [
        one.name for one in headings if one.name.casefold() in _TIME_NAMES or _dimension(one.unit) == 'time'
    ]
    hint = f'; {times[0]!r} is a time: a road is height over distance' if what == 'distance' and times else ''
    raise ProfileError(
        f'{file}: which column is the {what}? Name it with {option} NAME:UNIT; there are '
        f'{listed(headings)}{hint}'
    )


def _refuse_acceleration(name: str, column: MeasuredColumn, unit: str) -> None:
    words = column.name.casefold().replace('.', '_').replace('/', '_').split('_')
    by_name = any(word in _ACCELERATIONS for word in words)
    if _dimension(unit) == 'acceleration' or (by_name and _dimension(unit) != 'length'):
        raise ProfileError(
            f'{name}: column {column.name!r} ({unit or "no unit"}) is an acceleration, not a height; drive '
            'it with --scenario recorded, or make a road of it with engine-mount road invert'
        )


def _dimension(unit: str) -> str:
    return unit_of(unit).dimension if is_unit(unit) else ''


def _size(name: str, column: MeasuredColumn, unit: str, option: str) -> float:
    """Return one of `unit` in m; raises `ProfileError` where it is no length."""
    if _dimension(unit) == 'length':
        return unit_of(unit).factor
    known = column.values[np.isfinite(column.values)]
    spread = f' ({known.min():g} .. {known.max():g})' if known.size else ''
    why = f'the unit {unit!r}, which is no length' if unit else 'no unit in its header'
    raise ProfileError(
        f'{name}: column {column.name!r}{spread} has {why}; say it as in {option} '
        f'{column.name}:{_guess(column, option)}'
    )


def _guess(column: MeasuredColumn, option: str) -> str:
    """Return the unit that the size of the numbers suggests."""
    known = column.values[np.isfinite(column.values)]
    if option == '--distance' or not known.size:
        return 'm'
    spread = float(np.std(known))
    return 'm' if spread < 0.3 else 'mm' if spread < 300.0 else 'um'
