"""What shakes the mount: series of numbers at the plant's step, what they stand for, sample by sample."""

from dataclasses import dataclass
from enum import IntEnum

import numpy as np

from mount_models.arithmetic.series import StreamedSeries
from mount_models.arrays import FloatArray
from mount_models.quantity import ParameterError
from mount_models.sampling import SAMPLE_RATE, sample_time_ns

SHORT_BLOCK, LONG_BLOCK = 50, 500
"""Samples, chosen: where a block must be made within a part of a sample (real time); for a compiled loop."""


_WHOLE = 1e-9  # relative, derived: a quotient so near to a whole number is one


class Seat(IntEnum):
    """Where the mount is fixed, and so what the excitation means."""

    BENCH = 0  # displacement of the mount, m
    ACCELERATED_CHASSIS = 1  # vertical acceleration of the chassis under the engine, m/s^2
    VEHICLE = 2  # height of the road under the wheel, m


@dataclass(frozen=True)
class Excitation:
    """Numbers at the plant's step from `start` (s of simulated time) on; before it: rest.

    `values` (n,) in the unit of the seat; `engine_forces` (n,) in N, upwards on the engine, None for none; of
    both only the part that is asked for is made. `notes` say what had to be done to a recording to get them.
    """

    seat: Seat
    values: StreamedSeries
    step_time: float
    start: float
    engine_forces: StreamedSeries | None = None
    notes: tuple[str, ...] = ()

    @property
    def duration(self) -> float:
        """Length in s."""
        return len(self.values) * self.step_time


def steps_of_sample(sample_rate: float, step_time: float) -> int:
    """Return how many steps of the plant (s) lie between two samples; raises `ParameterError`."""
    between = 1e-9 * sample_time_ns(sample_rate) / step_time
    if abs(between - round(between)) > _WHOLE * between:
        raise ParameterError(
            f'sample_rate ({sample_rate:g} Hz) must leave a whole number of the {1e6 * step_time:g} us steps '
            f'of the simulated plant between two samples; instead there are {between:g}: choose 500, 625, '
            '800, 1000, 1250 or 2000 Hz'
        )
    return round(between)


class Shaking:
    """Excitation and force on the engine as a row of plant steps for each sample: rest, excitation, the end.

    Behind the end rack and road stay where they are, and no acceleration or force is left.
    """

    def __init__(self, excitation: Excitation, sample_rate: float = SAMPLE_RATE):
        self._excitation = excitation
        self.sample_rate = sample_rate
        """Hz"""
        self._steps = steps_of_sample(sample_rate, excitation.step_time)
        self.start = round(excitation.start * sample_rate)
        """Sample at which the excitation begins."""
        self.samples = self.start + len(excitation.values) // self._steps
        """Samples up to the end of the excitation."""
        last = excitation.values[-1:]
        self._afterwards = 0.0 if excitation.seat is Seat.ACCELERATED_CHASSIS or not last.size else last[0]
        self._make(self.start, SHORT_BLOCK)  # loads what is compiled before time begins to run

    def at(self, sample: int) -> tuple[FloatArray, FloatArray]:
        """Return excitation and force on the engine, (steps,) each, from `sample` to the next."""
        values, forces = self.ahead(sample, 1, SHORT_BLOCK)
        return values[0], forces[0]

    def ahead(self, sample: int, count: int, block: int = LONG_BLOCK) -> tuple[FloatArray, FloatArray]:
        """Return both, (n, steps), for n samples from `sample` on: at least one, at most `count`."""
        if not self._first <= sample < self._first + len(self._values):
            self._make(sample, block)
        part = slice(sample - self._first, sample - self._first + count)
        return self._values[part], self._forces[part]

    def _make(self, sample: int, block: int) -> None:
        """Make the block of so many samples that `sample` is in."""
        self._first = sample - sample % block
        self._values = self._rows(self._excitation.values, self._afterwards, block)
        self._forces = self._rows(self._excitation.engine_forces, 0.0, block)

    def _rows(self, series: StreamedSeries | None, afterwards: float, block: int) -> FloatArray:
        rows = np.zeros((block, self._steps))
        begin, end = (min(max(at - self._first, 0), block) for at in (self.start, self.samples))
        if series is not None and begin < end:
            shift = (self._first - self.start) * self._steps
            part = series[begin * self._steps + shift : end * self._steps + shift]
            rows[begin:end] = part.reshape(-1, self._steps)
        rows[end:] = afterwards
        return rows
