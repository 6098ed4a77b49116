"""The current-force table as a `std_msgs/Float64MultiArray`, written and read in this one file.

Row-major, shape (2, N). Dimension 0: label `rows: current (A), normal_force (N)`; dimension 1: label
`activation <stamp>`, the stamp in ns of the `air_gap` message that belongs to the table.
"""

import re
from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from mount_models.sampling import HIGHEST_CURRENT
from mount_ros.messages.cdr import CdrWriter, deserialise
from mount_ros.messages.scalars import MessageError
from mount_ros.topics import CURRENT_FORCE_TABLE, ELECTRONICS_TABLE

FloatArray = npt.NDArray[np.float64]

_ROWS_LABEL = 'rows: current (A), normal_force (N)'
_ACTIVATION_LABEL = 'activation '


class ForceTable(NamedTuple):
    """What a message holds: `stamp` (ns) of its air_gap, `current` (A), `normal_force` (N), shape (N,)."""

    stamp: int
    current: FloatArray
    normal_force: FloatArray


def table_message(stamp: int, table: npt.ArrayLike) -> bytes:
    """Return the serialised message of a table of shape (2, N), rows current (A) and normal force (N).

    `stamp` (ns) is that of the `air_gap` message. Raises `MessageError` for a table
    that `from_message` would refuse.
    """
    rows = np.asarray(table, float)
    _check(rows)
    count = int(rows.shape[1])
    layout = CdrWriter().numbers('I', 2).texts(_ROWS_LABEL).numbers('I', 2, 2 * count)
    layout.texts(f'{_ACTIVATION_LABEL}{stamp}').numbers('I', count, count, 0)
    return layout.sequence('d', rows.ravel().tolist()).raw


def from_message(message: Any) -> ForceTable:
    """Return activation stamp and table of a `Float64MultiArray`, or raise `MessageError`."""
    numbers, layout = np.array(message.data, float), message.layout
    count = numbers.size // 2
    found = [(each.label, each.size, each.stride) for each in layout.dim]
    stamp = re.fullmatch(rf'{_ACTIVATION_LABEL}([0-9]+)', found[-1][0] if found else '')
    wanted = [(_ROWS_LABEL, 2, 2 * count), (stamp[0] if stamp else 'activation <stamp ns>', count, count)]
    if stamp is None or found != wanted or layout.data_offset or numbers.size % 2:
        raise _refusal(f'must hold 2 x N numbers as {wanted}; instead it holds {numbers.size} as {found}')
    rows = numbers.reshape(2, count)
    _check(rows)
    return ForceTable(int(stamp[1]), rows[0], rows[1])


def from_bytes(raw: bytes) -> ForceTable:
    """Like `from_message`, from the serialised message that a data path hands over."""
    return from_message(deserialise(raw, CURRENT_FORCE_TABLE.type))


def law_table_message(points: Sequence[tuple[float, float]]) -> bytes:
    """Return the serialised `electronics_table` of points (A, N)."""
    numbers = [number for point in points for number in point]
    return CdrWriter().numbers('I', 0, 0).sequence('d', numbers).raw


def law_table_points(raw: bytes) -> list[tuple[float, float]]:
    """Return the points (A, N) of a serialised `electronics_table`; a `ValueError` for an odd count."""
    numbers = deserialise(raw, ELECTRONICS_TABLE.type).data
    return list(zip(numbers[::2], numbers[1::2], strict=True))


def _check(rows: FloatArray) -> None:
    if rows.ndim != 2 or rows.shape[0] != 2 or rows.shape[1] < 2:
        raise _refusal(f'must have 2 rows of at least 2 columns; instead received shape {rows.shape}')
    if not np.isfinite(rows).all():
        column = int(np.argwhere(~np.isfinite(rows))[0][1])
        raise _refusal(f'must be finite; column {column} is {rows[0, column]} A, {rows[1, column]} N')
    falls = np.argwhere(~(np.diff(rows) > 0.0))
    if falls.size:
        row, column = falls[0].tolist()
        name, unit = (('current', 'A'), ('normal force', 'N'))[row]
        raise _refusal(
            f'must rise strictly; {name} at columns {column} and {column + 1} is '
            f'{rows[row, column]:g} and {rows[row, column + 1]:g} {unit}'
        )
    low, high = float(rows[0, 0]), float(rows[0, -1])
    if low < 0.0 or high > HIGHEST_CURRENT:
        raise _refusal(
            f'must keep the current within 0 .. {HIGHEST_CURRENT:g} A; it spans {low:g} .. {high:g} A'
        )


def _refusal(what: str) -> MessageError:
    return MessageError(f'current_force_table {what}; activate mount_init again')
