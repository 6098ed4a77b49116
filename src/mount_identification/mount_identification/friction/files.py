"""Friction recordings from files: rack CSV, MCAP, and the JSON of a measured friction damper.

Units end here: everything behind is in SI units.
"""

import re
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from mount_bags.run.place import open_run
from mount_bags.signals.csv_file import read_csv
from mount_bags.signals.json_file import read_json
from mount_bags.signals.table import Table
from mount_identification.friction.recording import (
    COEFFICIENT_RANGE,
    DIRECTION_SPREAD,
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
_RIG_HEADER = ('time_s', 'displacement_in', 'friction_force_kip', 'velocity_in_per_s')
_RIG_PULLS = ('actuator_1_lb', 'actuator_2_lb')
_REST = 0.1  # s at the beginning
_BAND_SPREAD = 0.8
"""Deviation of ln(mu_p / mu_n) of a band whose taut ends are not told (chosen): it tightens itself."""


@dataclass(frozen=True)
class Channel:
    """Where a quantity is in a file: column, or `topic.field`, and the factor to SI units."""

    source: str
    factor: float | None = None


def read_recording(
    path: Path, channels: dict[str, Channel] | None = None, clamp: str = 'sliding'
) -> FrictionRecording:
    """Return the checked recording in `path`; `channels` name columns or topics, `clamp` see `_rig`.

    Raises `IdentificationError` and the readers' errors.
    """
    chosen = channels or {}
    if not path.exists():
        raise IdentificationError(
            f'{path} does not exist; give a CSV, JSON or MCAP file or the folder of a recording'
        )
    if path.is_dir() or path.suffix == '.mcap':
        return _mcap(path, chosen)
    if path.suffix.lower() == '.json':
        return _rig(path, chosen, clamp)
    if path.suffix.lower() in ('.csv', '.txt'):
        return _rack(read_csv(path), chosen)
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
        if name == 'time' and unit:
            raise IdentificationError(f'--channel {text}: time is in s and takes no unit; write time=COLUMN')
        found[name] = Channel(source, UNITS[unit.lower()] if unit else None)
    return found


def _rack(table: Table, channels: dict[str, Channel]) -> FrictionRecording:
    columns = _columns(table, channels, _NEEDED)
    return checked_recording(
        table.path.name, columns['time'], columns['displacement'], columns['friction_force'],
        columns['normal_force'], columns.get(_DESIRED),
    )  # fmt: skip


def _columns(table: Table, channels: dict[str, Channel], needed: tuple[str, ...]) -> dict[str, FloatArray]:
    """Return the time (s) and the quantities in SI units, by channel or by heading."""
    header = list(table.header)
    places = {'time': table.time_place(channels['time'].source if 'time' in channels else '')}
    factors = {'time': 1.0}
    for name in (*_NEEDED, _DESIRED):
        channel = channels.get(name) or _by_heading(header, name)
        if channel is None:
            if name not in needed:
                continue
            raise IdentificationError(
                f'{table.path.name} has no column for {name} (its columns: {", ".join(header)}); name it as '
                f'in --channel {name}=COLUMN:UNIT'
            )
        places[name] = table.place(channel.source)
        factors[name] = (
            _factor_of(header[places[name]], name, table.path.name)
            if channel.factor is None
            else channel.factor
        )
    rows = table.columns(*places.values())
    return {name: factors[name] * row for name, row in zip(places, rows, strict=True)}


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
    if 'time' in channels:
        raise IdentificationError(
            f'{path}: the times of a recording are its stamps; leave --channel '
            f'time={channels["time"].source} out'
        )
    recording = open_run(path)
    series = {}
    for name in (*_NEEDED, *({_DESIRED} & channels.keys())):
        topic, field = TOPICS.get(name, ('', ''))
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
    matched = {name: np.interp(time, *each) for name, each in series.items() if name != 'displacement'}
    return checked_recording(
        path.name, time, displacement[inside], matched['friction_force'], matched['normal_force'],
        matched.get(_DESIRED),
    )  # fmt: skip


def _rig(path: Path, channels: dict[str, Channel], clamp: str) -> FrictionRecording:
    """Return a test of the measured friction damper: a band round a drum, an actuator pulls at either end.

    Columns: `_RIG_HEADER`, others by their number, and last `_RIG_PULLS`; `channels` may name others, by name
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
    columns = _columns(table, channels, _NEEDED[:2])
    time, displacement, force = columns['time'], columns['displacement'], columns['friction_force']
    notes = []
    quiet = time <= time[0] + _REST
    measured = columns.get('normal_force')
    if measured is None:
        pulls = UNITS['lb'] * table.columns(*map(table.place, _RIG_PULLS)).T
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
        columns.get(_DESIRED),
        notes=tuple(notes),
        coefficient_range=COEFFICIENT_RANGE if measured is not None or clamp == 'sliding' else (0.0, np.inf),
    )
    return replace(
        recording,
        zero_from='law',
        direction_spread=DIRECTION_SPREAD if measured is not None or clamp == 'sliding' else _BAND_SPREAD,
    )


def _rig_table(path: Path) -> Table:
    table = read_json(path)
    width, known = len(table.header), (*_RIG_HEADER, *_RIG_PULLS)
    if width < len(known):
        raise IdentificationError(
            f'{path.name} holds data of shape ({len(table.rows)}, {width}); at least 50 rows of {len(known)} '
            f'numbers are needed: {", ".join(known)}'
        )
    between = table.header[len(_RIG_HEADER) : -len(_RIG_PULLS)]
    return replace(table, header=(*_RIG_HEADER, *between, *_RIG_PULLS))


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
