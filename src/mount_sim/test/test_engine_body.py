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
    Engine,
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


def test_two_quarters_carry_two_mounts_as_one_carries_one():
    road = rough_gap()
    moved, *_ = car(road, [support(0.0, 0.45), support(0.0, -0.45)])
    alone, _ = ride_without_friction(VEHICLE, resting_vehicle(), road, np.zeros_like(road), DT)
    np.testing.assert_allclose(moved[:, 0], alone, rtol=0.0, atol=1e-12)


def test_accelerated_chassis_moves_several_mounts_as_one():
    acceleration = 2.0 * np.sin(2.0 * np.pi * 7.0 * DT * np.arange(20000))
    half = Elastomer(*(0.5 * k for k in VEHICLE.elastomer[:4]), *VEHICLE.elastomer[4:])
    engine = RigidEngine(mass=VEHICLE.engine_mass)
    supports, body, states = (
        support_records([support(0.0, 0.0, half)] * 2),
        np.zeros(1, BODY_STATE),
        np.zeros(2, SUPPORT_STATE),
    )
    alone, law = np.zeros(1, ENGINE_STATE), Engine(VEHICLE.engine_mass, VEHICLE.elastomer)
    for value in acceleration:
        accelerated_engine_step(engine, supports, body[0], states, value, 0.0, np.zeros(2), DT)
        motion = engine_step(law, alone[0], value, 0.0, 0.0, DT)
    assert abs(motion.displacement) > 1e-5
    assert states[1]['displacement'] == pytest.approx(motion.displacement, rel=1e-9)
    assert states[0]['velocity'] == pytest.approx(motion.velocity, rel=1e-9)


def step_frequencies(engine, supports):
    """Return the frequencies (Hz) of the free engine on a chassis at rest, from the matrix of its step."""
    moving = [f'{name}_{what}' for name in ('roll', 'pitch') for what in ('angle', 'rate')]
    moving += ['engine_height', 'engine_velocity']
    records, columns = support_records(supports), []
    for name in moving:
        body, states = np.zeros(1, BODY_STATE), np.zeros(len(supports), SUPPORT_STATE)
        body[name] = 1e-3
        levers = {'engine_height': (1, 0, 0), 'roll_angle': (0, 1, 0), 'pitch_angle': (0, 0, 1)}.get(name)
        if levers:
            for place, state in enumerate(states):
                heave, roll, pitch = levers
                state['displacement'] = 1e-3 * (heave + supports[place].y * roll - supports[place].x * pitch)
        accelerated_engine_step(engine, records, body[0], states, 0.0, 0.0, np.zeros(len(supports)), DT)
        columns.append([body[other][0] / 1e-3 for other in moving])
    turns = np.sort(abs(np.angle(np.linalg.eigvals(np.array(columns).T))))[::2]
    return 2.0 / DT * np.sin(0.5 * turns) / (2.0 * np.pi)  # the step's own dispersion taken out


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
    np.testing.assert_allclose(step_frequencies(engine, supports), hertz, rtol=1e-6)


def test_default_engine_has_heave_pitch_and_roll_between_7_and_11_hz():
    supports = [support(0.0, 0.45), support(0.0, -0.45)]
    heave = math.sqrt(2.0 * 1.6e5 / 160.0) / (2.0 * math.pi)
    roll = math.sqrt(2.0 * 1.6e5 * 0.45**2 / 15.6) / (2.0 * math.pi)
    pitch = math.sqrt(3e5 * 0.25**2 / 8.1) / (2.0 * math.pi)
    assert engine_modes(ENGINE, supports) == pytest.approx([heave, pitch, roll], rel=1e-12)


def test_a_motion_without_stiffness_has_no_frequency():
    free = ENGINE._replace(rod_lever=0.0)
    assert engine_modes(free, [support(0.0, 0.45), support(0.0, -0.45)])[0] == pytest.approx(0.0, abs=1e-6)


def energy_and_losses(supports, road, forces):
    """Return (work put in, energy stored, energy lost) at each step, J, as in `energy.py`."""
    vehicle, engine, records = record(VEHICLE)[0], record(ENGINE)[0], support_records(supports)
    body, states = np.zeros(1, BODY_STATE), np.zeros(len(supports), SUPPORT_STATE)
    works, stored, lost = [0.0], [], [0.0]
    last = None
    for height, force in zip(road, forces, strict=True):
        before, states_before = body.copy()[0], states.copy()
        car_step(vehicle, 2.0, engine, records, body[0], states, height, force, np.zeros(len(supports)), DT)
        after = body[0]
        tyre = VEHICLE.tyre_stiffness * (height - before.wheel_height)
        point = (
            before.engine_height + ENGINE.force_y * before.roll_angle - ENGINE.force_x * before.pitch_angle
        )
        now = (2.0 * tyre, height, force, point)
        if last is not None:
            works.append(
                works[-1]
                + 0.5 * (now[0] + last[0]) * (now[1] - last[1])
                + 0.5 * (now[2] + last[2]) * (now[3] - last[3])
            )
            lost.append(lost[-1] + loss(supports, before, after, states_before, states))
        last = now
        stored.append(energy(supports, height, before, after, states_before, states))
    return np.array(works), np.array(stored), np.array(lost)


def energy(supports, height, before, after, states_before, states):
    masses = {
        'wheel_velocity': 2.0 * VEHICLE.wheel_mass,
        'body_velocity': 2.0 * VEHICLE.body_mass,
        'engine_velocity': ENGINE.mass,
        'roll_rate': ENGINE.roll_inertia,
        'pitch_rate': ENGINE.pitch_inertia,
    }
    total = sum(mass * before[name] * after[name] for name, mass in masses.items())
    total += 2.0 * VEHICLE.tyre_stiffness * (height - before.wheel_height) ** 2
    total += 2.0 * VEHICLE.suspension_stiffness * (before.wheel_height - before.body_height) ** 2
    total += spring_energy(ENGINE.rod, ENGINE.rod_lever * before.pitch_angle, before)
    for each, old, new in zip(supports, states_before, states, strict=True):
        total += each.chassis_mass * old['chassis_velocity'] * new['chassis_velocity']
        total += each.chassis_stiffness * (before.body_height - old['chassis_height']) ** 2
        total += spring_energy(each.elastomer, old['displacement'], old)
    return 0.5 * total


def branches_of(elastomer, state):
    return [
        (
            state[f'{name}_force'] ** 2 / getattr(elastomer, f'{name}_stiffness'),
            getattr(elastomer, f'{name}_corner'),
        )
        for name in ('slow', 'middle', 'fast')
    ]


def spring_energy(elastomer, displacement, state):
    return elastomer.static_stiffness * displacement**2 + sum(e for e, _ in branches_of(elastomer, state))


def loss(supports, before, after, states_before, states):
    def mean(name):
        return 0.5 * (before[name] + after[name])

    power = 2.0 * VEHICLE.suspension_damping * (mean('wheel_velocity') - mean('body_velocity')) ** 2
    elastomers = [(ENGINE.rod, before)]
    for each, old, new in zip(supports, states_before, states, strict=True):
        chassis = 0.5 * (old['chassis_velocity'] + new['chassis_velocity'])
        power += each.chassis_damping * (mean('body_velocity') - chassis) ** 2
        elastomers.append((each.elastomer, old))
    for elastomer, state in elastomers:
        power += sum(2.0 * math.pi * corner * energy for energy, corner in branches_of(elastomer, state))
    return DT * power


def test_work_put_in_is_stored_or_lost():
    supports = [support(x, y) for x, y in PLACES]
    road = rough_gap(1.3)[19000:]
    road = road - road[0]
    forces = 200.0 * np.sin(2.0 * np.pi * 26.7 * DT * np.arange(len(road)))
    works, stored, lost = energy_and_losses(supports, road, forces)
    assert works[-1] > 1.0
    assert lost[-1] > 0.2 * works[-1]
    imbalance = works - lost - (stored - stored[0])
    assert abs(imbalance).max() < 2e-3 * works.max()


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


def test_error_of_the_step_falls_with_its_length():
    supports = [support(x, y) for x, y in PLACES]

    def peak(dt):
        moved, *_ = car(rough_gap(2.0, dt), supports, dt=dt)
        return abs(moved).max(axis=0)

    finest = peak(DT / 8)
    errors = [abs(peak(dt) / finest - 1.0).max() for dt in (4 * DT, 2 * DT, DT)]
    assert errors[2] < 1e-3
    assert errors[0] > 1.6 * errors[1] > 1.6**2 * errors[2]
