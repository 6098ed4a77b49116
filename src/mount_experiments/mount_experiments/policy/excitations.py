"""What no scenario holds: the road behind a recorded acceleration."""

import functools

import numpy as np

from mount_models.arithmetic.averages import mean
from mount_models.arithmetic.series import series_of
from mount_models.vehicle import Vehicle
from mount_report.drive.signals import FloatArray
from mount_sim.excitation.excitation import Excitation, Seat, idle_force
from mount_sim.excitation.recorded import acceleration_at
from mount_sim.excitation.scenario import (
    STEP_TIME,
    IdleForce,
    RecordedScenario,
    recorded_signal,
)

LOWEST, HIGHEST = 0.9, 50.0  # Hz: no more is inverted; below, the sensor drifts, above, it has nothing
_EDGE = 0.2  # chosen: share of an edge frequency over which the band fades


def road_of(acceleration: FloatArray, step_time: float, vehicle: Vehicle) -> FloatArray:
    """Return the road (m) that gives the chassis of a vehicle without friction its `acceleration` (m/s^2).

    Both (n,), `step_time` s apart, as if repeated for ever; within `LOWEST` to `HIGHEST`, faded at the edges.
    """
    spectrum = np.fft.rfft(acceleration - mean(acceleration))
    frequency = np.fft.rfftfreq(acceleration.size, step_time)
    fade = np.clip((frequency / LOWEST - 1.0) / _EDGE + 1.0, 0.0, 1.0)
    fade *= np.clip((1.0 - frequency / HIGHEST) / _EDGE + 1.0, 0.0, 1.0)
    used = fade > 0.0
    road = np.zeros_like(spectrum)
    road[used] = spectrum[used] * fade[used] / chassis_response(vehicle, frequency[used])
    return np.asarray(np.fft.irfft(road, acceleration.size), np.float64)


def chassis_response(vehicle: Vehicle, frequency: FloatArray) -> FloatArray:
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


def _stands_on(spring: FloatArray, load: FloatArray) -> FloatArray:
    return spring * load / (spring + load)


@functools.cache
def recorded_road(recorded: RecordedScenario) -> FloatArray:
    """Return the road (m) behind a recorded acceleration, at the step of the plant; raises `SignalError`."""
    acceleration = acceleration_at(recorded_signal(recorded), recorded.scale, STEP_TIME)
    return road_of(acceleration[:], STEP_TIME, Vehicle())


def on_recorded_road(recorded: RecordedScenario, idle: IdleForce, start: float) -> Excitation:
    """Return the drive over the road behind a recording, with an idling engine."""
    road = recorded_road(recorded)
    forces = idle_force(idle.amplitude, idle.frequency, idle.second_share, road.size, STEP_TIME)
    return Excitation(Seat.VEHICLE, series_of(road), STEP_TIME, start, forces)
