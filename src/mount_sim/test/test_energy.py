"""What road and engine put into the vehicle is stored or dissipated; pads and fluid never return energy."""

import numpy as np
import pytest
from energy import book_step, imbalance, new_account

from mount_models.arithmetic.compiled import compiled
from mount_models.arithmetic.record import record_type
from mount_models.friction.coefficient import FrictionCoefficients
from mount_models.friction.contact import FrictionContact
from mount_sim.excitation.road import Gap, RandomRoad, gap_in_road, random_road, sweep_road
from mount_sim.excitation.scenario import SweepScenario
from mount_sim.plant.friction import full_step
from mount_sim.plant.hydromount import HYDROMOUNT_STATE, Hydromount, hydromount_force, hydromount_step
from mount_sim.plant.vehicle import VEHICLE_STATE, Vehicle, vehicle_step

VEHICLE = Vehicle()
HYDROMOUNT = Hydromount()
CONTACT = FrictionContact()
COEFFICIENTS = FrictionCoefficients()
DT = 5e-5
STATE = record_type(
    [
        ('vehicle', VEHICLE_STATE),
        ('hydromount', HYDROMOUNT_STATE),
        *((name, 'f8') for name in ('friction_force', 'slider_position', 'deflection')),
    ]
)
MOUNT_LOSSES = {
    'pads': ('elastomer_loss', 'sliding_loss', 'creep_loss'),
    'fluid': ('elastomer_loss', 'track_loss', 'decoupler_loss'),
}


@compiled
def ride_on_pads(vehicle, hydromount, contact, coefs, road, engine_force, normal_force, states, account, dt):
    """Advance states[0] along the road; states[1] is the state before each step."""
    for k in range(road.size):
        states[1] = states[0]
        now = states[0]
        displacement = now.vehicle.engine_height - now.vehicle.chassis_height
        force, now.slider_position, now.deflection, _ = full_step(
            contact, coefs, now.slider_position, now.deflection, displacement, normal_force[k], dt
        )
        now.friction_force = force
        vehicle_step(vehicle, now.vehicle, road[k], engine_force[k], force, dt)
        book_step(account, vehicle, hydromount, contact, states[1], now, road[k], engine_force[k], dt)


@compiled
def ride_on_fluid(vehicle, hydromount, contact, road, engine_force, states, account, dt):
    for k in range(road.size):
        states[1] = states[0]
        now = states[0]
        before = now.vehicle.engine_height - now.vehicle.chassis_height
        force = hydromount_force(hydromount, now.hydromount)
        motion = vehicle_step(vehicle, now.vehicle, road[k], engine_force[k], force, dt)
        hydromount_step(hydromount, now.hydromount, motion.displacement - before, dt)
        book_step(account, vehicle, hydromount, contact, states[1], now, road[k], engine_force[k], dt)


def motorway(dt):
    times = np.arange(0.0, 4.0, dt)
    return times, random_road(times, RandomRoad()) + gap_in_road(times, Gap(0.020, position=50.0))


def sweep(dt):
    times = np.arange(0.0, 14.0, dt)
    return times, sweep_road(times, SweepScenario())


def account_of_ride(mount, road, idle=0.0, dt=DT):
    """The books of a ride; pads are pressed and released all the time, in no relation to the motion."""
    times, height = road(dt)
    engine_force = idle * np.sin(2.0 * np.pi * 26.7 * times)
    states, account = np.zeros(2, STATE), new_account()
    if mount == 'pads':
        normal_force = np.maximum(120.0 * np.sin(2.0 * np.pi * 3.3 * times) + 40.0, 0.0)
        ride_on_pads(
            VEHICLE,
            HYDROMOUNT,
            CONTACT,
            COEFFICIENTS,
            height,
            engine_force,
            normal_force,
            states,
            account[0],
            dt,
        )
    else:
        ride_on_fluid(VEHICLE, HYDROMOUNT, CONTACT, height, engine_force, states, account[0], dt)
    return account[0]


@pytest.mark.parametrize('idle', [0.0, 200.0])
@pytest.mark.parametrize('road', [motorway, sweep])
@pytest.mark.parametrize('mount', ['pads', 'fluid'])
def test_what_is_put_in_is_stored_or_dissipated_to_a_thousandth_of_what_the_mount_takes(mount, road, idle):
    """The mount takes a fiftieth of what the suspension does; a thousandth of the whole would hide it."""
    account = account_of_ride(mount, road, idle)
    assert account['road_work'] > 10.0
    taken = sum(account[name] for name in MOUNT_LOSSES[mount])
    assert 0.0 < taken < 0.1 * account['road_work']
    assert abs(imbalance(account)) <= 1e-3 * taken
