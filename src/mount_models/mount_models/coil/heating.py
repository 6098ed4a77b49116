"""How warm the coil becomes by its own current, and which current keeps it below its limit.

One thermal mass, heated by the copper loss and cooled to the ambient,

    C dT/dt = R(T) i^2 - (T - T_a) / R_th,    R(T) = R_20 (1 + alpha (T - 20 degC)),    tau = R_th C,

in which T is `celsius`, T_a `ambient_celsius`, R_th `thermal_resistance`, tau `time_constant`, R_20
`resistance` and alpha `copper`. Textbook law of a thermal body of first order (derived). A step of length
h is implicit in T and takes R at its begin: stable for any h, right to first order in h / tau, and made of
the four basic operations alone, so it gives the same bits on every processor.
"""

from typing import Annotated, NamedTuple

from mount_models.coil.resistance import COPPER_COEFFICIENT
from mount_models.quantity import ParameterError, Quantity

COPPER_CELSIUS = 20.0
"""Temperature at which `CoilHeating.resistance` holds, degC."""

_FINE = 0.01  # K, chosen


class CoilHeating(NamedTuple):
    """Coil as a thermal body, and the temperatures between which its current is lowered."""

    resistance: Annotated[float, Quantity('ohm', 'resistance of the coil at 20 degC', 0.01, 100.0)] = 2.5
    copper: Annotated[
        float,
        Quantity('1/K', 'rise of the resistance per kelvin', 0.0, 0.01, 'copper, IEC 60028'),
    ] = COPPER_COEFFICIENT
    thermal_resistance: Annotated[
        float,
        Quantity('K/W', 'from coil to ambient', 0.1, 100.0, 'chosen: 1 A for ever is 20 K, 3 A is too much'),
    ] = 6.0
    time_constant: Annotated[
        float,
        Quantity('s', 'of coil and core against the ambient', 1.0, 36000.0, 'chosen: 0.26 kg of copper'),
    ] = 600.0
    ambient_celsius: Annotated[
        float, Quantity('degC', 'highest temperature around the mount', -60.0, 150.0, 'chosen: engine bay')
    ] = 80.0
    derating_celsius: Annotated[
        float, Quantity('degC', 'from here on the current is lowered', -60.0, 250.0, 'chosen')
    ] = 140.0
    limit_celsius: Annotated[
        float,
        Quantity('degC', 'here the current is 0 A', -60.0, 250.0, 'chosen: 10 K below insulation class H'),
    ] = 170.0


def warmed(heating: CoilHeating, celsius: float, mean_square: float, duration: float) -> float:
    """Return the temperature (degC) of the coil after `duration` s with this mean square current (A^2)."""
    warmth = heating.thermal_resistance * heating.resistance * mean_square  # K, at 20 degC
    share = duration / heating.time_constant
    resistance_ratio = 1.0 + heating.copper * (celsius - COPPER_CELSIUS)
    steady = heating.ambient_celsius + warmth * max(resistance_ratio, 0.0)
    return (celsius + share * steady) / (1.0 + share)


def highest_current(heating: CoilHeating, celsius: float, current_limit: float) -> float:
    """Return the current (A) that a coil of this temperature may carry, at most `current_limit` (A).

    It falls in a straight line from `derating_celsius` to 0 A at `limit_celsius`: smoothly, and a coil that
    only its current heats never reaches the limit.
    """
    if celsius <= heating.derating_celsius:
        return current_limit
    if celsius >= heating.limit_celsius:
        return 0.0
    span = heating.limit_celsius - heating.derating_celsius
    return current_limit * ((heating.limit_celsius - celsius) / span)


def hottest_by_current(heating: CoilHeating, current_limit: float) -> float:
    """Return the temperature (degC) at which `highest_current` keeps a coil that carries it for ever."""
    low, high = heating.ambient_celsius, heating.limit_celsius
    while high - low > _FINE:
        middle = 0.5 * (low + high)
        current = highest_current(heating, middle, current_limit)
        rises = warmed(heating, middle, current * current, 1.0) > middle
        low, high = (middle, high) if rises else (low, middle)
    return high


def check_heating(heating: CoilHeating) -> None:
    """Raise `ParameterError` unless ambient, begin of derating and limit rise in this order."""
    h = heating
    if not h.ambient_celsius < h.derating_celsius < h.limit_celsius:
        raise ParameterError(
            f'ambient_celsius ({h.ambient_celsius:g}), derating_celsius ({h.derating_celsius:g}) and '
            f'limit_celsius ({h.limit_celsius:g} degC) must rise in this order; correct them'
        )
