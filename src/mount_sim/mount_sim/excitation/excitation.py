"""What shakes the mount: series of numbers at the plant's step, and what they stand for."""

from dataclasses import dataclass
from enum import IntEnum

import numpy as np
from numpy.typing import NDArray

from mount_models.arithmetic.elementary import sines
from mount_models.arithmetic.series import StreamedSeries, series_over_time


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


def idle_force(
    amplitude: float, frequency: float, second_share: float, count: int, step_time: float
) -> StreamedSeries:
    """Return the force (n,) in N of an idling engine: a sine (N, Hz) and a share of twice its frequency."""

    def force(time: NDArray[np.float64]) -> NDArray[np.float64]:
        turns = frequency * time
        return np.asarray(amplitude * (sines(turns) + second_share * sines(2.0 * turns)))

    return series_over_time(count, step_time, force)
