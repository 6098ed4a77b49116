"""Which mount is between engine and chassis."""

from enum import IntEnum
from typing import NamedTuple

from mount_models.quantity import ParameterError


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
        raise ParameterError(f'mount {name!r} is unknown; known are {", ".join(MOUNTS)}')
    return _SEATED.get(name, SeatedMount())


def without_friction(name: str) -> str:
    """Return why a control can make no friction in a mount of `MOUNTS`, empty where it can."""
    seated = seated_mount(name)
    if seated.contents != Contents.PADS:
        return f'mount {name} has no friction contact'
    return f'in mount {name} the coil driver is open' if seated.driver_opens else ''
