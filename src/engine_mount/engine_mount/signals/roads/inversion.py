"""The road behind a recorded acceleration of the chassis: the vehicle model, inverted.

The chassis of a vehicle without friction in its mount answers a road linearly; its response over frequency is
divided out, within `BAND`. What lies outside, left and right, the other axle, and what the engine itself did
to the chassis cannot be told from one acceleration: all of it within the band is put down to the road.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from engine_mount.signals.roads.driving import BAND
from engine_mount.signals.roads.profile import FloatArray
from mount_models.arithmetic.averages import mean
from mount_sim.plant.vehicle import Vehicle

_EDGE = 0.2  # chosen: share of an edge frequency over which the band fades
WEAKEST = 1e-3
"""Chosen: where the chassis answers less than this share of its median answer in the band, the road is held
back by the ratio, for there the sensor's noise would be taken for a road."""

ComplexArray = NDArray[np.complex128]


class Kept(NamedTuple):
    """What comes of a recorded acceleration when the road that was found is driven: errors within the band.

    `error` is the rms of the difference over that of the recording, `share` the recording's rms in the band
    over all of it.
    """

    error: float
    share: float


def road_of(acceleration: FloatArray, step_time: float, vehicle: Vehicle) -> FloatArray:
    """Return the road (m) that gives the chassis of a vehicle without friction its `acceleration` (m/s^2).

    Both (n,), `step_time` s apart, as if repeated for ever; within `BAND`, faded at the edges.
    """
    spectrum = np.fft.rfft(acceleration - mean(acceleration))
    frequency = np.fft.rfftfreq(acceleration.size, step_time)
    fade = _fade(frequency)
    used = fade > 0.0
    road = np.zeros_like(spectrum)
    response = chassis_response(vehicle, frequency[used])
    road[used] = spectrum[used] * fade[used] * _inverse(response)
    return np.asarray(np.fft.irfft(road, acceleration.size), np.float64)


def in_band(values: FloatArray, step_time: float) -> FloatArray:
    """Return what `values` (n,) hold within `BAND`, faded at its edges as the road is."""
    frequency = np.fft.rfftfreq(values.size, step_time)
    return np.asarray(np.fft.irfft(np.fft.rfft(values) * _fade(frequency), values.size), np.float64)


def kept(recorded: FloatArray, driven: FloatArray, step_time: float) -> Kept:
    """Return how far a driven acceleration (n,) is from the recorded one (n,), in the band."""
    wanted, got = in_band(recorded - mean(recorded), step_time), in_band(driven - mean(driven), step_time)
    size = float(np.sqrt(np.mean(wanted**2)))
    whole = float(np.std(recorded))
    return Kept(float(np.sqrt(np.mean((got - wanted) ** 2))) / size, size / whole)


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


def _fade(frequency: FloatArray) -> FloatArray:
    low, high = BAND
    fade = np.clip((frequency / low - 1.0) / _EDGE + 1.0, 0.0, 1.0)
    return np.asarray(fade * np.clip((1.0 - frequency / high) / _EDGE + 1.0, 0.0, 1.0))


def _inverse(response: ComplexArray) -> ComplexArray:
    """Return 1 / response, held back where the response is weak (Tikhonov)."""
    floor = WEAKEST * float(np.median(np.abs(response)))
    return np.asarray(np.conj(response) / (np.abs(response) ** 2 + floor**2))
