"""What shakes the mount: series of numbers at the plant's step, and what they stand for."""

from dataclasses import dataclass
from enum import IntEnum
from functools import partial

import numpy as np
from numpy.typing import NDArray

from mount_models.arithmetic.elementary import cosines, sines
from mount_models.arithmetic.series import StreamedSeries, series_over_time
from mount_models.quantity import checked
from mount_sim.excitation.road import Gap, RandomRoad, Sweep, gap_in_road, random_road, sweep_road


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


def bench_sine(
    frequency: float, amplitude: float, duration: float, start: float, step_time: float
) -> Excitation:
    """Return a sine of the mount's displacement (Hz, m), faded in over its first period."""

    def displacement(time: NDArray[np.float64]) -> NDArray[np.float64]:
        fade = np.clip(time * frequency, 0.0, 1.0)
        # A half cosine has no corner at either end, so the fade adds no impact of its own.
        return np.asarray(amplitude * sines(frequency * time) * 0.5 * (1.0 - cosines(0.5 * fade)))

    values = series_over_time(round(duration / step_time), step_time, displacement)
    return Excitation(Seat.BENCH, values, step_time, start)


def motorway(motorway: RandomRoad, gap: Gap, duration: float, start: float, step_time: float) -> Excitation:
    """Return the height of a road with a gap in it under the wheel; raises `ParameterError`."""
    for part in (motorway, gap):
        checked(part)

    def height(time: NDArray[np.float64]) -> NDArray[np.float64]:
        rough = random_road(time, motorway) if motorway.roughness > 0.0 else np.zeros_like(time)
        return rough + gap_in_road(time, gap)

    values = series_over_time(round(duration / step_time), step_time, height)
    return Excitation(Seat.VEHICLE, values, step_time, start)


def sweep(sweep: Sweep, duration: float, start: float, step_time: float) -> Excitation:
    """Return the height of a road that shakes the wheel with a rising frequency; raises `ParameterError`."""
    road = partial(sweep_road, sweep=checked(sweep))
    values = series_over_time(round(duration / step_time), step_time, road)
    return Excitation(Seat.VEHICLE, values, step_time, start)


def idle_force(
    amplitude: float, frequency: float, second_share: float, count: int, step_time: float
) -> StreamedSeries:
    """Return the force (n,) in N of an idling engine: a sine (N, Hz) and a share of twice its frequency."""

    def force(time: NDArray[np.float64]) -> NDArray[np.float64]:
        turns = frequency * time
        return np.asarray(amplitude * (sines(turns) + second_share * sines(2.0 * turns)))

    return series_over_time(count, step_time, force)


def tip_in_force(force: float, begin: float, rise: float, count: int, step_time: float) -> StreamedSeries:
    """Return a force (n,) in N that grows linearly from the time `begin` (s) on for `rise` (s) and stays."""

    def pushed(time: NDArray[np.float64]) -> NDArray[np.float64]:
        return np.asarray(force * np.clip((time - begin) / rise, 0.0, 1.0))

    return series_over_time(count, step_time, pushed)
