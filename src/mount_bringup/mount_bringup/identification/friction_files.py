"""Friction recordings from files: rack CSV, MCAP, and the JSON of a measured friction damper.

Units end here: everything behind is in SI units.
"""

import json
import re
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from mount_bringup.recording_path import open_run
from mount_models.friction.identification.recording import (
    COEFFICIENT_RANGE,
    FloatArray,
    FrictionRecording,
    IdentificationError,
    checked_recording,
)

UNITS = {
    'm': 1.0, 'mm': 1e-3, 'um': 1e-6, 'in': 0.0254, 'inch': 0.0254,
    'n': 1.0, 'kn': 1e3, 'mn': 1e-3, 'lb': 4.4482216152605, 'kip': 4448.2216152605,
}  # fmt: skip
"""Factors to m and N; 1 lb = 4.4482216 N, 1 inch = 25.4 mm exactly."""
CLAMPS = ('sliding', 'rest', 'none')
TOPICS = {
    'displacement': ('displacement', 'mount'),
    'friction_force': ('sim/mount_force', 'wrench.force.z'),
    'normal_force': ('sim/clamp_force', 'wrench.force.z'),
}
_NEEDED = ('displacement', 'friction_force', 'normal_force')
_DESIRED = 'desired_displacement'
_REST = 0.1  # s at the beginning
_AT_REST = 0.01  # of the range of displacement


@dataclass(frozen=True)
class Channel:
    """Where a quantity is in a file: column, or `topic.field`, and the factor to SI units."""

    source: str
    factor: float | None = None


def read_recording(
    path: Path, channels: dict[str, Channel] | None = None, clamp: str = 'sliding'
) -> FrictionRecording:
    """Return the checked recording in `path`; `channels` name columns or topics, `clamp` see `_rig`."""
    chosen = channels or {}
    if not path.exists():
        raise IdentificationError(
            f'{path} does not exist; give a CSV, JSON or MCAP file or the folder of a recording'
        )
    if path.is_dir() or path.suffix == '.mcap':
        return _mcap(path, chosen)
    if path.suffix.lower() == '.json':
        return _rig(path, clamp)
    if path.suffix.lower() in ('.csv', '.txt'):
        return _csv(path, chosen)
    raise IdentificationError(
        f'{path.name}: files of type {path.suffix or "(none)"} are not read; use .csv, .json, .mcap'
    )


def parsed_channels(texts: list[str]) -> dict[str, Channel]:
    """Return the `--channel NAME=COLUMN:UNIT` options by name."""
    found = {}
    for text in texts:
        name, equals, rest = text.partition('=')
        source, _, unit = rest.rpartition(':') if ':' in rest else (rest, '', '')
        if name not in (*_NEEDED, _DESIRED, 'time') or not (equals and source):
            raise IdentificationError(
                f'--channel {text}: write NAME=COLUMN or NAME=COLUMN:UNIT with NAME one of '
                f'{", ".join((*_NEEDED, _DESIRED, "time"))}'
            )
        if unit and unit.lower() not in UNITS:
            raise IdentificationError(
                f'--channel {text}: unit {unit!r} is unknown; known are {", ".join(UNITS)}'
            )
        found[name] = Channel(source, UNITS[unit.lower()] if unit else None)
    return found


def _csv(path: Path, channels: dict[str, Channel]) -> FrictionRecording:
    from mount_sim.csv_table import read_table
    from mount_sim.recorded import signal_of

    table = read_table(path)
    header = list(table.header)
    time_column = channels['time'].source if 'time' in channels else ''
    times: FloatArray | None = None
    values: dict[str, FloatArray] = {}
    for name in (*_NEEDED, _DESIRED):
        place = channels.get(name) or _by_heading(header, name)
        if place is None:
            if name == _DESIRED:
                continue
            raise IdentificationError(
                f'{path.name} has no column for {name} (its columns: {", ".join(header)}); name it as in '
                f'--channel {name}=COLUMN:UNIT'
            )
        signal = signal_of(table, place.source, time_column)
        factor = place.factor if place.factor is not None else _factor_of(place.source, name, path.name)
        times, values[name] = signal.times, signal.values * factor
    assert times is not None
    return checked_recording(
        path.name, times, values['displacement'], values['friction_force'], values['normal_force'],
        values.get(_DESIRED),
    )  # fmt: skip


def _by_heading(header: list[str], name: str) -> Channel | None:
    return next((Channel(each) for each in header if re.fullmatch(rf'{name}(_\w+)?', each.lower())), None)


def _factor_of(column: str, name: str, file: str) -> float:
    unit = column.lower().rpartition('_')[2]
    if unit not in UNITS:
        raise IdentificationError(
            f'{file}: column {column} does not say its unit; name it as in --channel {name}={column}:'
            f'{"mm" if "displacement" in name else "N"}'
        )
    return UNITS[unit]


def _mcap(path: Path, channels: dict[str, Channel]) -> FrictionRecording:
    recording = open_run(path)
    series = {}
    for name, (topic, field) in TOPICS.items():
        factor = 1.0
        if name in channels:
            topic, _, field = channels[name].source.partition('.')
            factor = channels[name].factor or 1.0
        if topic not in recording:
            raise IdentificationError(
                f'{path} has no topic {topic} (for {name}); it has {", ".join(recording) or "none"}: name '
                f'one as in --channel {name}=/topic.field'
            )
        one = recording[topic]
        if not len(one):
            raise IdentificationError(f'{path}: {topic} has 0 messages; at least 50 are needed')
        series[name] = (np.asarray(one.time, float), factor * np.asarray(one[field], float))
    time, displacement = series['displacement']
    first, last = (pick(each[0][place] for each in series.values()) for pick, place in ((max, 0), (min, -1)))
    inside = (time >= first) & (time <= last)
    time = time[inside]
    force, clamp = (np.interp(time, *series[name]) for name in ('friction_force', 'normal_force'))
    return checked_recording(path.name, time, displacement[inside], force, clamp)


def _rig(path: Path, clamp: str) -> FrictionRecording:
    """Return a test of the measured friction damper: a band round a drum, an actuator pulls at either end.

    Columns: time s, displacement inch, friction force kip, velocity inch/s (not used), ..., and last the pull
    of the two actuators in lb. The force's zero is that of the rest before the motion.

    What presses the band onto the drum is its tension. At rest that is the clamp that was set, but a band
    tightens itself while it slides: the taut end then carries the friction force, with a factor that depends
    on the surfaces of the day. `clamp` says what counts as normal force:

    - 'sliding': for each direction the median pull of its taut end over the whole test: two numbers, which
      say how strongly the band holds in this test, and nothing of when or how the force turns. An independent
      sensor measures them, but only during the test: the level of the force is then measured, not foretold;
    - 'rest': the two pulls together before the motion, known beforehand;
    - 'none': nothing is known of the clamp (1 N; coefficients are then forces in N).
    """
    table = _rig_table(path)
    time = table[:, 0]
    displacement, force = UNITS['in'] * table[:, 1], UNITS['kip'] * table[:, 2]
    notes = []
    quiet = time <= time[0] + _REST
    if np.ptp(displacement[quiet]) <= _AT_REST * np.ptp(displacement):
        zero = float(force[quiet].mean())
        force = force - zero
        notes.append(f'force zero {zero:.1f} N, from the {_REST:g} s of rest at the beginning')
    else:
        notes.append('force zero as recorded: there is no rest at the beginning')
    pulls = UNITS['lb'] * table[:, -2:]
    normal = _rig_normal_force(path.name, clamp, np.gradient(displacement, time), pulls, quiet)
    notes.append(
        f'normal force ({clamp}): {normal[0]:.0f} N to the positive, {normal[1]:.0f} N to the negative side'
    )
    return checked_recording(
        path.stem,
        time,
        displacement,
        force,
        np.tile(normal, (time.size, 1)),
        notes=tuple(notes),
        coefficient_range=COEFFICIENT_RANGE if clamp == 'sliding' else (0.0, np.inf),
    )


def _rig_table(path: Path) -> FloatArray:
    try:
        content = json.loads(path.read_text(encoding='utf-8'))
        table = np.array(content['data'], float)
    except (ValueError, KeyError, TypeError) as error:
        raise IdentificationError(
            f'{path.name} is no recording of the friction damper ({error!r}); expected is {{"data": [['
            'time s, displacement inch, friction force kip, velocity inch/s, actuator 1 lb, actuator 2 lb], '
            '...]}'
        ) from None
    if table.ndim != 2 or table.shape[0] < 2 or table.shape[1] < 6:
        raise IdentificationError(
            f'{path.name} holds data of shape {table.shape}; at least 50 rows of 6 numbers are needed'
        )
    if not np.isfinite(table).all():
        row = int(np.argmax(~np.isfinite(table).all(axis=1)))
        raise IdentificationError(
            f'{path.name}: row {row} holds a value that is no number; repair or cut it there'
        )
    return table


def _rig_normal_force(
    name: str, clamp: str, velocity: FloatArray, pulls: FloatArray, quiet: FloatArray
) -> FloatArray:
    if clamp not in CLAMPS:
        raise IdentificationError(f'clamp {clamp!r} must be one of {", ".join(CLAMPS)}')
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
