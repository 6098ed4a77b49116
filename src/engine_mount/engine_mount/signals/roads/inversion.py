"""The road behind a recorded acceleration of the chassis: the vehicle model, inverted.

The chassis of a vehicle without friction in its mount answers a road linearly; its response over frequency is
divided out, within `BAND`. What lies outside, left and right, the other axle, and what the engine itself did
to the chassis cannot be told from one acceleration: all of it within the band is put down to the road.
"""

from pathlib import Path
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from engine_mount.signals.even_grid import evenly_spaced
from engine_mount.signals.excitation import LONGEST_GAP, LOWEST_RATE, acceleration_at
from engine_mount.signals.roads.driving import BAND, STEP_TIME, doubts_of_speed
from engine_mount.signals.roads.table import EFFECTIVE
from engine_mount.signals.signal import FloatArray, Signal
from mount_models.arithmetic.sums import mean
from mount_sim.plant.vehicle import Vehicle

_PAUSE = 4.0  # s, chosen: four periods of the body
_FORMAT = '%.7f'  # of distance and height in m

UNKNOWN = (
    f'waves below {BAND[0]:g} Hz and above {BAND[1]:g} Hz are not in it',
    'left and right, and the other axle, are one road under one wheel',
    'what engine, gears and brakes did to the chassis within the band is taken for road',
    'the chassis was shaken with the mount that was in that car: its feedback is in the road',
    'vehicle and elastomer are those of the model, not of the recorded car',
)
"""What one recorded acceleration cannot tell, for people."""


ComplexArray = NDArray[np.complex128]

_EDGE = 0.2  # chosen: share of an edge frequency over which the band fades
WEAKEST = 1e-3
"""Chosen: where the chassis answers less than this share of its median answer in the band, the road is held
back by the ratio, for there the sensor's noise would be taken for a road."""


class InvertedRoad(NamedTuple):
    """Places and heights (n,) in m, and sentences."""

    distance: FloatArray
    height: FloatArray
    notes: tuple[str, ...]

    def write(self, file: Path, source: str) -> Path:
        """Write the profile as CSV, in front what it cannot know; `source` says what it is made of."""
        lines = [f'# road behind {source}, by inverting the vehicle model; effective: behind the tyre']
        lines += [f'# {sentence}' for sentence in (*self.notes, *UNKNOWN)]
        lines.append(f'distance [m],{EFFECTIVE} [m]')
        rows = np.column_stack([self.distance, self.height])
        np.savetxt(file, rows, _FORMAT, ',', header='\n'.join(lines), comments='', encoding='utf-8')
        return file


def inverted(signal: Signal, speed: float) -> InvertedRoad:
    """Return the road behind an acceleration of the chassis in m/s^2, upwards, recorded at `speed` (m/s).

    Raises `SignalError`.
    """
    even = evenly_spaced(signal, LONGEST_GAP, LOWEST_RATE)
    acceleration = acceleration_at(even, STEP_TIME)[:]
    # the road is as if repeated for ever: a pause keeps its end from its beginning
    pause = np.zeros(round(_PAUSE / STEP_TIME))
    height = _road_of(np.concatenate([acceleration, pause]))[: acceleration.size]
    notes = [*even.notes, *doubts_of_speed(speed)]
    reached = 0.4 * even.rate
    if reached < BAND[1]:
        notes.append(f'recorded at {even.rate:.4g} Hz: above {reached:.3g} Hz nothing is known')
    return InvertedRoad(speed * STEP_TIME * np.arange(height.size), height, tuple(notes))


def _road_of(acceleration: FloatArray) -> FloatArray:
    """Return the road (m) that gives the chassis of a vehicle without friction its `acceleration` (m/s^2).

    Both (n,), `STEP_TIME` apart, as if repeated for ever; within `BAND`, faded at the edges.
    """
    spectrum = np.fft.rfft(acceleration - mean(acceleration))
    frequency = np.fft.rfftfreq(acceleration.size, STEP_TIME)
    low, high = BAND
    fade = np.clip((frequency / low - 1.0) / _EDGE + 1.0, 0.0, 1.0)
    fade = fade * np.clip((1.0 - frequency / high) / _EDGE + 1.0, 0.0, 1.0)
    used = fade > 0.0
    response = chassis_response(Vehicle(), frequency[used])
    # 1 / response, held back where the response is weak (Tikhonov)
    floor = WEAKEST * float(np.median(np.abs(response)))
    inverse = np.conj(response) / (np.abs(response) ** 2 + floor**2)
    road = np.zeros_like(spectrum)
    road[used] = spectrum[used] * fade[used] * inverse
    return np.asarray(np.fft.irfft(road, acceleration.size), np.float64)


def chassis_response(vehicle: Vehicle, frequency: FloatArray) -> ComplexArray:
    """Return chassis acceleration over height of the road (1/s^2), complex, (n,), at frequencies in Hz."""
    s = 2j * np.pi * frequency
    elastomer = vehicle.elastomer
    mount = elastomer.static_stiffness + sum(
        stiffness * s / (s + 2.0 * np.pi * corner)
        for stiffness, corner in (
            (elastomer.slow_stiffness, elastomer.slow_corner),
            (elastomer.middle_stiffness, elastomer.middle_corner),
            (elastomer.fast_stiffness, elastomer.fast_corner),
        )
    )
    suspension = vehicle.suspension_stiffness + vehicle.suspension_damping * s
    carrier = vehicle.chassis_stiffness + vehicle.chassis_damping * s
    # seen from below: what stands on a spring has a dynamic stiffness, in series with that spring
    engine = _stands_on(mount, vehicle.engine_mass * s * s)
    chassis = vehicle.chassis_mass * s * s + engine
    body = vehicle.body_mass * s * s + _stands_on(carrier, chassis)
    wheel = vehicle.wheel_mass * s * s + _stands_on(suspension, body)
    tyre = vehicle.tyre_stiffness
    height = tyre / (tyre + wheel) * suspension / (suspension + body) * carrier / (carrier + chassis)
    return np.asarray(s * s * height)


def _stands_on(spring: ComplexArray, load: ComplexArray) -> ComplexArray:
    return spring * load / (spring + load)
