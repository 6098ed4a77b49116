"""Where the energy goes that road and engine put into the vehicle: stored or dissipated, part by part.

The step of the vehicle is a leapfrog: heights, volumes and forces stand at the times t_n, velocities and
flows half a step before and after. At t_n the book-keeping takes

    energy of motion    m v(n-1/2) v(n+1/2) / 2, likewise inertance and flows
    work                mean force at both ends of a step times the way between them
    loss of a damper    its coefficient times the square of the mean of v(n-1/2) and v(n+1/2)
    loss of the pads    mean friction force times the way slid; d_R times the square of the creep's velocity

With these means springs, masses and their exchange of energy balance exactly (derived: the product of the two
velocities changes by the mean force times the way), so what remains unbalanced is an error of a law, not of
the step. Nothing is found as a remainder: losses come from the laws of the parts.

The velocity after t_n is known once the step is done; so the states before and after a step complete the
balance for the time at which it began.
"""

import math
from typing import Any

import numpy as np
import numpy.typing as npt

from mount_models.arithmetic.compiled import compiled
from mount_models.arithmetic.record import record_type
from mount_sim.excitation.excitation import Seat
from mount_sim.plant.hydromount import decoupler_overrun, upper_pressure

_VEHICLE = int(Seat.VEHICLE)

LOSSES = (
    'suspension_loss',
    'chassis_loss',
    'elastomer_loss',
    'track_loss',
    'decoupler_loss',
    'sliding_loss',
    'creep_loss',
)
"""Parts that dissipate; the decoupler with its stops, the pads by sliding and by creep."""

ACCOUNT = record_type(
    [
        (name, 'f8')
        for name in (
            'road_work',
            'engine_work',
            'stored',
            'first_stored',
            *LOSSES,
            'road_height',
            'engine_height',
            'engine_force',
            'tyre_force',
            'steps',
        )
    ]
)
"""Work put in, energy stored now and at first, losses; all in J; below them the inputs of the last step."""


def new_account() -> npt.NDArray[Any]:
    """Return an empty account (1,); pass element 0 to `book_step`."""
    return np.zeros(1, ACCOUNT)


def imbalance(account: Any) -> float:
    """Return what is neither stored nor dissipated (J) of the work put in; 0 for a perfect balance."""
    lost = sum(float(account[name]) for name in LOSSES)
    put_in = float(account['road_work'] + account['engine_work'])
    return put_in - lost - float(account['stored'] - account['first_stored'])


@compiled
def book_step(account, vehicle, hydromount, contact, before, after, road_height, engine_force, dt):
    """Add one step to `account`, a record of `ACCOUNT`.

    `before`, `after`: the states around the step, records with the fields `vehicle` (`VEHICLE_STATE`),
    `hydromount` (`HYDROMOUNT_STATE`), `friction_force` (N), `slider_position` and `deflection` (m); a step
    finds the last three, those of the pads, at its beginning. `road_height` (m) and `engine_force` (N) are
    what acted in it. What is not in the seat stays 0.
    """
    ways = before.vehicle
    stored = vehicle_energy(vehicle, before.vehicle, after.vehicle, road_height)
    stored += fluid_energy(hydromount, before.hydromount, after.hydromount)
    stored += pad_energy(contact, after.friction_force, after.deflection)
    tyre_force = vehicle.tyre_stiffness * (road_height - ways.wheel_height)
    if account.steps == 0.0:
        account.first_stored = stored
    else:
        account.road_work += 0.5 * (tyre_force + account.tyre_force) * (road_height - account.road_height)
        risen = ways.engine_height - account.engine_height
        account.engine_work += 0.5 * (engine_force + account.engine_force) * risen
        _book_vehicle(account, vehicle, before.vehicle, after.vehicle, dt)
        _book_fluid(account, hydromount, before.hydromount, after.hydromount, dt)
        _book_pads(account, contact, before, after, dt)
    account.stored = stored
    account.tyre_force, account.road_height = tyre_force, road_height
    account.engine_force, account.engine_height = engine_force, ways.engine_height
    account.steps += 1.0


@compiled
def vehicle_energy(vehicle, before, after, road_height):
    """Return the energy (J) of motion, springs and elastomer at the beginning of a step."""
    elastomer = vehicle.elastomer
    motion = vehicle.wheel_mass * before.wheel_velocity * after.wheel_velocity
    motion += vehicle.body_mass * before.body_velocity * after.body_velocity
    motion += vehicle.chassis_mass * before.chassis_velocity * after.chassis_velocity
    motion += vehicle.engine_mass * before.engine_velocity * after.engine_velocity
    springs = vehicle.tyre_stiffness * (road_height - before.wheel_height) ** 2
    springs += vehicle.suspension_stiffness * (before.wheel_height - before.body_height) ** 2
    springs += vehicle.chassis_stiffness * (before.body_height - before.chassis_height) ** 2
    springs += elastomer.static_stiffness * (before.engine_height - before.chassis_height) ** 2
    branches = _over(before.slow_force**2, elastomer.slow_stiffness)
    branches += _over(before.middle_force**2, elastomer.middle_stiffness)
    branches += _over(before.fast_force**2, elastomer.fast_stiffness)
    return 0.5 * (motion + springs + branches)


@compiled
def fluid_energy(hydromount, before, after):
    """Return the energy (J) of chambers, stops and moving fluid at the beginning of a step."""
    chambers = upper_energy(hydromount, before.upper_volume)
    chambers += 0.5 * before.lower_volume**2 / hydromount.lower_compliance
    stops = 0.5 * hydromount.stop_stiffness * decoupler_overrun(hydromount, before.passed_volume) ** 2
    motion = hydromount.track_inertance * before.track_flow * after.track_flow
    motion += hydromount.decoupler_inertance * before.decoupler_flow * after.decoupler_flow
    return chambers + stops + 0.5 * motion


@compiled
def upper_energy(hydromount, volume):
    """Return the energy (J) of the bulge, the integral of P_1 over V_1 from 0 to `volume` (m^3)."""
    pressure = upper_pressure(hydromount, volume)
    rest, asymmetry = hydromount.upper_compliance, hydromount.compliance_asymmetry
    limit = hydromount.asymmetry_pressure
    inside = min(max(pressure, -limit), limit)
    energy = rest * inside * inside * (0.5 - asymmetry * inside / (3.0 * limit))
    outside = rest * (1.0 - asymmetry * inside / limit)
    return energy + 0.5 * outside * (pressure * pressure - inside * inside)


@compiled
def pad_energy(contact, friction_force, deflection):
    """Return the energy (J) of both springs of the friction contact."""
    return 0.5 * (
        friction_force**2 / contact.contact_stiffness + contact.tangential_stiffness * deflection**2
    )


@compiled
def _book_vehicle(account, vehicle, before, after, dt):
    wheel = 0.5 * (before.wheel_velocity + after.wheel_velocity)
    body = 0.5 * (before.body_velocity + after.body_velocity)
    chassis = 0.5 * (before.chassis_velocity + after.chassis_velocity)
    account.suspension_loss += dt * vehicle.suspension_damping * (wheel - body) ** 2
    account.chassis_loss += dt * vehicle.chassis_damping * (body - chassis) ** 2
    elastomer = vehicle.elastomer
    power = _over(before.slow_force**2, elastomer.slow_stiffness) * elastomer.slow_corner
    power += _over(before.middle_force**2, elastomer.middle_stiffness) * elastomer.middle_corner
    power += _over(before.fast_force**2, elastomer.fast_stiffness) * elastomer.fast_corner
    account.elastomer_loss += dt * 2.0 * math.pi * power


@compiled
def _book_fluid(account, hydromount, before, after, dt):
    track = 0.5 * (before.track_flow + after.track_flow)
    decoupler = 0.5 * (before.decoupler_flow + after.decoupler_flow)
    resistance = hydromount.track_resistance + hydromount.track_turbulence * abs(track)
    account.track_loss += dt * resistance * track**2
    resistance = hydromount.decoupler_resistance
    if decoupler_overrun(hydromount, before.passed_volume) != 0.0:
        resistance += hydromount.stop_resistance
    account.decoupler_loss += dt * resistance * decoupler**2


@compiled
def _book_pads(account, contact, before, after, dt):
    slid = after.slider_position - before.slider_position
    account.sliding_loss += 0.5 * (before.friction_force + after.friction_force) * slid
    creep = after.deflection - before.deflection
    account.creep_loss += contact.tangential_damping * creep**2 / dt


@compiled
def _over(square, stiffness):
    """Return `square` / `stiffness`; a branch without stiffness has neither force nor energy."""
    return square / stiffness if stiffness > 0.0 else 0.0
