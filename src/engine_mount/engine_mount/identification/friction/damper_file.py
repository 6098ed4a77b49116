"""The JSON of a measured friction damper: a band round a drum, an actuator pulls at either end."""

import json
import re
from dataclasses import replace
from pathlib import Path

import numpy as np

from engine_mount.identification.friction.channels import DESIRED, FRICTION, NEEDED
from engine_mount.identification.friction.recording import (
    COEFFICIENT_RANGE,
    DIRECTION_SPREAD,
    FloatArray,
    FrictionRecording,
    IdentificationError,
    checked_recording,
)
from engine_mount.signals.formats.headers import name_and_unit
from engine_mount.signals.formats.measured import Measured, MeasuredColumn, Provenance
from engine_mount.signals.mapping import Mapping
from engine_mount.signals.selection import select_rows
from engine_mount.signals.units import unit_of

CLAMPS = ('sliding', 'rest', 'none')
_RIG_HEADER = ('time_s', 'displacement_in', 'friction_force_kip', 'velocity_in_per_s')
_RIG_PULLS = ('actuator_1_lb', 'actuator_2_lb')
_REST = 0.1  # s at the beginning
_BAND_SPREAD = 0.8
"""Deviation of ln(mu_p / mu_n) of a band whose taut ends are not told (chosen): it tightens itself."""


def read_damper(path: Path, mapping: Mapping, clamp: str) -> FrictionRecording:
    """Return a test of the measured friction damper: a band round a drum, an actuator pulls at either end.

    Columns: `_RIG_HEADER`, others by their number, and last `_RIG_PULLS`; `mapping` may name others, by name
    or number. The zero of its cell is not known; the loop tells it (`looks/force_zero.py`).

    What presses the band onto the drum is its tension. At rest that is the clamp that was set, but a band
    tightens itself while it slides: the taut end then carries the friction force, with a factor that depends
    on the surfaces of the day. `clamp` says what counts as normal force:

    - 'sliding': for each direction the median pull of its taut end over the whole test: two numbers, which
      say how strongly the band holds in this test, and nothing of when or how the force turns. An independent
      sensor measures them, but only during the test: the level of the force is then measured, not foretold;
    - 'rest': the two pulls together before the motion, known beforehand;
    - 'none': nothing is known of the clamp (1 N; coefficients are then forces in N).

    A channel `normal_force` is measured, and taken instead of all this.
    """
    if clamp not in CLAMPS:
        raise IdentificationError(f'clamp {clamp!r} must be one of {", ".join(CLAMPS)}')
    table = _rig_table(path)
    columns = select_rows(table, mapping, FRICTION, NEEDED[:2], timed=True)
    time, displacement, force = columns['time'], columns['displacement'], columns['friction_force']
    notes = []
    quiet = time <= time[0] + _REST
    measured = columns.get('normal_force')
    if measured is None:
        pulls = np.column_stack([unit_of('lbf').to_si(table.column(each).values) for each in _RIG_PULLS])
        normal = _rig_normal_force(path.name, clamp, np.gradient(displacement, time), pulls, quiet)
        notes.append(
            f'normal force ({clamp}): {normal[0]:.0f} N to the positive, {normal[1]:.0f} N to the negative '
            'side'
        )
    recording = checked_recording(
        path.stem,
        time,
        displacement,
        force,
        np.tile(normal, (time.size, 1)) if measured is None else measured,
        columns.get(DESIRED),
        notes=tuple(notes),
        coefficient_range=COEFFICIENT_RANGE if measured is not None or clamp == 'sliding' else (0.0, np.inf),
    )
    return replace(
        recording,
        zero_from='law',
        direction_spread=DIRECTION_SPREAD if measured is not None or clamp == 'sliding' else _BAND_SPREAD,
    )


def is_damper(path: Path) -> bool:
    """Return whether a JSON file holds one matrix `data`, as that of the damper does."""
    head = path.read_bytes()[:200]
    return re.match(rb'\s*\{\s*"data"\s*:\s*\[\s*\[', head) is not None


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
    columns = [
        MeasuredColumn(*name_and_unit(header)[:1], header, name_and_unit(header)[1], number, values=values)
        for number, (header, values) in enumerate(
            zip((*_RIG_HEADER, *between, *_RIG_PULLS), data.T, strict=True)
        )
    ]
    provenance = Provenance(str(path), '', path.stat().st_size, 'JSON', 'json')
    return Measured({column.name: column for column in columns}, provenance)


def _rig_normal_force(
    name: str, clamp: str, velocity: FloatArray, pulls: FloatArray, quiet: FloatArray
) -> FloatArray:
    if clamp == 'none':
        return np.ones(2)
    if clamp == 'rest':
        level = float(pulls[quiet].mean(axis=0).sum())
        _check_pull(name, level, 'before the motion')
        return np.full(2, level)
    found = []
    for sign in (1.0, -1.0):
        moving = sign * velocity > 0.05 * np.abs(velocity).max()
        if not moving.any():
            raise IdentificationError(
                f'{name} moves to one side only (0 samples to the other); both are needed'
            )
        taut = pulls[moving, int(np.argmax(np.median(pulls[moving], axis=0)))]
        holding = taut[taut > 0.5 * np.percentile(taut, 95)]
        level = float(np.median(holding)) if holding.size else 0.0
        _check_pull(name, level, 'while sliding')
        found.append(level)
    return np.array(found)


def _check_pull(name: str, level: float, when: str) -> None:
    if level <= 1.0:
        raise IdentificationError(
            f'{name}: the actuators pull {level:.2f} N {when}; above 1 N is needed to know the clamp: '
            'use --clamp none'
        )
