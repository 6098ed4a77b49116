"""Identify parameters from recordings: `friction` of the pads, and `drift` over many drives.

Each function returns a result with `figures()` in SI units, `report(screen)` for people and `draw(file)`.
"""

from __future__ import annotations

import os
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from engine_mount.identification.drift import DriftResult
    from engine_mount.identification.friction.result import FrictionIdentification
    from engine_mount.signals import mapping

Place = str | os.PathLike[str]


def friction(
    train: Sequence[Place] = (),
    held_out: Sequence[Place] = (),
    *,
    files: Sequence[Place] = (),
    step: str = 'auto',
    clamp: str = 'sliding',
    zero: str = '',
    columns: mapping.Mapping | dict[str, str] | None = None,
    seed: int = 0,
    base: Place = '',
    progress: Callable[[float, str], None] = lambda share, law: None,
) -> FrictionIdentification:
    """Return the friction contact in recordings, and which law is worth its parameters.

    Laws are fitted to `train` and judged by `held_out`; or trained on each of `files` and tried on each other
    one, of one file on its halves. `step` is auto, or only ramp (step 1), sawtooth or ladder; `clamp` is the
    normal force of a damper's JSON (sliding, rest, none), `zero` the source of the zero of the force (law,
    rest, recorded; '' for the default of each kind of file). `columns` is
    {quantity: 'COLUMN:UNIT'}. `base` is the specimen file that gives all other values, the shipped one
    without. Raises `IdentificationError` and the readers' errors.
    """
    from engine_mount.identification.friction.files import friction_mapping
    from engine_mount.identification.friction.identification import identify_friction
    from mount_models.specimen import chosen_specimen

    if isinstance(columns, dict):
        columns = friction_mapping([f'{name}={text}' for name, text in columns.items()])
    paths = ([Path(place) for place in places] for places in (train, held_out, files))
    return identify_friction(chosen_specimen(str(base)), *paths, step, clamp, zero, columns, seed, progress)


def drift(
    recordings: Sequence[Place], *, hours: Mapping[Path, float] | None = None, specimen: Place = ''
) -> DriftResult:
    """Return wear of the pads and other drift per hour over recordings with an initialisation.

    Times are `hours` of all recordings by their paths (a counter), else when their sessions began. `specimen`
    is the file of this actuator, the shipped one without. Raises `IdentificationError` and the readers'
    errors.
    """
    from engine_mount.identification.drift import identify_drift
    from mount_models.specimen import chosen_specimen

    return identify_drift([Path(each) for each in recordings], chosen_specimen(str(specimen)), hours)
