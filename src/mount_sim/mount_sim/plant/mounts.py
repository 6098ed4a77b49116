"""The mounts of a run: what sits in each, where it stands, which parameters it has for itself."""

from collections.abc import Collection, Iterable, Mapping
from enum import IntEnum
from typing import Annotated, Any, NamedTuple

from mount_models.quantity import ParameterError, Quantity, nearest
from mount_sim.electronics.vehicle_bus import READ_BY_DRIVER


class Contents(IntEnum):
    """What acts in the mount beside its elastomer."""

    PADS = 0  # the friction contact, pressed by the actuator
    FLUID = 1  # chambers, inertia track and decoupler
    NOTHING = 2


class SeatedMount(NamedTuple):
    """One mount in the seat, as compiled code takes it."""

    contents: int = int(Contents.PADS)
    driver_opens: bool = False  # the coil's driver, when the excitation begins


MOUNTS = {
    'friction': 'the semi-active friction mount',
    'friction_off': 'the friction mount whose coil driver opens when the excitation begins: 0 A from then on',
    'friction_always_on': 'the friction mount, its control told to damp always (`mount_control.switching`)',
    'hydro': 'the original hydromount; the actuator is there electrically, no rod between its pads',
    'elastomer': 'the elastomer alone; the actuator is there electrically, no rod between its pads',
}
"""Names of all mounts, and what they are."""

_SEATED = {
    'friction_off': SeatedMount(driver_opens=True),
    'hydro': SeatedMount(int(Contents.FLUID)),
    'elastomer': SeatedMount(int(Contents.NOTHING)),
}


def seated_mount(name: str) -> SeatedMount:
    """Return the mount of a name in `MOUNTS`, or raise `ParameterError` with the known ones."""
    if name not in MOUNTS:
        raise ParameterError(f'mount {name!r} is unknown; {nearest(name, MOUNTS)}')
    return _SEATED.get(name, SeatedMount())


def without_friction(name: str) -> str:
    """Return why a control can make no friction in a mount of `MOUNTS`, empty where it can."""
    seated = seated_mount(name)
    if seated.contents != Contents.PADS:
        return f'mount {name} has no friction contact'
    return f'in mount {name} the coil driver is open' if seated.driver_opens else ''


# The control that a mount needs.

ALWAYS_ON = 'friction_always_on'
NEEDED = {'policy': 'switched_viscous', 'switching': 'always'}
"""The parameters of mount_control that the mount `ALWAYS_ON` needs."""

Settings = Mapping[str, Mapping[str, Any]]
"""{node: {parameter: value}}."""


def seat_of(settings: Settings) -> str:
    """Return the name of the mount in the seat; a real one is a friction mount."""
    return str(settings.get('mount_sim', {}).get('mount', 'friction'))


def simulated_mounts(settings: Settings) -> str:
    """Return the places of several simulated mounts, the name of one alone, nothing in a car."""
    sim = settings.get('mount_sim')
    return str(sim.get('mounts') or seat_of(settings)) if sim else ''


def with_control_of_mount(settings: Settings) -> dict[str, dict[str, Any]]:
    """Return the settings of the nodes with what the simulated car needs of them.

    Policy and switching for the mount in the seat; a driver that reads the speed of an engine that sends it.
    """
    completed = {node: dict(values) for node, values in settings.items()}
    if settings.get('mount_sim', {}).get('idle.speed_sent'):
        completed['mount_driver'] = {**READ_BY_DRIVER, **completed.get('mount_driver', {})}
    if seat_of(settings) == ALWAYS_ON:
        completed['mount_control'] = {**NEEDED, **completed.get('mount_control', {})}
    return completed


def check_control_of_mount(settings: Settings) -> None:
    """Raise `ParameterError` if the mount must damp always and the control does not."""
    control = settings.get('mount_control', {})
    for name, value in NEEDED.items() if seat_of(settings) == ALWAYS_ON else ():
        if control.get(name) != value:  # both have other defaults
            raise ParameterError(
                f'mount {ALWAYS_ON} needs mount_control.{name} {value}; instead received '
                f'{control.get(name, "its default")}'
            )


# Several mounts.

_X = Quantity('m', 'x of the mount, forward of the centre of gravity', -2.0, 2.0)
_Y = Quantity('m', 'y of the mount, left of the centre of gravity', -2.0, 2.0)


class Place(NamedTuple):
    """A place of the engine, from its centre of gravity."""

    x: Annotated[float, _X] = 0.0
    y: Annotated[float, _Y] = 0.0


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

_OWN = tuple(
    f'{part}.'
    for part in (
        'actuator', 'coil', 'temperature', 'mechanics', 'friction', 'contact', 'hydromount', 'electronics',
        'vehicle.elastomer',
    )
)  # fmt: skip
_SHARED = 'electronics.clock_drift'  # all mounts are sampled in the same millisecond


def mount_names(text: str) -> tuple[str, ...]:
    """Return the names in `text`, as in `left,right`; none: one mount alone. Raises `ParameterError`."""
    names = tuple(name.strip() for name in text.split(',')) if text.strip() else ()
    for name in names:
        if name not in PLACES:
            raise ParameterError(f'mounts ({text}): {name!r} is no place; {nearest(name, PLACES)}')
    if len(set(names)) < len(names):
        raise ParameterError(f'mounts ({text}) must name each place once')
    return names


def general_name(name: str) -> str:
    """Return the general parameter behind `name`, perhaps that of one mount (`mount_left.friction.scale`).

    Raises `ParameterError` for one that is common to all mounts.
    """
    prefix, _, rest = name.partition('.')
    if prefix not in {f'mount_{place}' for place in PLACES}:
        return name
    own = rest in ('mount', 'channel', 'port') or rest.startswith((*_OWN, 'vehicle.chassis_'))
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


def texts_of_mount(texts: Iterable[str], mount: str, mounts: Collection[str]) -> list[str]:
    """Return the faults that hold for `mount`, without its name: `right/NAME...`; without one all have it.

    `mounts` are the names of all, '' where there is one alone. Raises `ParameterError` for another name.
    """
    found = []
    for text in texts:
        name, slash, fault = text.rpartition('/')
        if slash and name not in mounts:
            known = ', '.join(each for each in mounts if each)
            reason = f'known are {known}' if known else 'there is one mount alone'
            raise ParameterError(f'fault {text!r:.60} names no mount: {reason}')
        if not slash or name == mount:
            found.append(fault)
    return found
