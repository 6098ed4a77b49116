"""Force points and coil ripple of a rack, from files of every format and from topics, for calibrations."""

import re
from collections.abc import Mapping as Keys
from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path
from typing import TypeAlias

import numpy as np

from engine_mount.identification.fitting import FloatArray, IdentificationError
from engine_mount.identification.force_points import ForcePoints, gap_groups
from engine_mount.identification.gap_curves import RippleRecording
from engine_mount.recordings.recording import open_run, recording_hash, recording_place
from engine_mount.signals.formats.reading import is_recording
from engine_mount.signals.mapping import Mapping
from engine_mount.signals.quantities import Quantity, by_name
from engine_mount.signals.selection import select_rows
from engine_mount.signals.units import ZERO_CELSIUS
from mount_models.coil.gap import measured_inductance
from mount_ros.topics import COIL_RIPPLE, COIL_TEMPERATURE

_by_size = partial(Quantity, by_size=True)
RACK = by_name(
    _by_size('gap', 'length', 'air gap', 20e-6, 5e-3, mapped='air_gap'),
    _by_size('current', 'current', 'current of the coil', 0.05, 20.0, (f'{COIL_RIPPLE.name}.coil_current',)),
    _by_size('force', 'force', 'force of the actuator', 2.0, 2e4, ('sim/clamp_force.wrench.force.z',)),
    _by_size('inductance', 'inductance', 'inductance of the coil', 1e-3, 1.0),
    _by_size('current_rate', 'current/time', 'slope of the current', 10.0, 1e5),
    _by_size('flux_rate', 'flux density/time', 'slope of the flux density', 5.0, 1e5),
    _by_size(
        'coil_temperature',
        'temperature',
        'temperature of the coil',
        213.15,
        523.15,
        mapped='temperature',
    ),
)
"""What a rack measures, with the range of its largest value; titles are topic and field in recordings."""

Choices: TypeAlias = Mapping | Keys[str, str]
"""The columns of files: a mapping, or {quantity: 'COLUMN:UNIT'}."""
_GAP_IN_NAME = re.compile(r'(?<![\d.])(\d+(?:\.\d+)?)um(?![a-z])', re.IGNORECASE)
_CELSIUS_IN_NAME = re.compile(r'([+-]?\d+(?:\.\d+)?)degC', re.IGNORECASE)
_FEWEST = 8  # chosen: fewer points are no measurement
_LONGEST_STUCK = 12  # rows, chosen: coarse converters repeat themselves for a few
_BINS = 100  # chosen: points from one recorded ramp
_LARGEST_INVALID = 0.1  # share, chosen
_LARGEST_DRIFT = 10.0  # K, chosen: 1 um or two of the gap to either side


@dataclass(frozen=True)
class FileValues:
    """What is known of single files beside their content: gap (m), coil temperature (degC).

    `celsius_of_others` is the coil temperature of files without one.
    """

    gap: Keys[Path, float] = field(default_factory=dict)
    celsius: Keys[Path, float] = field(default_factory=dict)
    celsius_of_others: float | None = None

    def gap_of(self, file: Path) -> float:
        """Return the gap (m) that is given or in the name; raises `IdentificationError` without either."""
        if file in self.gap:
            return self.gap[file]
        named = _GAP_IN_NAME.search(_bare_name(file))
        if named is None:
            kind = '' if file.is_dir() else file.suffix
            raise IdentificationError(
                f'{file}: its air gap is not known; add --gap {file.name}=UM, a column gap_um, or the gap to '
                f'its name, as in ripple_349um{kind}'
            )
        return float(named[1]) * 1e-6

    def celsius_of(self, file: Path) -> float:
        """Return the temperature (degC) that is given or in the name; raises `IdentificationError`."""
        named = _CELSIUS_IN_NAME.search(_bare_name(file))
        celsius = self.celsius.get(file, float(named[1]) if named else self.celsius_of_others)
        if celsius is None:
            raise IdentificationError(
                f'{file}: the temperature of its coil is not known; add --coil-temperature DEGC for all '
                f'files, {file.name}=DEGC for this one, or a column coil_temperature_c'
            )
        return celsius


def read_force(files: Sequence[Path], mapping: Choices, values: FileValues) -> ForcePoints:
    """Return the points of all files, each with a gap by column, by option or by its name.

    Raises `IdentificationError` and the readers' errors.
    """
    parts, known = [], {name: RACK[name] for name in ('current', 'force', 'gap')}
    for file in _checked_files(files):
        place = recording_place(file)
        columns = select_rows(place, mapping, known, ('current', 'force'))
        current, force = columns['current'], columns['force']
        _check_size(file, force)
        _check_alive(file, 'current', 'A', current)
        _check_alive(file, 'force', 'N', force, current)
        if is_recording(place):
            current, force = _means(current, force)
        held = file in values.gap or 'gap' not in columns
        parts.append(
            (np.full(current.shape, values.gap_of(file)) if held else columns['gap'], current, force)
        )
    return ForcePoints(*(np.concatenate(column) for column in zip(*parts, strict=True)))


def _means(current: FloatArray, force: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return up to `_BINS` points of a recorded ramp: means over small steps of the current."""
    known = current >= 0.0
    current, force = current[known], force[known]
    steps = np.minimum((current / current.max() * _BINS).astype(int), _BINS - 1)
    means = np.array([(current[steps == k].mean(), force[steps == k].mean()) for k in np.unique(steps)])
    return means[:, 0], means[:, 1]


def read_ripple(
    files: Sequence[Path], mapping: Choices, values: FileValues, turns_area: float
) -> list[RippleRecording]:
    """Return one recording for each file and gap; `turns_area` (m^2) makes inductances of slopes.

    Raises `IdentificationError` and the readers' errors.
    """
    recordings: list[RippleRecording] = []
    for file in _checked_files(files):
        # topics of this project have fixed meanings
        is_table = not is_recording(recording_place(file)) or COIL_RIPPLE.name not in open_run(file)
        read = _ripple_from_table if is_table else _ripple_from_topics
        recordings += read(file, mapping, values, turns_area)
    for recording in recordings:
        share = np.mean(~(recording.inductance > 0.0))
        if share > _LARGEST_INVALID:
            raise IdentificationError(
                f'{recording.name}: {share:.0%} of the inductances are not positive, at most '
                f'{_LARGEST_INVALID:.0%} may be; check polarity of the coil and of its sensors'
            )
    return recordings


def _ripple_from_table(
    file: Path, mapping: Choices, values: FileValues, turns_area: float
) -> list[RippleRecording]:
    columns = select_rows(
        recording_place(file), mapping, {name: RACK[name] for name in RACK if name != 'force'}, ()
    )
    if 'current' not in columns or np.ptp(columns['current']) == 0.0:
        raise IdentificationError(
            f'{file} has no current that changes; gap curves need inductance over current at each gap, from '
            'the rest current until the core saturates: record it, or choose its column with --column '
            'current=HEADER:UNIT'
        )
    current, celsius = columns['current'], columns.get('coil_temperature')
    if celsius is not None:
        celsius = np.round(celsius - ZERO_CELSIUS, 9)  # 20 degC stay 20 to the bit on the way over K
    _check_size(file, current)
    if 'inductance' in columns:
        inductance = columns['inductance']
    elif 'current_rate' in columns and 'flux_rate' in columns:
        inductance = measured_inductance(turns_area, columns['flux_rate'], columns['current_rate'])
    else:
        raise IdentificationError(
            f'{file} must have a column inductance_mh, or current_rate_a_per_s and flux_rate_t_per_s; choose '
            'them with --column NAME=HEADER:UNIT'
        )
    _check_alive(file, 'inductance', 'H', inductance, current)
    by_column = 'gap' in columns and file not in values.gap
    gaps = columns['gap'] if by_column else np.full(current.shape, values.gap_of(file))
    groups, recordings = gap_groups(gaps), []
    for rows in map(np.sort, groups):
        gap = float(gaps[rows].mean())
        told = celsius is None or file in values.celsius
        degrees = values.celsius_of(file) if told else _settled(file, celsius[rows])
        name = file.name if len(groups) == 1 else f'{file.name} at {gap * 1e6:.1f} um'
        recordings.append(RippleRecording(name, gap, degrees, current[rows], inductance[rows]))
    return recordings


def _ripple_from_topics(
    file: Path, mapping: Choices, values: FileValues, turns_area: float
) -> list[RippleRecording]:
    recording = open_run(file)
    series, warmth = recording[COIL_RIPPLE.name], COIL_TEMPERATURE.name
    flux_rate, current_rate = (series.derivative(name) for name in ('flux_density', 'coil_current'))
    inductance = measured_inductance(turns_area, flux_rate, current_rate)
    current = series['coil_current']
    _check_alive(file, 'current', 'A', current[np.isfinite(current)])
    if file not in values.celsius and warmth in recording and len(recording[warmth]):
        celsius = _settled(file, recording[warmth]['temperature'])
    else:
        celsius = values.celsius_of(file)
    return [RippleRecording(file.name, values.gap_of(file), celsius, current, inductance)]


def _settled(file: Path, celsius: FloatArray) -> float:
    """Return the mean of the coil's temperatures (degC); raises `IdentificationError` if they ran away."""
    if np.ptp(celsius) > _LARGEST_DRIFT:
        raise IdentificationError(
            f'{file}: the coil temperature ran from {celsius.min():.1f} to {celsius.max():.1f} degC, it may '
            f'by {_LARGEST_DRIFT:g} K; let the coil settle, and give each temperature a file of its own'
        )
    return float(celsius.mean())


def _checked_files(files: Sequence[Path]) -> Sequence[Path]:
    """Return the files, each of which must be there, and none twice; raises `IdentificationError`."""
    seen: dict[str, Path] = {}
    for file in files:
        if not file.exists():
            raise IdentificationError(f'{file} does not exist; give files of measured columns, or recordings')
        first = seen.setdefault(recording_hash(file), file)
        if first is not file:
            raise IdentificationError(f'{file} and {first} are the same to the bit; give each recording once')
    return files


def _check_size(file: Path, values: FloatArray) -> None:
    if values.size < _FEWEST:
        raise IdentificationError(
            f'{file} holds {values.size} points, at least {_FEWEST} are needed; measure more currents'
        )


def _check_alive(
    file: Path, name: str, unit: str, values: FloatArray, driven: FloatArray | None = None
) -> None:
    """Raise `IdentificationError` for a channel that is constant, or stuck while the `driven` one changes."""
    if np.ptp(values) == 0.0:
        raise IdentificationError(
            f'{file}: {name} is constant ({values[0]:g} {unit} in all {values.size} rows); is its sensor '
            'connected, and the right column chosen?'
        )
    if driven is None:
        return
    same = (np.diff(values) == 0.0) & (np.diff(driven) != 0.0)
    ends = np.flatnonzero(np.concatenate([[True], ~same, [True]]))
    longest, start = int(np.diff(ends).max()), int(ends[np.argmax(np.diff(ends))])
    if longest > _LONGEST_STUCK:
        raise IdentificationError(
            f'{file}: {name} stayed at {values[start]:g} {unit} for {longest} rows from row {start + 1} on '
            f'while the current changed, more than {_LONGEST_STUCK}; the sensor is stuck: leave these rows '
            'out'
        )


def _bare_name(file: Path) -> str:
    """Return the name without the kind of file; a folder's has none, whatever stands behind its last dot."""
    return file.name if file.is_dir() else file.stem
