"""The result of an initialisation, whose two messages arrive one after the other."""

import threading
import time
from typing import Any, NamedTuple

from mount_control.control_loop import ControlLoop
from mount_control.force_maker import ForceTableError

_PATIENCE = 1.0  # s, chosen: latched messages may still be under way when control is activated
LOOK_PERIOD = 0.01  # s, between looks at what other threads bring
_COUNTED = 50  # chosen: samples from which their rate is known
_RATE_TOLERANCE = 0.2  # chosen: less than any other rate lies beside
_REMEDY = 'activate mount_init (again)'


class AirGap(NamedTuple):
    """What the controller needs of an air_gap: its stamp in ns and the offset current in A."""

    stamp: int
    offset_current: float


class Activation:
    """The newest messages; None where none has come."""

    def __init__(self) -> None:
        self.table: Any = None
        """With `stamp` (ns) of its air_gap and `current` (A) over `normal_force` (N), both (n,)."""
        self.air_gap: AirGap | None = None

    def wait(self, loop: ControlLoop, ending: threading.Event) -> tuple[Any, AirGap]:
        """Return both as soon as they belong to the measurements that `loop` has noted.

        Raises `ForceTableError` when they do not within a second, or when `ending` is set.
        """
        limit = time.monotonic() + _PATIENCE
        while True:
            table, air_gap = self.table, self.air_gap
            try:
                check_belongs(loop, table.stamp if table else None, air_gap.stamp if air_gap else None)
            except ForceTableError:
                if time.monotonic() > limit or ending.wait(LOOK_PERIOD):
                    raise
                continue
            assert air_gap is not None
            return table, air_gap


def check_belongs(loop: ControlLoop, table_stamp: int | None, air_gap_stamp: int | None) -> None:
    """Raise `ForceTableError` unless the table was measured on the present uninterrupted measurements.

    Pads wear and the car is assembled anew, so a table from before a loss of power is not valid.
    """
    if table_stamp is None or air_gap_stamp is None:
        missing = 'current_force_table' if table_stamp is None else 'air_gap'
        raise ForceTableError(f'no {missing} was received (0 messages, needed is 1); {_REMEDY}')
    if table_stamp != air_gap_stamp:
        raise ForceTableError(
            f'current_force_table (activation {_seconds(table_stamp)}) and air_gap '
            f'(activation {_seconds(air_gap_stamp)}) are of different activations; {_REMEDY}'
        )
    if loop.first is None or loop.last is None:
        raise ForceTableError('no displacement was received; activate mount_driver first')
    if loop.first <= table_stamp <= loop.last:
        return
    raise ForceTableError(
        f'current_force_table is of {_seconds(table_stamp)}, but mount_control has received the measurements '
        f'without a break within {_seconds(loop.first)} .. {_seconds(loop.last)} only; {_REMEDY}'
    )


def check_rate(loop: ControlLoop, sample_rate: float) -> None:
    """Raise `ForceTableError` if the last samples were not measured at `sample_rate` (Hz).

    By the lower quartile of the times between them: up to three of four may be lost.
    """
    if len(loop.steps) < _COUNTED:
        return
    rate = 1e9 / sorted(loop.steps)[len(loop.steps) // 4]
    if abs(rate - sample_rate) > _RATE_TOLERANCE * sample_rate:
        raise ForceTableError(
            f'displacement comes at {rate:.0f} Hz, but sample_rate of mount_control is {sample_rate:g} '
            f'Hz (limit {100.0 * _RATE_TOLERANCE:g} %); start the whole graph with one sample_rate'
        )


def _seconds(stamp: int) -> str:
    return f'{stamp / 1e9:.3f} s'
