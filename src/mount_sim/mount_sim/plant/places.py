"""Where an engine on several mounts rests, and which parameters each mount may have for itself."""

from collections.abc import Collection, Mapping
from typing import Annotated, Any, NamedTuple

from mount_models.quantity import ParameterError, Quantity
from mount_sim.electronics.faults.schedule import texts_of_mount
from mount_sim.plant.engine_body import RigidEngine, Support, engine_modes
from mount_sim.plant.vehicle import Vehicle

_X = Quantity('m', 'x of the mount, forward of the centre of gravity', -2.0, 2.0)
_Y = Quantity('m', 'y of the mount, left of the centre of gravity', -2.0, 2.0)
_LOWEST_MODE = 0.5  # Hz, chosen: below it the engine is held by nothing

SUPPORTS = {
    'none': 'nothing holds the engine there',
    'elastomer': 'an elastomer without electronics',
    'hydro': 'a hydromount without electronics',
}
"""What a place has whose mount has no electronics."""


class Place(NamedTuple):
    """A place of the engine, from its centre of gravity, and what is there without electronics."""

    x: Annotated[float, _X] = 0.0
    y: Annotated[float, _Y] = 0.0
    support: Annotated[
        str,
        Quantity('word', 'what holds the engine there without electronics', words=tuple(SUPPORTS)),
    ] = 'none'


class Places(NamedTuple):
    """The four places: beside the engine on its principal axis, before and behind it."""

    left: Place = Place(y=0.45)
    right: Place = Place(y=-0.45)
    front: Place = Place(x=0.3)
    rear: Place = Place(x=-0.3)


ALONE = ''
"""Name of the mount where there is one."""

PLACES: tuple[str, ...] = Places._fields
"""Names of the places, which are those of their mounts and of the mounts' namespaces."""

_OWN = ('actuator', 'coil', 'temperature', 'mechanics', 'friction', 'contact', 'hydromount', 'electronics')
_ALSO_OWN = ('mount', 'channel', 'port')
_OWN_PARTS = ('vehicle.elastomer.', 'vehicle.chassis_')
_SHARED = 'electronics.clock_drift'  # all mounts are sampled in the same millisecond


def mount_names(text: str) -> tuple[str, ...]:
    """Return the names in `text`, as in `left,right`; none: one mount alone. Raises `ParameterError`."""
    names = tuple(name.strip() for name in text.split(',')) if text.strip() else ()
    for name in names:
        if name not in PLACES:
            raise ParameterError(f'mounts ({text}): {name!r} is no place; known are {", ".join(PLACES)}')
    if len(set(names)) < len(names):
        raise ParameterError(f'mounts ({text}) must name each place once')
    return names


def general_name(name: str) -> str:
    """Return the general parameter behind `name`, perhaps that of one mount (`mount_left.friction.scale`).

    Raises `ParameterError` for one that is common to all mounts.
    """
    prefix, _, rest = name.partition('.')
    if prefix.removeprefix('mount_') not in PLACES or not prefix.startswith('mount_'):
        return name
    own = rest in _ALSO_OWN or rest.startswith((*(f'{part}.' for part in _OWN), *_OWN_PARTS))
    if not own or rest == _SHARED:
        raise ParameterError(f'{rest!r} is common to all mounts: set it without {prefix}.')
    return rest


def values_of_mount(values: Mapping[str, Any], name: str) -> dict[str, Any]:
    """Return the parameters {name: value} of mount_sim as they hold for the mount `name`."""
    own = f'mount_{name}.'
    found = {key: value for key, value in values.items() if general_name(key) == key}
    found |= {key[len(own) :]: value for key, value in values.items() if key.startswith(own)}
    if name and found.get('faults'):
        found['faults'] = tuple(texts_of_mount(found['faults'], name, mount_names(found['mounts'])))
    return found


def supported_places(places: Places, mounts: Collection[str]) -> list[str]:
    """Return the places with a support without electronics, or raise `ParameterError`."""
    for name, place in places._asdict().items():
        if place.support not in SUPPORTS:
            raise ParameterError(
                f'places.{name}.support {place.support!r} is unknown; known are {", ".join(SUPPORTS)}'
            )
    named = places._asdict().items()
    return [name for name, place in named if name not in mounts and place.support != 'none']


def support_of(place: Place, vehicle: Vehicle) -> Support:
    """Return the support at a place with the elastomer and the chassis of `vehicle`."""
    chassis = vehicle.chassis_mass, vehicle.chassis_stiffness, vehicle.chassis_damping
    return Support(place.x, place.y, *chassis, vehicle.elastomer)


def check_hold(engine: RigidEngine, supports: Mapping[str, Support]) -> None:
    """Raise `ParameterError` if the engine could move without a force against it."""
    lowest = engine_modes(engine, list(supports.values()))[0]
    if lowest < _LOWEST_MODE:
        raise ParameterError(
            f'the engine on {", ".join(supports)} has a natural frequency of {lowest:.3g} Hz (limit '
            f'{_LOWEST_MODE:g} Hz): nothing holds it against heave, roll or pitch; give another place a '
            'mount (mounts) or a support (places.rear.support elastomer), or the torque rod a lever '
            '(engine.rod_lever)'
        )
