"""The quarter vehicle and the engine alone: modes, energy, and the undamped mount on sweep and gap."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from stiffness import dynamic_stiffness, modes

from mount_models.arithmetic.compiled import compiled
from mount_models.friction.coefficient import FrictionCoefficients
from mount_models.friction.contact import FrictionContact
from mount_models.quantity import checked, quantities
from mount_sim.excitation.road import Gap, RandomRoad, gap_in_road, random_road, sweep_road
from mount_sim.excitation.scenario import SweepScenario
from mount_sim.plant.friction import full_step
from mount_sim.plant.vehicle import (
    ENGINE_STATE,
    VEHICLE_STATE,
    Engine,
    Vehicle,
    engine_step,
    resting_vehicle,
    ride_without_friction,
    vehicle_step,
)

VEHICLE = Vehicle()
ENGINE = Engine()
DT = 5e-5


def undamped_ride(road_height, dt=DT):
    return ride_without_friction(VEHICLE, resting_vehicle(), road_height, np.zeros_like(road_height), dt)


def test_modes_are_those_of_body_engine_wheel_and_chassis():
    assert modes(VEHICLE) == pytest.approx([1.14, 7.39, 11.87, 35.8], abs=0.05)
    assert modes(VEHICLE)[:3] == pytest.approx([1.14, 7.39, 11.87], abs=5.1e-3)


def test_stiffer_mount_raises_the_engine_mode():
    stiffer = modes(VEHICLE, dynamic_stiffness(VEHICLE.elastomer, 8.0).real)
    assert 7.6 < stiffer[1] < 8.0


@pytest.mark.parametrize(('velocity_amplitude', 'peak_mm'), [(0.04, 1.16), (0.12, 3.47), (0.20, 5.79)])
def test_undamped_sweep_has_the_known_resonance_peak(velocity_amplitude, peak_mm):
    time = np.arange(0.0, 15.0, DT)
    displacement, _ = undamped_ride(sweep_road(time, SweepScenario(velocity_amplitude=velocity_amplitude)))
    peak = int(np.argmax(abs(displacement)))
    assert abs(displacement[peak]) * 1e3 == pytest.approx(peak_mm, rel=2e-3)
    assert 1.0 + time[peak] == pytest.approx(8.4, abs=0.05)


@pytest.mark.parametrize(('depth', 'peak_mm'), [(0.030, 3.58), (0.020, 2.40), (0.010, 1.22)])
def test_undamped_gap_has_the_known_peak_give_or_take_the_background_road(depth, peak_mm):
    time = np.arange(0.0, 4.0, DT)
    gap = gap_in_road(time, Gap(depth=depth, position=66.0))
    alone, _ = undamped_ride(gap)
    assert abs(alone).max() * 1e3 == pytest.approx(peak_mm, abs=0.05)
    # before any damping acts the peak is that of the gap plus what the road happens to add
    both, _ = undamped_ride(gap + random_road(time, RandomRoad()))
    assert abs(both).max() * 1e3 == pytest.approx(peak_mm, abs=0.2)


def test_half_the_step_gives_the_same_sweep():
    coarse, fine = (
        undamped_ride(sweep_road(np.arange(0.0, 9.0, dt), SweepScenario()), dt)[0] for dt in (DT, DT / 2)
    )
    assert abs(coarse).max() == pytest.approx(abs(fine).max(), rel=1e-3)


@compiled
def coast(vehicle, state, dt, count):
    for _ in range(count):
        vehicle_step(vehicle, state[0], 0.0, 0.0, 0.0, dt)


heights = st.floats(-5e-3, 5e-3)
speeds = st.floats(-0.3, 0.3)


@given(start=st.tuples(*([heights, speeds] * 4)))
@settings(deadline=None, derandomize=True, max_examples=60)
def test_energy_never_grows_without_road_and_friction(start):
    state = resting_vehicle()
    state[0] = (*start, 0.0, 0.0, 0.0)
    # semi-implicit Euler conserves not the energy but one that differs by about dt x frequency x energy
    first = before = mechanical_energy(VEHICLE, state[0])
    for _ in range(40):
        coast(VEHICLE, state, DT, 100)
        now = mechanical_energy(VEHICLE, state[0])
        assert now <= before + 3e-3 * first + 1e-15
        before = now
    assert now <= 0.9 * first


def test_energy_is_conserved_when_nothing_damps():
    elastomer = VEHICLE.elastomer._replace(slow_stiffness=0.0, middle_stiffness=0.0, fast_stiffness=0.0)
    ideal = VEHICLE._replace(chassis_damping=0.0, suspension_damping=0.0, elastomer=elastomer)
    state = resting_vehicle()
    state[0]['engine_height'] = 3e-3
    state[0]['wheel_velocity'] = 0.1
    before = mechanical_energy(ideal, state[0])
    coast(ideal, state, DT, 100_000)
    assert mechanical_energy(ideal, state[0]) == pytest.approx(before, rel=5e-3)


@compiled
def coast_with_pads(vehicle, contact, coefs, normal_force, state, contact_state, dt, count):
    force = 0.0
    slider, deflection = contact_state[0], contact_state[1]
    for _ in range(count):
        displacement = state[0].engine_height - state[0].chassis_height
        force, slider, deflection, _ = full_step(
            contact, coefs, slider, deflection, displacement, normal_force, dt
        )
        vehicle_step(vehicle, state[0], 0.0, 0.0, force, dt)
    contact_state[0], contact_state[1] = slider, deflection
    return 0.5 * force**2 / contact.contact_stiffness + 0.5 * contact.tangential_stiffness * deflection**2


@pytest.mark.parametrize('normal_force', [0.0, 5.0, 80.0, 300.0])
def test_pressed_pads_only_take_energy_from_the_vehicle(normal_force):
    state, contact_state = resting_vehicle(), np.zeros(2)
    state[0]['engine_height'], contact_state[0] = 3e-3, 3e-3
    first = before = mechanical_energy(VEHICLE, state[0])
    for _ in range(200):
        held = coast_with_pads(
            VEHICLE, FrictionContact(), FrictionCoefficients(), normal_force, state, contact_state, DT, 50
        )
        now = mechanical_energy(VEHICLE, state[0]) + held
        assert now <= before + 3e-3 * first
        before = now
    assert now <= 0.6 * first


def test_static_engine_force_and_road_height_reach_their_equilibrium():
    time = np.arange(0.0, 20.0, DT)
    state = resting_vehicle()
    displacement, acceleration = ride_without_friction(
        VEHICLE, state, np.full(time.size, 0.01), np.full(time.size, 100.0), DT
    )
    assert displacement[-1] == pytest.approx(100.0 / VEHICLE.elastomer.static_stiffness, rel=1e-4)
    assert state[0]['wheel_height'] == pytest.approx(0.01 + 100.0 / VEHICLE.tyre_stiffness, rel=1e-4)
    assert acceleration[-1] == pytest.approx(0.0, abs=1e-4)


def test_friction_force_pushes_chassis_and_engine_apart_in_opposite_directions():
    state = resting_vehicle()
    motion = vehicle_step(VEHICLE, state[0], 0.0, 0.0, 40.0, DT)
    assert motion.mount_force == 40.0
    assert motion.chassis_acceleration == pytest.approx(40.0 / VEHICLE.chassis_mass)
    assert state[0]['engine_velocity'] == pytest.approx(-40.0 / VEHICLE.engine_mass * DT)
    assert motion.velocity == pytest.approx(state[0]['engine_velocity'] - state[0]['chassis_velocity'])
    assert motion.displacement < 0.0


def test_stretched_mount_pulls_the_chassis_up():
    state = resting_vehicle()
    state[0]['engine_height'] = 1e-3
    motion = vehicle_step(VEHICLE, state[0], 0.0, 0.0, 0.0, DT)
    assert motion.mount_force == pytest.approx(160.0)
    assert motion.chassis_acceleration > 0.0


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
    assert engine_ride(ENGINE, np.zeros(1, ENGINE_STATE), resting_vehicle(), VEHICLE, road, DT) < 1e-11


def test_engine_force_on_a_still_chassis_stretches_the_mount():
    state = np.zeros(1, ENGINE_STATE)
    motion = engine_step(ENGINE, state[0], 0.0, 80.0, 0.0, DT)
    assert motion.velocity == pytest.approx(DT)
    assert engine_step(ENGINE, state[0], 2.0, 0.0, 0.0, DT).velocity < motion.velocity


def test_states_are_named_records_at_rest():
    assert resting_vehicle().dtype == VEHICLE_STATE
    assert np.zeros(1, ENGINE_STATE).dtype == ENGINE_STATE
    assert mechanical_energy(VEHICLE, resting_vehicle()[0]) == 0.0


@pytest.mark.parametrize('parameters', [VEHICLE, ENGINE])
def test_every_parameter_has_unit_meaning_and_a_range_that_holds_its_default(parameters):
    assert set(quantities(parameters)) | {'elastomer'} == set(parameters._fields)
    assert checked(parameters) == parameters


def mechanical_energy(vehicle: Vehicle, state, road_height: float = 0.0) -> float:
    """Return the energy (J) of a record of `VEHICLE_STATE`: motion, springs, springs of the branches."""
    elastomer = vehicle.elastomer
    motion = (
        vehicle.wheel_mass * state['wheel_velocity'] ** 2
        + vehicle.body_mass * state['body_velocity'] ** 2
        + vehicle.chassis_mass * state['chassis_velocity'] ** 2
        + vehicle.engine_mass * state['engine_velocity'] ** 2
    )
    springs = (
        vehicle.tyre_stiffness * (road_height - state['wheel_height']) ** 2
        + vehicle.suspension_stiffness * (state['wheel_height'] - state['body_height']) ** 2
        + vehicle.chassis_stiffness * (state['body_height'] - state['chassis_height']) ** 2
        + elastomer.static_stiffness * (state['engine_height'] - state['chassis_height']) ** 2
    )
    branches = 0.0
    for force, stiffness in (
        (state['slow_force'], elastomer.slow_stiffness),
        (state['middle_force'], elastomer.middle_stiffness),
        (state['fast_force'], elastomer.fast_stiffness),
    ):
        branches += force**2 / stiffness if stiffness > 0.0 else 0.0
    return float(0.5 * (motion + springs + branches))
