"""Quantities of a friction recording, and how columns are chosen for them."""

from collections.abc import Sequence
from dataclasses import replace

from engine_mount.signals.formats.content import Stated
from engine_mount.signals.mapping import Mapping, with_options
from engine_mount.signals.quantities import Quantity, by_name

NEEDED = ('displacement', 'friction_force', 'normal_force')
DESIRED = 'desired_displacement'
FRICTION = by_name(
    Quantity(NEEDED[0], 'length', 'displacement of the pads', 1e-6, 1.0, ('displacement.mount',)),
    Quantity(
        NEEDED[1], 'force', 'friction force', 0.05, 1e7, ('sim/mount_force.wrench.force.z',), mapped='force'
    ),
    Quantity(NEEDED[2], 'force', 'force on the pads', titles=('sim/clamp_force.wrench.force.z',)),
    Quantity(DESIRED, 'length', 'displacement that the position control was given', 0.0, 1.0),
)
"""What identification needs of a rig; titles are topic and field in recordings of this project."""


def friction_mapping(
    texts: Sequence[str] = (), mapping: Mapping | None = None, stated: Stated | None = None
) -> Mapping:
    """Return what a mapping says, and the `--channel NAME=COLUMN:UNIT` options, which go before it.

    Of a mapping these are displacement, force (or friction_force), normal force and time. Raises
    `SignalError`.
    """
    mapping = replace((mapping or Mapping()).of(FRICTION), option='--channel {quantity}={column}:{unit}')
    return with_options(mapping, texts, known=FRICTION, stated=stated)
