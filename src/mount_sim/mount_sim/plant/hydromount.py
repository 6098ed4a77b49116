"""The original mount that the friction mount replaces: fluid in two chambers, beside the same elastomer.

    V_1' = A_p x' - q_i - q_d,  P_1 = P_1(V_1);  P_2' = (q_i + q_d) / C_2;  force A_p P_1
    I_i q_i' = P_1 - P_2 - (R_0 + R_1 |q_i|) q_i                      inertia track
    I_d q_d' = P_1 - P_2 - R_d q_d - P_stop,  V_d' = q_d              decoupler
    P_stop = k_st (V_d - V_up) + R_st q_d above V_up, likewise below V_low, 0 between

x: displacement; P, V: pressures of the chambers and the volumes pressed into them; q: flows from the upper
chamber (1) to the lower (2). The upper chamber bulges: C_1 = dV_1/dP_1 = C_10 (1 - a clip(P_1 / P_a, -1, 1)),
a: its asymmetry, P_a: the pressure at which it ends. All values are chosen, in magnitudes that are usual for
such mounts; the track is tuned to 8 Hz with the chamber. What depends on them is no finding about any mount.

The step is that of the vehicle: flows, like velocities, stand half a step before the volumes. Resistances
act on the mean of old and new flow, so they never return energy.
"""

import math
from typing import Annotated, NamedTuple

from mount_models.arithmetic.compiled import compiled
from mount_models.arithmetic.record import number_record
from mount_models.quantity import Quantity

_RESISTANCE = 'Pa s/m^3'


class Hydromount(NamedTuple):
    """Chambers, inertia track and decoupler of a hydraulic engine mount."""

    piston_area: Annotated[
        float, Quantity('m^2', 'A_p: volume displaced in the upper chamber per displacement', 1e-5, 0.1)
    ] = 2.5e-3
    upper_compliance: Annotated[
        float, Quantity('m^3/Pa', 'C_10: bulge of the upper chamber at rest', 1e-13, 1e-8)
    ] = 6e-11
    compliance_asymmetry: Annotated[
        float,
        Quantity('1', 'a: share of C_10 that pressure takes away and suction adds; 0: symmetric', 0.0, 0.9),
    ] = 0.25
    asymmetry_pressure: Annotated[
        float, Quantity('Pa', 'P_a: pressure at which the compliance stops changing', 1e3, 1e7)
    ] = 6e4
    lower_compliance: Annotated[float, Quantity('m^3/Pa', 'C_2: the soft lower chamber', 1e-12, 1e-6)] = (
        2.5e-9
    )
    track_inertance: Annotated[float, Quantity('kg/m^4', 'I_i: inertia track', 1e4, 1e9)] = 6.6e6
    track_resistance: Annotated[float, Quantity(_RESISTANCE, 'R_0: laminar part, track', 0.0, 1e11)] = 1e8
    track_turbulence: Annotated[float, Quantity('Pa s^2/m^6', 'R_1: turbulent part, track', 0.0, 1e15)] = (
        1.5e12
    )
    decoupler_inertance: Annotated[float, Quantity('kg/m^4', 'I_d: decoupler', 1e3, 1e8)] = 7.5e4
    decoupler_resistance: Annotated[
        float, Quantity(_RESISTANCE, 'R_d: decoupler; small: it floats freely', 0.0, 1e10)
    ] = 1e8
    decoupler_gap: Annotated[
        float, Quantity('m^3', 'V_g: volume that the decoupler lets pass to one side', 1e-9, 1e-4)
    ] = 8e-7
    upper_gap_share: Annotated[float, Quantity('1', 'V_up / V_g', 0.0, 10.0)] = 1.25
    lower_gap_share: Annotated[float, Quantity('1', '-V_low / V_g', 0.0, 10.0)] = 0.75
    stop_stiffness: Annotated[float, Quantity('Pa/m^3', 'k_st: stops of the decoupler', 0.0, 1e13)] = 3e11
    stop_resistance: Annotated[float, Quantity(_RESISTANCE, 'R_st: stops of the decoupler', 0.0, 1e10)] = 6e7


HYDROMOUNT_STATE = number_record(
    'upper_volume', 'lower_volume', 'track_flow', 'decoupler_flow', 'passed_volume'
)
"""V_1, C_2 P_2 and V_d in m^3, flows in m^3/s, half a step earlier."""


@compiled
def hydromount_force(hydromount, state):
    """Return the force (N) of the fluid on the chassis; the elastomer comes on top."""
    return hydromount.piston_area * upper_pressure(hydromount, state.upper_volume)


@compiled
def hydromount_step(hydromount, state, displacement_change, dt):
    """Advance `state`, a record of `HYDROMOUNT_STATE`, by `dt` seconds with `displacement_change` in m."""
    pressure = (
        upper_pressure(hydromount, state.upper_volume) - state.lower_volume / hydromount.lower_compliance
    )
    track_resistance = hydromount.track_resistance + hydromount.track_turbulence * abs(state.track_flow)
    state.track_flow = _flow_after(
        hydromount.track_inertance, track_resistance, state.track_flow, pressure, dt
    )
    overrun = decoupler_overrun(hydromount, state.passed_volume)
    resistance = hydromount.decoupler_resistance
    if overrun != 0.0:
        resistance += hydromount.stop_resistance
    state.decoupler_flow = _flow_after(
        hydromount.decoupler_inertance,
        resistance,
        state.decoupler_flow,
        pressure - hydromount.stop_stiffness * overrun,
        dt,
    )
    through = dt * (state.track_flow + state.decoupler_flow)
    state.passed_volume += dt * state.decoupler_flow
    state.upper_volume += hydromount.piston_area * displacement_change - through
    state.lower_volume += through


@compiled
def upper_pressure(hydromount, volume):
    """Return P_1 (Pa) with `volume` V_1 (m^3) pressed into the upper chamber."""
    rest, asymmetry = hydromount.upper_compliance, hydromount.compliance_asymmetry
    limit = hydromount.asymmetry_pressure
    full, empty = rest * limit * (1.0 - 0.5 * asymmetry), -rest * limit * (1.0 + 0.5 * asymmetry)
    if volume > full:
        return limit + (volume - full) / (rest * (1.0 - asymmetry))
    if volume < empty:
        return -limit + (volume - empty) / (rest * (1.0 + asymmetry))
    # root of C_10 (P - a P^2 / (2 P_a)) = V in the form that holds for a = 0 too
    return 2.0 * volume / (rest * (1.0 + math.sqrt(1.0 - 2.0 * asymmetry * volume / (rest * limit))))


@compiled
def decoupler_overrun(hydromount, volume):
    """Return by how much (m^3) the decoupler's `volume` V_d lies beyond a stop; 0 between the stops."""
    highest = hydromount.upper_gap_share * hydromount.decoupler_gap
    lowest = -hydromount.lower_gap_share * hydromount.decoupler_gap
    return max(volume - highest, 0.0) + min(volume - lowest, 0.0)


@compiled
def _flow_after(inertance, resistance, flow, pressure, dt):
    """Return the flow (m^3/s) after `dt` seconds; the resistance sees the mean of old and new flow."""
    inertia = inertance / dt
    return ((inertia - 0.5 * resistance) * flow + pressure) / (inertia + 0.5 * resistance)
