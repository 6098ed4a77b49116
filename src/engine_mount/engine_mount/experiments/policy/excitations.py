"""What no scenario holds: the road behind a recorded acceleration."""

import functools

from engine_mount.reports.drive.signals import FloatArray
from engine_mount.signals.excitation import acceleration_at, recorded_signal
from engine_mount.signals.roads.inversion import road_of
from mount_models.arithmetic.series import series_of
from mount_sim.excitation.excitation import Excitation, Seat, idle_force
from mount_sim.excitation.scenario import STEP_TIME, IdleForce, RecordedScenario
from mount_sim.plant.vehicle import Vehicle


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
