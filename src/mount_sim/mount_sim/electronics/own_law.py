"""The control law inside the electronics: the C of `engine-mount export c`, built as a shared library."""

import ctypes
from collections import deque
from collections.abc import Iterator
from math import nan

from mount_driver.can_messages import OwnSetpoint, TablePoint, table_crc
from mount_models.quantity import ParameterError
from mount_models.sampling import SETPOINT_TIMEOUT

_NOT_KNOWN = ctypes.c_double(0.0)  # Hz: electronics do not know how fast the crankshaft turns


class OwnLaw:
    """Computes setpoints from the samples, once it has a table and while the host answers.

    It starts afresh with the first sample that the host answers, as the host's own law does.
    """

    def __init__(self, library: str, sample_rate: float):
        """Load the shared `library`; raises `ParameterError` where it is none, or computes otherwise."""
        try:
            self._c = ctypes.CDLL(library)
            self._law = ctypes.c_char.in_dll(self._c, 'engine_mount_controller_law')
            size = ctypes.c_int64.in_dll(self._c, 'engine_mount_controller_size').value
            self._memory = ctypes.create_string_buffer(size)
            self._c.engine_mount_controller_step.restype = ctypes.c_double
            self._c.engine_mount_controller_self_test.restype = ctypes.c_bool
            if not self._c.engine_mount_controller_self_test(self._memory):
                raise ValueError('its self-test fails')
        except (OSError, ValueError) as error:
            raise ParameterError(
                f'controller_library {library!r} cannot be used ({error}); build it as '
                'docs/how-to/law_in_the_electronics.md says'
            ) from None
        # number, stamp (ns) and displacement (m) of the samples of which the host may answer one
        self._past: deque[tuple[int, int, float]] = deque(maxlen=round(SETPOINT_TIMEOUT * sample_rate))
        self.forget()

    def forget(self, crc: int = 0) -> None:
        """Begin without a table; `crc` is that of the table to come."""
        self._points: list[tuple[float, float]] = []
        self._crc, self._loaded = crc, False
        self.stop()

    def stop(self) -> None:
        """Let the law rest until the next answer of the host."""
        self._running = False
        self.current = nan
        """Setpoint (A) of the newest sample; NaN while the law rests."""

    def take_point(self, point: TablePoint) -> OwnSetpoint:
        """Take a point of the table; return the frame that asks for the next."""
        if point.table_crc != self._crc:
            self.forget(point.table_crc)
        if point.point == len(self._points) < point.points:
            self._points.append((point.current, point.normal_force))
            if len(self._points) == point.points:
                self._loaded = table_crc(self._points) == self._crc and self._start()
                if not self._loaded:
                    self.forget(self._crc)
        return self._frame(self._past[-1][0] if self._past else 0)

    def take_answer(self, number: int) -> Iterator[OwnSetpoint]:
        """Start with sample `number`, which the host has answered, where the law rests; yield its frames."""
        if self._loaded and not self._running:
            self._running, newest = self._start(), self._past[-1][0]
            # Older numbers may be greater: those from before a restart of the counters.
            yield from (self._answer(*sample) for sample in self._past if number <= sample[0] <= newest)

    def take_sample(self, number: int, stamp: int, displacement: float) -> OwnSetpoint:
        """Take a sample as the bus carries it (ns, m; NaN: not valid); return its frame."""
        self._past.append((number, stamp, displacement))
        return self._answer(number, stamp, displacement) if self._running else self._frame(number)

    def _start(self) -> bool:
        """Start afresh with the table; return whether C accepts it."""
        (offset, _), *table = self._points
        rows = [(ctypes.c_double * len(table))(*row) for row in zip(*table, strict=True)]
        self._c.engine_mount_controller_start(self._memory, ctypes.byref(self._law))
        status: int = self._c.engine_mount_controller_set_table(
            self._memory, *rows, ctypes.c_int64(len(table)), ctypes.c_double(offset)
        )
        return status == 0

    def _answer(self, number: int, stamp: int, displacement: float) -> OwnSetpoint:
        sample = ctypes.c_int64(stamp), ctypes.c_double(displacement), _NOT_KNOWN
        self.current = self._c.engine_mount_controller_step(self._memory, *sample)
        return self._frame(number)

    def _frame(self, number: int) -> OwnSetpoint:
        return OwnSetpoint(number & 0xFFFF, len(self._points), self._crc, self.current)
