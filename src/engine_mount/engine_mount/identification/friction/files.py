"""Friction recordings from files of every format, from topics, and from the JSON of a friction damper.

Units end here: everything behind is in SI units.
"""

import json
import re
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from engine_mount.identification.fitting import FloatArray, IdentificationError
from engine_mount.identification.friction.recording import (
    COEFFICIENT_RANGE,
    DIRECTION_SPREAD,
    FrictionRecording,
    checked_recording,
)
from engine_mount.recordings.recording import recording_place
from engine_mount.signals.formats.cells import name_and_unit
from engine_mount.signals.formats.content import NOT_STATED, Stated
from engine_mount.signals.formats.measured import Measured, MeasuredColumn, Provenance
from engine_mount.signals.mapping import Mapping, with_options
from engine_mount.signals.quantities import Quantity, by_name
from engine_mount.signals.selection import select_rows
from engine_mount.signals.units import unit_of
from mount_models.quantity import nearest

_NEEDED = ('displacement', 'friction_force', 'normal_force')
FRICTION = by_name(
    Quantity(_NEEDED[0], 'length', 'displacement of the pads', 1e-6, 1.0, ('displacement.mount',)),
    Quantity(
        _NEEDED[1], 'force', 'friction force', 0.05, 1e7, ('sim/mount_force.wrench.force.z',), mapped='force'
    ),
    Quantity(_NEEDED[2], 'force', 'force on the pads', titles=('sim/clamp_force.wrench.force.z',)),
    Quantity('desired_displacement', 'length', 'command of the position control', 0.0, 1.0),
)
"""What identification needs of a rig; titles are topic and field in recordings of this project."""
CLAMPS = ('sliding', 'rest', 'none')
_RIG_HEADER = ('time_s', 'displacement_in', 'friction_force_kip', 'velocity_in_per_s')
_RIG_PULLS = ('actuator_1_lb', 'actuator_2_lb')
_REST = 0.1  # s at the beginning
_BAND_SPREAD = 0.8
"""Deviation of ln(mu_p / mu_n) of a band whose taut ends are not known (chosen): it tightens itself."""


def friction_mapping(
    texts: Sequence[str] = (), mapping: Mapping | None = None, stated: Stated = NOT_STATED
) -> Mapping:
    """Return the columns of a mapping, and of `--column NAME=COLUMN:UNIT` options, which go before it.

    Of a mapping these are displacement, force (or friction_force), normal force and time. Raises
    `SignalError`.
    """
    mapping = replace((mapping or Mapping()).of(FRICTION), option='--column {quantity}={column}:{unit}')
    return with_options(mapping, texts, known=FRICTION, stated=stated)


def read_recording(path: Path, mapping: Mapping | None = None, clamp: str = 'sliding') -> FrictionRecording:
    """Return the checked recording in `path`; `mapping` names columns or fields, `clamp` see `_read_damper`.

    Raises `IdentificationError` and the readers' errors.
    """
    mapping = mapping or friction_mapping()
    if not path.exists():
        raise IdentificationError(
            f'{path} does not exist; give a file of measured columns, or a recording or its folder'
        )
    # one matrix `data`, as that of the damper
    if path.suffix.lower() == '.json' and re.match(rb'\s*\{\s*"data"\s*:\s*\[\s*\[', path.read_bytes()[:200]):
        return _read_damper(path, mapping, clamp)
    columns = select_rows(recording_place(path), mapping, FRICTION, _NEEDED, timed=True)
    return checked_recording(path.name, columns.pop('time'), *(columns.get(name) for name in FRICTION))


def _read_damper(path: Path, mapping: Mapping, clamp: str) -> FrictionRecording:
    """Return a test of the measured friction damper: a band round a drum, an actuator pulls at either end.

    Columns: `_RIG_HEADER`, others by their number, and last `_RIG_PULLS`; `mapping` may name others, by name
    or number. The zero of its cell is not known; it follows from the loop (`look.subtract_zero`).

    What presses the band onto the drum is its tension. At rest that is the clamp that was set, but a band
    tightens itself while it slides: the taut end then carries the friction force, with a factor that depends
    on the surfaces of the day. `clamp` is what counts as normal force:

    - 'sliding': for each direction the median pull of its taut end over the whole test: two numbers, which
      show how strongly the band holds in this test, and nothing of when or how the force turns. An
      independent sensor measures them, but only during the test: the level of the force is then measured, not
      predicted;
    - 'rest': the two pulls together before the motion, known beforehand;
    - 'none': nothing is known of the clamp (1 N; coefficients are then forces in N).

    A channel `normal_force` is measured, and used instead of all this.
    """
    if clamp not in CLAMPS:
        raise IdentificationError(f'clamp {clamp!r} is unknown; {nearest(clamp, CLAMPS)}')
    table = _rig_table(path)
    columns = select_rows(table, mapping, FRICTION, _NEEDED[:2], timed=True)
    time, displacement = columns.pop('time'), columns['displacement']
    known = 'normal_force' in columns or clamp == 'sliding'
    notes: tuple[str, ...] = ()
    if 'normal_force' not in columns:
        pulls = np.column_stack([unit_of('lbf').to_si(table.column(each).values) for each in _RIG_PULLS])
        normal = _rig_normal_force(path.name, clamp, np.gradient(displacement, time), pulls, time)
        columns['normal_force'] = np.tile(normal, (time.size, 1))
        notes = (
            f'normal force ({clamp}): {normal[0]:.0f} N to the positive, {normal[1]:.0f} N to the negative '
            'side',
        )
    limits = COEFFICIENT_RANGE if known else (0.0, np.inf)
    values = (columns.get(name) for name in FRICTION)
    return replace(
        checked_recording(path.stem, time, *values, coefficient_range=limits),
        notes=notes,
        zero_from='law',
        direction_spread=DIRECTION_SPREAD if known else _BAND_SPREAD,
    )


def _rig_table(path: Path) -> Measured:
    try:
        data = np.array(json.loads(path.read_text(encoding='utf-8'))['data'], float)
    except (ValueError, KeyError, TypeError) as error:
        raise IdentificationError(
            f'{path.name} is no table ({error!r}); expected is {{"data": [[number, ...], ...]}}'
        ) from None
    known = (*_RIG_HEADER, *_RIG_PULLS)
    if data.ndim != 2 or data.shape[1] < len(known):
        raise IdentificationError(
            f'{path.name} holds data of shape {data.shape}; at least 50 rows of {len(known)} numbers are '
            f'needed: {", ".join(known)}'
        )
    between = map(str, range(len(_RIG_HEADER), data.shape[1] - len(_RIG_PULLS)))
    columns = {}
    for number, header in enumerate((*_RIG_HEADER, *between, *_RIG_PULLS)):
        name, unit, *_ = name_and_unit(header)
        columns[name] = MeasuredColumn(name, header, unit, number, values=data[:, number])
    return Measured(columns, Provenance(str(path), '', path.stat().st_size, 'JSON', 'json'))


def _rig_normal_force(
    name: str, clamp: str, velocity: FloatArray, pulls: FloatArray, time: FloatArray
) -> FloatArray:
    if clamp == 'none':
        return np.ones(2)
    if clamp == 'rest':
        levels = [pulls[time <= time[0] + _REST].mean(axis=0).sum()] * 2
    else:
        levels = []
        for sign in (1.0, -1.0):
            moving = sign * velocity > 0.05 * np.abs(velocity).max()
            if not moving.any():
                raise IdentificationError(
                    f'{name} moves to one side only (0 samples to the other); both are needed'
                )
            taut = pulls[moving, int(np.argmax(np.median(pulls[moving], axis=0)))]
            holding = taut[taut > 0.5 * np.percentile(taut, 95)]
            levels.append(float(np.median(holding)) if holding.size else 0.0)
    if min(levels) <= 1.0:
        when = 'before the motion' if clamp == 'rest' else 'while sliding'
        raise IdentificationError(
            f'{name}: the actuators pull {min(levels):.2f} N {when}; above 1 N is needed to know the clamp: '
            'use --clamp none'
        )
    return np.array(levels)
