"""What signals can be: each quantity with its dimension, and the size that it has at an engine mount."""

from dataclasses import dataclass

from engine_mount.signals.units.unit import SI_UNITS, Unit, UnitError, si_unit


@dataclass(frozen=True)
class Quantity:
    """One quantity: its name, dimension, and between which bounds its values vary (SI, peak to peak).

    The bounds are chosen wide: they tell a wrong unit, never a rough road from a smooth one. `titles` are
    words by which columns of others name it.
    """

    name: str
    dimension: str
    sentence: str
    least: float
    most: float
    titles: tuple[str, ...] = ()

    @property
    def unit(self) -> Unit:
        """The SI unit."""
        return si_unit(self.dimension)


QUANTITIES: tuple[Quantity, ...] = (
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
    Quantity('temperature', 'temperature', 'temperature of the coil', 0.1, 300.0, ('temp', 'temperatur')),
    Quantity('pressure', 'pressure', 'pressure', 10.0, 1e9, ('druck',)),
    Quantity('speed', 'velocity', 'speed of the vehicle', 0.1, 100.0, ('geschwindigkeit', 'v_vehicle')),
)  # fmt: skip
_BY_NAME = {quantity.name: quantity for quantity in QUANTITIES}


def quantity(name: str) -> Quantity:
    """Return the quantity `name`; raises `UnitError` with those that are known."""
    if name not in _BY_NAME:
        raise UnitError(f'{name!r} is no quantity; known are {names()}')
    return _BY_NAME[name]


def names() -> str:
    """Return the names of all quantities, for sentences."""
    return ', '.join(_BY_NAME)


def is_quantity(name: str) -> bool:
    """Return whether `name` is a quantity that is known here."""
    return name in _BY_NAME


def quantity_of(unit: Unit) -> Quantity:
    """Return the first quantity that is measured in `unit`, or raise `UnitError`."""
    found = next((one for one in QUANTITIES if one.dimension == unit.dimension), None)
    if found is None:
        raise UnitError(
            f'a column in {unit.symbol} can be no quantity by its unit alone; say which: QUANTITY=COLUMN:UNIT'
        )
    return found


def titled(title: str) -> Quantity | None:
    """Return the quantity that a column of this title holds, None where its words tell none."""
    word = title.strip().lower().replace(' ', '_')
    return next((one for one in QUANTITIES if word == one.name or word in one.titles), None)


def other(name: str, unit: Unit) -> Quantity:
    """Return a quantity of the user's own: any size is taken."""
    return Quantity(name, unit.dimension, f'{name}, in {SI_UNITS[unit.dimension]}', 0.0, float('inf'))
