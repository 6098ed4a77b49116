"""The quarter vehicle and the engine alone: modes, energy, and the undamped mount on sweep and gap."""

import numpy as np
import pytest

from mount_models.arithmetic.compiled import compiled
from mount_sim.excitation.road import sweep_road
from mount_sim.excitation.scenario import SweepScenario
from mount_sim.plant.vehicle import (
    ENGINE_STATE,
    Vehicle,
    engine_step,
    resting_vehicle,
    ride_without_friction,
    vehicle_step,
)

VEHICLE = Vehicle()
DT = 5e-5


def undamped_ride(road_height, dt=DT):
    return ride_without_friction(VEHICLE, resting_vehicle(), road_height, np.zeros_like(road_height), dt)


@pytest.mark.parametrize(('velocity_amplitude', 'peak_mm'), [(0.04, 1.16), (0.12, 3.47), (0.20, 5.79)])
def test_undamped_sweep_has_the_known_resonance_peak(velocity_amplitude, peak_mm):
    time = np.arange(0.0, 15.0, DT)
    displacement, _ = undamped_ride(sweep_road(time, SweepScenario(velocity_amplitude=velocity_amplitude)))
    peak = int(np.argmax(abs(displacement)))
    assert abs(displacement[peak]) * 1e3 == pytest.approx(peak_mm, rel=2e-3)
    assert 1.0 + time[peak] == pytest.approx(8.4, abs=0.05)


def test_static_engine_force_and_road_height_reach_their_equilibrium():
    time = np.arange(0.0, 20.0, DT)
    state = resting_vehicle()
    displacement, acceleration = ride_without_friction(
        VEHICLE, state, np.full(time.size, 0.01), np.full(time.size, 100.0), DT
    )
    assert displacement[-1] == pytest.approx(100.0 / VEHICLE.elastomer.static_stiffness, rel=1e-4)
    assert state[0]['wheel_height'] == pytest.approx(0.01 + 100.0 / VEHICLE.tyre_stiffness, rel=1e-4)
    assert acceleration[-1] == pytest.approx(0.0, abs=1e-4)


@compiled
def engine_ride(engine, state, vehicle_state, vehicle, road_height, dt):
    """Return the largest difference of x between a vehicle and an engine alone on that vehicle's chassis."""
    largest = 0.0
    for k in range(road_height.size):
        motion = vehicle_step(vehicle, vehicle_state[0], road_height[k], 25.0, 3.0, dt)
        alone = engine_step(engine, state[0], motion.chassis_acceleration, 25.0, 3.0, dt)
        largest = max(largest, abs(alone.displacement - motion.displacement))
    return largest


def test_engine_on_the_vehicles_chassis_acceleration_moves_like_the_vehicles_engine():
    road = sweep_road(np.arange(0.0, 8.0, DT), SweepScenario())
    assert engine_ride(VEHICLE, np.zeros(1, ENGINE_STATE), resting_vehicle(), VEHICLE, road, DT) < 1e-11
