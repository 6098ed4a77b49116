"""Rack recordings as the calibrations take them: force points and ripple, from CSV and MCAP."""

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from mount_bags.bag.recording import Recording
from mount_bags.run.place import open_run, recording_hash
from mount_identification.actuator.points import gap_groups
from mount_identification.coil.gap_point import RippleRecording
from mount_identification.rack.columns import (
    CURRENT,
    CURRENT_RATE,
    FLUX_RATE,
    FORCE,
    GAP,
    INDUCTANCE,
    TEMPERATURE,
    RackRecordingError,
    check_alive,
    read_columns,
)
from mount_identification.rack.measured_table import in_topics
from mount_models.coil.gap import measured_inductance
from mount_ros.topics import COIL_RIPPLE, COIL_TEMPERATURE
from mount_signals.formats.content import Stated
from mount_signals.units.mapping import ColumnChoice

FloatArray = NDArray[np.float64]
FORCE_SIGNAL = 'sim/clamp_force:wrench.force.z'


@dataclass(frozen=True)
class ForcePoints:
    """Measured points, rows of one length: gap (m), current (A), force (N)."""

    gap: FloatArray
    current: FloatArray
    force: FloatArray


@dataclass(frozen=True)
class GivenValues:
    """What the caller says of single files, by their names as given: gap (m), coil temperature (degC).

    `stated` is what no file tells of itself.
    """

    gap: Mapping[Path, float]
    celsius: Mapping[Path, float]
    celsius_of_others: float | None = None
    stated: Stated = field(default_factory=Stated)


def read_force(files: Sequence[Path], chosen: Mapping[str, ColumnChoice], given: GivenValues) -> ForcePoints:
    """Return the points of all files, each with a gap by column, by option or by its name.

    Raises `RackRecordingError` and the readers' errors.
    """
    parts = []
    for file in _checked_files(files):
        if _is_table(file):
            known = given.gap.get(file)
            columns = read_columns(
                file, (*([] if known is not None else [GAP]), CURRENT, FORCE), (), chosen, given.stated
            )
            current, force = columns['current'], columns['force']
            gap = columns['gap'] if known is None else np.full(current.shape, known)
        else:
            gap, current, force = _force_from_bag(file, chosen, given)
        if force.size < _FEWEST:
            raise RackRecordingError(
                f'{file} holds {force.size} points, at least {_FEWEST} are needed; measure more currents'
            )
        check_alive(file, 'current', 'A', current, np.zeros(current.size))
        check_alive(file, 'force', 'N', force, current)
        parts.append((gap, current, force))
    return ForcePoints(*(np.concatenate(column) for column in zip(*parts, strict=True)))


def read_ripple(
    files: Sequence[Path], chosen: Mapping[str, ColumnChoice], given: GivenValues, turns_area: float
) -> list[RippleRecording]:
    """Return one recording for each file and gap; `turns_area` (m^2) makes inductances of slopes.

    Raises `RackRecordingError` and the readers' errors.
    """
    recordings = []
    for file in _checked_files(files):
        if _is_table(file):
            recordings += _ripple_from_table(file, chosen, given, turns_area)
        else:
            recordings.append(_ripple_from_bag(file, given, turns_area))
    for recording in recordings:
        if not np.all(recording.inductance > 0.0):
            share = float(np.mean(~(recording.inductance > 0.0)))
            if share > _LARGEST_INVALID:
                raise RackRecordingError(
                    f'{recording.name}: {share:.0%} of the inductances are not positive, at most '
                    f'{_LARGEST_INVALID:.0%} may be; check polarity of the coil and of its sensors'
                )
    return recordings


def described(files: Sequence[Path]) -> list[dict[str, str]]:
    """Return name and SHA-256 of each recording; of a folder, that of its files one after the other."""
    return [{'file': file.name, 'sha256': recording_hash(file)} for file in files]


_FEWEST = 8  # chosen: fewer points are no measurement
_LARGEST_INVALID = 0.1
_BINS = 100  # chosen: points from one recorded ramp
_GAP_IN_NAME = re.compile(r'(?<![\d.])(\d+(?:\.\d+)?)um(?![a-z])', re.IGNORECASE)
_CELSIUS_IN_NAME = re.compile(r'([+-]?\d+(?:\.\d+)?)degC', re.IGNORECASE)


def _checked_files(files: Sequence[Path]) -> Sequence[Path]:
    seen: dict[str, Path] = {}
    for file in files:
        if not file.exists():
            raise RackRecordingError(f'{file} does not exist; give files of measured columns, or recordings')
        digest = recording_hash(file)
        if digest in seen:
            raise RackRecordingError(
                f'{file} and {seen[digest]} are the same to the bit; give each recording once'
            )
        seen[digest] = file
    return files


def _is_table(file: Path) -> bool:
    """Return whether a file holds columns: no recording of this project, whose topics tell what is what."""
    return not in_topics(file) or COIL_RIPPLE.name not in open_run(file)


def _gap_of(file: Path, given: Mapping[Path, float]) -> float:
    """Return the gap (m) by option or by name; raises `RackRecordingError` without either."""
    if file in given:
        return given[file]
    named = _GAP_IN_NAME.search(_bare_name(file))
    if named is None:
        kind = '' if file.is_dir() else file.suffix
        raise RackRecordingError(
            f'{file}: its air gap is not known; add --gap {file.name}=UM, a column gap_um, or the gap to its '
            f'name, as in ripple_349um{kind}'
        )
    return float(named[1]) * 1e-6


def _bare_name(file: Path) -> str:
    """Return the name without the kind of file; a folder's has none, whatever stands behind its last dot."""
    return file.name if file.is_dir() else file.stem


def _celsius_of(file: Path, given: GivenValues) -> float:
    if file in given.celsius:
        return given.celsius[file]
    named = _CELSIUS_IN_NAME.search(_bare_name(file))
    if named is not None:
        return float(named[1])
    if given.celsius_of_others is None:
        raise RackRecordingError(
            f'{file}: the temperature of its coil is not known; add --coil-temperature DEGC for all files, '
            f'{file.name}=DEGC for this one, or a column coil_temperature_c'
        )
    return given.celsius_of_others


def _ripple_from_table(
    file: Path, chosen: Mapping[str, ColumnChoice], given: GivenValues, turns_area: float
) -> list[RippleRecording]:
    optional = (INDUCTANCE, CURRENT_RATE, FLUX_RATE, GAP, TEMPERATURE)
    columns = read_columns(file, (CURRENT,), optional, chosen, given.stated)
    current = columns['current']
    if current.size < _FEWEST:
        raise RackRecordingError(
            f'{file} holds {current.size} samples, at least {_FEWEST} are needed; record more'
        )
    if 'inductance' in columns:
        inductance = columns['inductance']
    elif 'current_rate' in columns and 'flux_rate' in columns:
        inductance = measured_inductance(turns_area, columns['flux_rate'], columns['current_rate'])
    else:
        raise RackRecordingError(
            f'{file} must have a column inductance_mh, or current_rate_a_per_s and flux_rate_t_per_s; choose '
            f'them with --column NAME=HEADER:UNIT'
        )
    check_alive(file, 'current', 'A', current, np.zeros(current.size))
    check_alive(file, 'inductance', 'H', inductance, current)
    if 'gap' in columns and file not in given.gap:
        gaps = columns['gap']
    else:
        gaps = np.full(current.shape, _gap_of(file, given.gap))
    groups = gap_groups(gaps)
    recordings = []
    for group in groups:
        parts = _of_one_temperature(np.sort(group), columns.get('coil_temperature'))
        for rows in parts:
            name = file.name if len(groups) == 1 else f'{file.name} at {gaps[rows].mean() * 1e6:.1f} um'
            celsius = _celsius(file, columns, rows, given)
            name += f', {celsius:.0f} degC' if len(parts) > 1 else ''
            recordings.append(
                RippleRecording(name, float(gaps[rows].mean()), celsius, current[rows], inductance[rows])
            )
    return recordings


def _of_one_temperature(rows: NDArray[np.intp], celsius: FloatArray | None) -> list[NDArray[np.intp]]:
    """Return the rows in parts between which the coil's temperature (degC) leaves a gap, coldest first."""
    if celsius is None:
        return [rows]
    order = rows[np.argsort(celsius[rows], kind='stable')]
    parts = np.split(order, np.flatnonzero(np.diff(celsius[order]) > _TEMPERATURES_APART) + 1)
    return [np.sort(part) for part in parts]


def _celsius(
    file: Path, columns: Mapping[str, FloatArray], rows: NDArray[np.intp], given: GivenValues
) -> float:
    if 'coil_temperature' not in columns or file in given.celsius:
        return _celsius_of(file, given)
    return _settled(file, columns['coil_temperature'][rows])


def _settled(file: Path, values: FloatArray) -> float:
    """Return the mean of the coil's temperatures (degC); raises `RackRecordingError` if they ran away."""
    if np.ptp(values) > _LARGEST_DRIFT:
        raise RackRecordingError(
            f'{file}: the coil temperature ran from {values.min():.1f} to {values.max():.1f} degC, it may by '
            f'{_LARGEST_DRIFT:g} K; let the coil settle between recordings, or make them shorter'
        )
    return float(values.mean())


_TEMPERATURES_APART = 5.0  # K between neighbouring readings, chosen: a coil passes through all in between
_LARGEST_DRIFT = 10.0  # K, chosen: 1 um or two of the gap to either side


def _ripple_from_bag(file: Path, given: GivenValues, turns_area: float) -> RippleRecording:
    recording = open_run(file)
    series = _topic(recording, COIL_RIPPLE.name)
    inductance = measured_inductance(
        turns_area, series.derivative('flux_density'), series.derivative('coil_current')
    )
    current = series['coil_current']
    finite = current[np.isfinite(current)]
    check_alive(file, 'current', 'A', finite, np.zeros(finite.size))
    gap = _gap_of(file, given.gap)
    return RippleRecording(file.name, gap, _celsius_of_bag(recording, file, given), current, inductance)


def _celsius_of_bag(recording: Recording, file: Path, given: GivenValues) -> float:
    if file in given.celsius or not (
        COIL_TEMPERATURE.name in recording and len(recording[COIL_TEMPERATURE.name])
    ):
        return _celsius_of(file, given)
    return _settled(file, recording[COIL_TEMPERATURE.name]['temperature'])


def _force_from_bag(
    file: Path, chosen: Mapping[str, ColumnChoice], given: GivenValues
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return up to `_BINS` points of a recorded ramp: means over small steps of the current."""
    recording = open_run(file)
    ripple = _topic(recording, COIL_RIPPLE.name)
    topic, colon, signal = chosen.get('force', ColumnChoice(FORCE_SIGNAL)).column.partition(':')
    if not colon:
        raise RackRecordingError(
            f'--column force={topic}: of an MCAP recording write TOPIC:FIELD, as {FORCE_SIGNAL}'
        )
    force = _topic(recording, topic)
    current, at, values = ripple['coil_current'], ripple.stamps, force[signal]
    known = np.isfinite(values)
    if known.sum() < _FEWEST or not np.isfinite(current).any():
        raise RackRecordingError(
            f'{file}: {topic} and {COIL_RIPPLE.name} hold too few finite samples; record again'
        )
    matched = np.interp(at, force.stamps[known], values[known], left=np.nan, right=np.nan)
    both = np.isfinite(matched) & np.isfinite(current) & (current >= 0.0)
    if both.sum() < _FEWEST:
        raise RackRecordingError(
            f'{file}: {topic} and {COIL_RIPPLE.name} have {int(both.sum())} samples of the same time, needed '
            f'are {_FEWEST}; are they of one recording?'
        )
    current, matched = current[both], matched[both]
    places = np.minimum((current / current.max() * _BINS).astype(int), _BINS - 1)
    filled = np.unique(places)
    means = np.array([(current[places == k].mean(), matched[places == k].mean()) for k in filled])
    return np.full(filled.size, _gap_of(file, given.gap)), means[:, 0], means[:, 1]


def _topic(recording: Recording, name: str) -> Any:
    if name not in recording:
        raise RackRecordingError(
            f'{recording.path} has no topic {name}; it holds {", ".join(sorted(recording)) or "none"}: is it '
            'a recording of the rack?'
        )
    return recording[name]
