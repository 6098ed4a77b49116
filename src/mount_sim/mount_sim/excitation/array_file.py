"""An excitation as an array on disk, one number for each step of the plant: the desk makes it of recordings.

The file is NPY, its array (n,) of records with one field of float64, little-endian, `STEP_TIME` apart:
`chassis_acceleration` in m/s^2 upwards, its mean removed (scenario recorded), or `road_height` in m upwards
(scenario road). The name of the field says what the numbers are, so no other array is taken for one.
"""

from pathlib import Path

import numpy as np

from mount_models.arithmetic.series import StreamedSeries, series_of
from mount_models.quantity import ParameterError
from mount_sim.excitation.excitation import Excitation, Seat
from mount_sim.excitation.scenario import STEP_TIME

FIELDS = {Seat.ACCELERATED_CHASSIS: 'chassis_acceleration', Seat.VEHICLE: 'road_height'}
_BLOCK = 1 << 20


def write_excitation(file: Path, excitation: Excitation) -> Path:
    """Write what shakes the plant, without the force on the engine; return `file`."""
    count, field = len(excitation.values), FIELDS[excitation.seat]
    rows = np.lib.format.open_memmap(file, 'w+', np.dtype([(field, '<f8')]), (count,))
    for first in range(0, count, _BLOCK):
        rows[field][first : first + _BLOCK] = excitation.values[first : first + _BLOCK]
    rows.flush()
    return file


def read_excitation(file: str, seat: Seat) -> StreamedSeries:
    """Return the numbers (n,) in `file`, or raise `ParameterError`."""
    field, values = FIELDS[seat], np.empty(0)
    try:
        rows = np.load(file, mmap_mode='r')
    except (OSError, ValueError, EOFError) as error:
        raise ParameterError(f'the excitation {file} cannot be read as NPY ({error}): {_remedy()}') from None
    if isinstance(rows, np.ndarray) and rows.ndim == 1 and rows.dtype == np.dtype([(field, '<f8')]):
        values = rows[field]
    if not values.size:
        raise ParameterError(
            f'the excitation {file} is no array of at least one {field}, each {1e6 * STEP_TIME:g} us: '
            + _remedy()
        )
    for first in range(0, values.size, _BLOCK):
        finite = np.isfinite(values[first : first + _BLOCK])
        if not finite.all():
            raise ParameterError(
                f'the excitation {file} is not finite at number {first + int(finite.argmin())}: make it again'
            )
    return series_of(values)


def _remedy() -> str:
    return (
        'the simulator takes excitations at its own step alone; engine-mount drive makes them of recordings '
        'and roads, and leaves them in given/ of a drive'
    )
