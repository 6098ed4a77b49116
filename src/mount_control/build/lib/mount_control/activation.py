"""What mount_init left of an activation, as its two messages bring it one after the other."""

import threading
import time
from typing import Any, NamedTuple, Protocol

from mount_control.force_to_current import ForceTableError
from mount_control.sample_watch import SampleWatch

_PATIENCE = 1.0  # s, chosen: latched messages may still be under way when control is activated
_LOOK_PERIOD = 0.01  # s


class Table(Protocol):
    """`stamp` (ns) of its air_gap, `current` (A) over `normal_force` (N), both (n,)."""

    @property
    def stamp(self) -> int: ...

    @property
    def current(self) -> Any: ...

    @property
    def normal_force(self) -> Any: ...


class AirGap(NamedTuple):
    """What the controller needs of an air_gap: its stamp in ns and the offset current in A."""

    stamp: int
    offset_current: float


class Activation:
    """The newest table and air_gap; None where none has come."""

    def __init__(self) -> None:
        self.table: Table | None = None
        self.air_gap: AirGap | None = None

    def wait(self, watch: SampleWatch, ending: threading.Event) -> tuple[Table, AirGap]:
        """Return both as soon as they belong to the measurements that `watch` sees.

        Raises `ForceTableError` when they do not within a second, or when `ending` is set.
        """
        limit = time.monotonic() + _PATIENCE
        while True:
            table, air_gap = self.table, self.air_gap
            try:
                watch.check_belongs(table.stamp if table else None, air_gap.stamp if air_gap else None)
            except ForceTableError:
                if time.monotonic() > limit or ending.wait(_LOOK_PERIOD):
                    raise
                continue
            assert table is not None
            assert air_gap is not None
            return table, air_gap
