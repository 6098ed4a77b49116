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
    accelerated_engine_step,
    car_step,
    engine_modes,
    engine_stiffness,
    support_records,
)
from mount_sim.plant.vehicle import (
    ENGINE_STATE,
    Elastomer,
    Vehicle,
    engine_step,
    resting_vehicle,
    ride_without_friction,
)

DT = 5e-5
ENGINE, VEHICLE = RigidEngine(), Vehicle()
SPRING = Elastomer(1.6e5, 0.0, 0.0, 0.0)
PLACES = ((0.1, 0.45), (-0.05, -0.4), (-0.3, 0.1))


def support(x, y, elastomer=VEHICLE.elastomer, share=1.0):
    mass, stiffness, damping = VEHICLE.chassis_mass, VEHICLE.chassis_stiffness, VEHICLE.chassis_damping
    return Support(x, y, share * mass, share * stiffness, share * damping, elastomer)


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
        support_records(supports),
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


def test_accelerated_chassis_moves_several_mounts_as_one():
    acceleration = 2.0 * np.sin(2.0 * np.pi * 7.0 * DT * np.arange(20000))
    half = Elastomer(*(0.5 * k for k in VEHICLE.elastomer[:4]), *VEHICLE.elastomer[4:])
    engine = RigidEngine(mass=VEHICLE.engine_mass)
    supports, body, states = (
        support_records([support(0.0, 0.0, half)] * 2),
        np.zeros(1, BODY_STATE),
        np.zeros(2, SUPPORT_STATE),
    )
    alone = np.zeros(1, ENGINE_STATE)
    for value in acceleration:
        accelerated_engine_step(engine, supports, body[0], states, value, 0.0, np.zeros(2), DT)
        motion = engine_step(VEHICLE, alone[0], value, 0.0, 0.0, DT)
    assert abs(motion.displacement) > 1e-5
    assert states[1]['displacement'] == pytest.approx(motion.displacement, rel=1e-9)
    assert states[0]['velocity'] == pytest.approx(motion.velocity, rel=1e-9)


def test_natural_frequencies_are_those_of_the_eigenvalue_problem():
    engine = ENGINE._replace(rod=Elastomer(3e5, 0.0, 0.0, 0.0))
    stiffnesses = (1.6e5, 2.0e5, 0.9e5)
    supports = [
        support(x, y, SPRING._replace(static_stiffness=k))
        for (x, y), k in zip(PLACES, stiffnesses, strict=True)
    ]
    x, y, k = *np.array(PLACES).T, np.array(stiffnesses)
    rod = 3e5 * engine.rod_lever**2
    expected = np.array(
        [
            [k.sum(), (k * y).sum(), -(k * x).sum()],
            [(k * y).sum(), (k * y * y).sum(), -(k * x * y).sum()],
            [-(k * x).sum(), -(k * x * y).sum(), (k * x * x).sum() + rod],
        ]
    )
    np.testing.assert_allclose(engine_stiffness(engine, supports), expected, rtol=1e-12)
    inertia = np.diag([engine.mass, engine.roll_inertia, engine.pitch_inertia])
    squares = np.sort(np.linalg.eigvals(np.linalg.solve(inertia, expected)).real)
    hertz = np.sqrt(squares) / (2.0 * np.pi)
    np.testing.assert_allclose(engine_modes(engine, supports), hertz, rtol=1e-12)


def test_default_engine_has_heave_pitch_and_roll_between_7_and_11_hz():
    supports = [support(0.0, 0.45), support(0.0, -0.45)]
    heave = math.sqrt(2.0 * 1.6e5 / 160.0) / (2.0 * math.pi)
    roll = math.sqrt(2.0 * 1.6e5 * 0.45**2 / 15.6) / (2.0 * math.pi)
    pitch = math.sqrt(3e5 * 0.25**2 / 8.1) / (2.0 * math.pi)
    assert engine_modes(ENGINE, supports) == pytest.approx([heave, pitch, roll], rel=1e-12)


def test_a_motion_without_stiffness_has_no_frequency():
    free = ENGINE._replace(rod_lever=0.0)
    assert engine_modes(free, [support(0.0, 0.45), support(0.0, -0.45)])[0] == pytest.approx(0.0, abs=1e-6)


def test_symmetric_excitation_excites_no_roll():
    supports = [support(0.0, 0.45), support(0.0, -0.45), support(-0.3, 0.0)]
    moved, body, _ = car(rough_gap(), supports)
    assert body.roll_angle == 0.0
    assert body.roll_rate == 0.0
    assert abs(body.pitch_angle) > 1e-7
    np.testing.assert_array_equal(moved[:, 0], moved[:, 1])


def test_a_force_in_one_mount_rolls_the_engine_to_that_side():
    road = np.zeros(20000)
    supports = [support(0.0, 0.45), support(0.0, -0.45)]
    left = car(road, supports, beside=np.array([50.0, 0.0]))
    right = car(road, supports, beside=np.array([0.0, 50.0]))
    assert left[1].roll_angle < -1e-5  # the mount pulls its side down
    assert right[1].roll_angle == pytest.approx(-left[1].roll_angle, rel=1e-12)
    np.testing.assert_allclose(left[0][:, 0], right[0][:, 1], rtol=1e-12)
