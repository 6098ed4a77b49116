"""What signals can be: each quantity with its dimension, and the size that it has at an engine mount."""

from typing import NamedTuple

from engine_mount.signals.signal import SignalError
from engine_mount.signals.units import Unit, si_unit
from mount_models.quantity import nearest


class Quantity(NamedTuple):
    """One quantity: its name, dimension, and between which bounds its values vary (SI, peak to peak).

    The bounds are chosen wide: they tell a wrong unit, never a rough road from a smooth one. With `by_size`
    they hold for the largest value. `titles` are words by which other systems name such a column; `mapped` is
    its name in a mapping file where that is another one.
    """

    name: str
    dimension: str
    sentence: str
    least: float = 0.0
    most: float = float('inf')
    titles: tuple[str, ...] = ()
    by_size: bool = False
    mapped: str = ''

    @property
    def unit(self) -> Unit:
        """The SI unit."""
        return si_unit(self.dimension)


Quantities = dict[str, Quantity]


def by_name(*quantities: Quantity) -> Quantities:
    """Return quantities by their names."""
    return {quantity.name: quantity for quantity in quantities}


QUANTITIES = by_name(
    Quantity(
        'displacement', 'length', 'displacement of the mount, engine minus chassis', 20e-6, 0.1,
        ('weg', 'federweg', 'travel', 'stroke', 'disp', 'mount'),
    ),
    Quantity('engine_displacement', 'length', 'displacement of the engine, upwards', 20e-6, 1.0),
    Quantity('chassis_displacement', 'length', 'displacement of the chassis, upwards', 20e-6, 1.0),
    Quantity('velocity', 'velocity', 'velocity of the mount, engine minus chassis', 1e-4, 10.0),
    Quantity(
        'acceleration', 'acceleration', 'acceleration of the chassis at the mount, upwards', 0.02, 100.0,
        ('az', 'acc', 'accel', 'acc_z', 'accz', 'beschleunigung', 'vertical_acceleration'),
    ),
    Quantity(
        'force', 'force', 'force on the mount or on the pads, as measured', 1.0, 5e4,
        ('kraft', 'load', 'friction_force', 'reibkraft'),
    ),
    Quantity('normal_force', 'force', 'normal force on the pads', 1.0, 5e4, ('clamp_force', 'normalkraft')),
    Quantity('current', 'current', 'current of the coil', 0.01, 20.0, ('strom', 'coil_current', 'i')),
    Quantity('voltage', 'voltage', 'voltage at the coil', 0.01, 100.0, ('spannung',)),
    Quantity('inductance', 'inductance', 'inductance of the coil', 1e-6, 1.0, ('induktivitaet',)),
    Quantity('air_gap', 'length', 'air gap of the actuator', 1e-6, 5e-3, ('gap', 'luftspalt')),
    Quantity('flux_density', 'flux density', 'flux density in the gap', 1e-4, 3.0),
    Quantity(
        'temperature', 'temperature', 'temperature of the coil', 200.0, 600.0, ('temp', 'temperatur'), True
    ),
    Quantity('pressure', 'pressure', 'pressure', 10.0, 1e9, ('druck',)),
    Quantity('speed', 'velocity', 'speed of the vehicle', 0.1, 100.0, ('geschwindigkeit', 'v_vehicle')),
)  # fmt: skip
"""Quantities that every command knows; those of racks, rigs and roads stand where these are read."""


def quantity(name: str, known: Quantities = QUANTITIES) -> Quantity:
    """Return the quantity `name`; raises `SignalError` with those that are known."""
    if name not in known:
        raise SignalError(f'{name!r} is no quantity; {nearest(name, known)}')
    return known[name]


def titled(title: str, known: Quantities = QUANTITIES) -> Quantity | None:
    """Return the quantity that a column of this title holds, None where its words tell none."""
    word = title.strip().lower().replace(' ', '_')
    return next((one for one in known.values() if word == one.name or word in one.titles), None)
