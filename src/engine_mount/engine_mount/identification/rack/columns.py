"""Columns of a rack's file in SI units: which quantities there are, and how large they may be."""

from collections.abc import Collection
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from engine_mount.recordings.place import recording_place
from engine_mount.signals.mapping import Mapping
from engine_mount.signals.quantities import Quantity, by_name
from engine_mount.signals.selection import select_rows
from engine_mount.signals.units import ZERO_CELSIUS

FloatArray = NDArray[np.float64]


class RackRecordingError(ValueError):
    """A rack recording cannot be used; the text says why and the remedy."""


RACK = by_name(
    Quantity('gap', 'length', 'air gap', 20e-6, 5e-3, by_size=True, mapped='air_gap'),
    Quantity('current', 'current', 'current of the coil', 0.05, 20.0, by_size=True),
    Quantity('force', 'force', 'force of the actuator', 2.0, 2e4, by_size=True),
    Quantity('inductance', 'inductance', 'inductance of the coil', 1e-3, 1.0, by_size=True),
    Quantity('current_rate', 'current/time', 'slope of the current', 10.0, 1e5, by_size=True),
    Quantity('flux_rate', 'flux density/time', 'slope of the flux density', 5.0, 1e5, by_size=True),
    Quantity(
        'coil_temperature', 'temperature', 'temperature of the coil', 213.15, 523.15, by_size=True,
        mapped='temperature',
    ),
)  # fmt: skip
"""What a rack measures, with the range of its largest value."""


def read_columns(
    file: Path, mapping: Mapping, needed: Collection[str], optional: Collection[str] = ()
) -> dict[str, FloatArray]:
    """Return the quantities of a `file` of any format in SI units (temperatures in degC), by name.

    A quantity is the column `<name>_<unit>` or `<name> [<unit>]`, or the one that `mapping` names. Raises
    `SignalError`.
    """
    known = {name: RACK[name] for name in (*needed, *optional)}
    found = select_rows(recording_place(file), mapping, known, needed)
    if 'coil_temperature' in found:
        # without what the way over K has rounded: 20 degC stay 20 to the bit
        found['coil_temperature'] = np.round(found['coil_temperature'] - ZERO_CELSIUS, 9)
    return found


def check_alive(file: Path, name: str, unit: str, values: FloatArray, driven: FloatArray) -> None:
    """Raise `RackRecordingError` for a channel that is constant, or stuck while the `driven` one changes."""
    if np.ptp(values) == 0.0:
        raise RackRecordingError(
            f'{file}: {name} is constant ({values[0]:g} {unit} in all {values.size} rows); is its sensor '
            f'connected, and the right column chosen?'
        )
    same = (np.diff(values) == 0.0) & (np.diff(driven) != 0.0)
    ends = np.flatnonzero(np.concatenate([[True], ~same, [True]]))
    longest = int(np.diff(ends).max())
    if longest > _LONGEST_STUCK:
        start = int(ends[np.argmax(np.diff(ends))])
        raise RackRecordingError(
            f'{file}: {name} stayed at {values[start]:g} {unit} for {longest} rows from row {start + 1} on '
            f'while the current changed, more than {_LONGEST_STUCK}; the sensor is stuck: leave these rows '
            'out'
        )


_LONGEST_STUCK = 12  # rows, chosen: coarse converters repeat themselves for a few
