"""The simulated coil ripple: how fast current and flux move just after the bridge has switched (section 3.2).

The ripple's field only reaches the skin of the iron, so it meets more reluctance than slow changes do:
S times that of the core's full section, with S from the diffusion of the field into plates.
It belongs to the plant, as `actuator.reluctance` does; the controller reads gaps with `coil.gap`.
"""

import math
from typing import Annotated, NamedTuple

from mount_models.arithmetic.compiled import compiled
from mount_models.arithmetic.elementary import exp, expm1
from mount_models.quantity import Quantity
from mount_sim.plant.reluctance import core_field, differential_permeability, gap_permeance


class RippleCoil(NamedTuple):
    """The bridge that drives the coil, the moment of sampling, and the plates of the core."""

    link_voltage: Annotated[float, Quantity('V', 'voltage U of the H-bridge', 1.0, 100.0)] = 14.0
    resistance: Annotated[float, Quantity('ohm', 'resistance R of the coil', 0.01, 100.0)] = 2.5
    pwm_period: Annotated[float, Quantity('s', 'period T of the bridge', 1e-6, 1e-2)] = 200e-6
    sample_delay: Annotated[
        float, Quantity('s', 'time t from switching to the sample', 1e-7, 1e-2, 'section 3.2')
    ] = 18e-6
    conductivity: Annotated[float, Quantity('S/m', 'conductivity sigma of the core', 1e3, 1e8)] = 2e6
    plate_half_thickness: Annotated[
        float, Quantity('m', 'half thickness a of one plate of the core', 1e-5, 1e-2)
    ] = 1.5e-3


REFERENCE_CELSIUS = 20.0
"""Temperature at which the parameters of the truth hold."""


class TemperatureCoefficients(NamedTuple):
    """How the truth changes with the temperature; a calibration may well assume something else."""

    core: Annotated[
        float,
        Quantity(
            '1/K', 'rise of the resistivity of the core per kelvin from 20 degC on', 0.0, 0.01, 'chosen'
        ),
    ] = 0.0043
    copper: Annotated[
        float,
        Quantity('1/K', 'rise of the resistance of the coil per kelvin from 20 degC on', 0.0, 0.01),
    ] = 0.0039


def coil_at(coil: RippleCoil, coefficients: TemperatureCoefficients, celsius: float) -> RippleCoil:
    """Return coil and core plates, given at 20 degC, as they are at `celsius` (degC)."""
    warmer = celsius - REFERENCE_CELSIUS
    return coil._replace(
        conductivity=coil.conductivity / (1.0 + coefficients.core * warmer),
        resistance=coil.resistance * (1.0 + coefficients.copper * warmer),
    )


@compiled
def duty(coil, current):
    """Return the share D of positive voltage that holds `current` (A): D = (1 + R i / U) / 2."""
    return 0.5 * (1.0 + coil.resistance * current / coil.link_voltage)


@compiled
def incremental_inductance(coil, actuator, current, gap):
    """Return L_i = n A dB/di (H) as seen `sample_delay` after switching, at `current` (A) and `gap` (m).

    Eq (5) in its right form; as printed it is the inverse. NaN where the sample falls outside its phase.
    """
    permeability = differential_permeability(actuator, core_field(actuator, current, gap))
    time_constant = diffusion_time(coil, permeability)
    skin = skin_factor(coil, time_constant, duty(coil, current))
    reluctance = 1.0 / gap_permeance(actuator, gap)
    reluctance += skin * actuator.core_length / (permeability * actuator.gap_area)
    return actuator.turns * actuator.turns / reluctance


@compiled
def flux_rate(coil, actuator, current):
    """Return dB/dt (T/s) of the core after switching to plus: the voltage left over drives it, U - R i."""
    return (coil.link_voltage - coil.resistance * current) / (actuator.turns * actuator.gap_area)


@compiled
def current_rate(coil, actuator, current, gap):
    """Return di/dt (A/s) at the moment of sampling; n A (dB/dt) / (di/dt) is the ripple's inductance."""
    voltage = coil.link_voltage - coil.resistance * current
    return voltage / incremental_inductance(coil, actuator, current, gap)


@compiled
def skin_factor(coil, diffusion_time, duty):
    """Return S, the core's reluctance against the ripple over that against slow changes; at least 1.

    `diffusion_time` tau (s) is that of one plate, `duty` D the share of positive voltage. Derived: in the
    periodic steady state the plate answers with S = 1 + 2/(1-D) sum_k exp(-l_k t) (1 - exp(-l_k (1-D) T)) /
    (1 - exp(-l_k T)), l_k = (k pi)^2 / tau. NaN where the sample would fall outside the positive phase, or
    the bridge cannot hold the current.
    """
    if not (0.0 < duty < 1.0 and coil.sample_delay < duty * coil.pwm_period):
        return math.nan
    # to a fast ripple a thick plate is a half space; from 12 periods on the two forms agree within 1e-4
    if diffusion_time > 12.0 * coil.pwm_period:
        return _half_space_skin_factor(coil, diffusion_time, duty)
    return skin_factor_series(coil, diffusion_time, duty, _MOST_TERMS)


@compiled
def skin_factor_series(coil, diffusion_time, duty, terms):
    """Return S of `skin_factor` as its series of at most `terms` terms; the reference for the quick form."""
    off_time = (1.0 - duty) * coil.pwm_period
    total = 0.0
    for k in range(1, terms + 1):
        rate = (k * math.pi) ** 2 / diffusion_time
        if rate * coil.sample_delay > _FADED:
            break
        term = exp(-rate * coil.sample_delay) * expm1(-rate * off_time)
        total += term / expm1(-rate * coil.pwm_period)
    return 1.0 + 2.0 * total / (1.0 - duty)


@compiled
def diffusion_time(coil, permeability):
    """Return tau = mu sigma a^2 (s), in which a field crosses half a plate of `permeability` (H/m)."""
    return permeability * coil.conductivity * coil.plate_half_thickness**2


@compiled
def penetration_depth(coil, permeability):
    """Return how deep (m) the ripple's field has come when it is sampled: sqrt(t / (mu sigma))."""
    return math.sqrt(coil.sample_delay / (permeability * coil.conductivity))


_FADED = 16.0  # exp(-16) = 1e-7: further terms do not show
_MOST_TERMS = 2000  # a bound only: at the chosen delay the series has faded after 14 terms


@compiled
def _half_space_skin_factor(coil, diffusion_time, duty):
    """Return S of a plate so thick that no ripple sees its middle: every past switching adds 1/sqrt(its age).

    The series becomes an integral, and this the sum over the ages (t + m T) of the switchings to plus and
    (t + (1 - D + m) T) of those to minus, m = 0, 1, ..., in the unit of one period:
    S = sqrt(tau / (pi T)) / (1 - D) * sum_m [(q + m)^-1/2 - (q + 1 - D + m)^-1/2],  q = t / T.
    Past the first `_EXPLICIT` the sum is closed by the formula of Euler and Maclaurin.
    """
    age = coil.sample_delay / coil.pwm_period
    later = age + 1.0 - duty
    total = 0.0
    for m in range(_EXPLICIT):
        total += 1.0 / math.sqrt(age + m) - 1.0 / math.sqrt(later + m)
    total += _remainder(age + _EXPLICIT) - _remainder(later + _EXPLICIT)
    return total / (1.0 - duty) * math.sqrt(diffusion_time / (math.pi * coil.pwm_period))


_EXPLICIT = 2


@compiled
def _remainder(x):
    """Return the sum of (x + m)^-1/2 over m >= 0, up to a constant that is the same for every x."""
    root = math.sqrt(x)
    return -2.0 * root + 0.5 / root + 1.0 / (24.0 * x * root)
