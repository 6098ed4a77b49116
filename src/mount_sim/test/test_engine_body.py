"""The rigid engine on several mounts: its limits, natural frequencies, energy, symmetry and step."""

import math

import numpy as np
import pytest

from mount_models.arithmetic.compiled import compiled
from mount_models.arithmetic.record import record_bytes, record_dtype
from mount_sim.excitation.road import Gap, RandomRoad, gap_in_road, random_road
from mount_sim.plant.engine_body import (
    BODY_STATE,
    SUPPORT_STATE,
    RigidEngine,
    Support,
    car_step,
    engine_modes,
)
from mount_sim.plant.vehicle import (
    Elastomer,
    Vehicle,
    resting_vehicle,
    ride_without_friction,
)

DT = 5e-5
ENGINE, VEHICLE = RigidEngine(), Vehicle()
SPRING = Elastomer(1.6e5, 0.0, 0.0, 0.0)
PLACES = ((0.1, 0.45), (-0.05, -0.4), (-0.3, 0.1))


def support(x, y, elastomer=VEHICLE.elastomer, share=1.0):
    chassis = {name: share * getattr(VEHICLE, name) for name in VEHICLE._fields if name.startswith('chassis')}
    return Support(x, y, VEHICLE._replace(elastomer=elastomer, **chassis))


def record(parameters):
    return record_bytes(parameters).view(record_dtype(type(parameters)))


@compiled
def ride(vehicle, quarters, engine, supports, body, states, road, forces, beside, dt):
    """Return displacements (steps, n)."""
    displacements = np.zeros((len(road), len(supports)))
    for k in range(len(road)):
        car_step(vehicle[0], quarters, engine[0], supports, body[0], states, road[k], forces[k], beside, dt)
        for place in range(len(supports)):
            displacements[k, place] = states[place].displacement
    return displacements


def car(road, supports, engine=ENGINE, quarters=2.0, dt=DT, beside=None, forces=None):
    body, states = np.zeros(1, BODY_STATE), np.zeros(len(supports), SUPPORT_STATE)
    moved = ride(
        record(VEHICLE),
        quarters,
        record(engine),
        np.concatenate([record(each) for each in supports]),
        body,
        states,
        road,
        np.zeros(len(road)) if forces is None else forces,
        np.zeros(len(supports)) if beside is None else beside,
        dt,
    )
    return moved, body[0], states


def rough_gap(duration=3.0, dt=DT):
    time = np.arange(0.0, duration, dt)
    return random_road(time, RandomRoad()) + gap_in_road(time, Gap(0.020, position=33.0))


@pytest.mark.parametrize('count', [1, 2, 4])
def test_mounts_in_the_centre_of_gravity_are_one_mount_with_the_sum_of_their_stiffnesses(count):
    road = rough_gap()
    shared = Elastomer(*(k / count for k in VEHICLE.elastomer[:4]), *VEHICLE.elastomer[4:])
    supports = [support(0.0, 0.0, shared, 1.0 / count)] * count
    moved, *_ = car(road, supports, RigidEngine(mass=VEHICLE.engine_mass), quarters=1.0)
    alone, _ = ride_without_friction(VEHICLE, resting_vehicle(), road, np.zeros_like(road), DT)
    assert abs(alone).max() > 1e-3
    for place in range(count):
        np.testing.assert_allclose(moved[:, place], alone, rtol=0.0, atol=1e-12)


def test_default_engine_has_heave_pitch_and_roll_between_7_and_11_hz():
    supports = [support(0.0, 0.45), support(0.0, -0.45)]
    heave = math.sqrt(2.0 * 1.6e5 / 160.0) / (2.0 * math.pi)
    roll = math.sqrt(2.0 * 1.6e5 * 0.45**2 / 15.6) / (2.0 * math.pi)
    pitch = math.sqrt(3e5 * 0.25**2 / 8.1) / (2.0 * math.pi)
    assert engine_modes(ENGINE, supports) == pytest.approx([heave, pitch, roll], rel=1e-12)


def test_the_energy_of_an_engine_on_several_mounts_is_kept_where_nothing_damps():
    """Of motion between the times of the step: forces and energies then balance exactly."""
    vehicle, engine = VEHICLE._replace(suspension_damping=0.0), ENGINE._replace(rod=SPRING)
    supports = [Support(x, y, VEHICLE._replace(elastomer=SPRING, chassis_damping=0.0)) for x, y in PLACES]
    records, beside = np.concatenate([record(each) for each in supports]), np.zeros(len(supports))
    now, states = np.zeros(1, BODY_STATE), np.zeros(len(supports), SUPPORT_STATE)
    now[0]['engine_velocity'], now[0]['roll_rate'], now[0]['pitch_rate'] = 0.1, 0.3, -0.2
    masses = {
        'wheel_velocity': 2.0 * vehicle.wheel_mass,
        'body_velocity': 2.0 * vehicle.body_mass,
        'engine_velocity': engine.mass,
        'roll_rate': engine.roll_inertia,
        'pitch_rate': engine.pitch_inertia,
    }
    energies = []
    for _ in range(4000):
        was, states_before = now.copy()[0], states.copy()
        car_step(record(vehicle)[0], 2.0, record(engine)[0], records, now[0], states, 0.0, 0.0, beside, DT)
        twice = sum(mass * was[name] * now[0][name] for name, mass in masses.items())
        twice += 2.0 * vehicle.tyre_stiffness * was['wheel_height'] ** 2
        twice += 2.0 * vehicle.suspension_stiffness * (was['wheel_height'] - was['body_height']) ** 2
        twice += SPRING.static_stiffness * (engine.rod_lever * was['pitch_angle']) ** 2
        for old, new in zip(states_before, states, strict=True):
            twice += VEHICLE.chassis_mass * old['chassis_velocity'] * new['chassis_velocity']
            twice += VEHICLE.chassis_stiffness * (was['body_height'] - old['chassis_height']) ** 2
            twice += SPRING.static_stiffness * old['displacement'] ** 2
        energies.append(0.5 * twice)
    assert abs(now[0]['pitch_angle']) > 1e-6
    np.testing.assert_allclose(energies, energies[0], rtol=1e-9)
