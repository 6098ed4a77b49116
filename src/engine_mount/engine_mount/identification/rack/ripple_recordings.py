"""Coil ripple at held gaps, from files of every format and MCAP, for the calibration of the gap."""

from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from engine_mount.identification.actuator.points import gap_groups
from engine_mount.identification.coil.gap_point import RippleRecording
from engine_mount.identification.rack.columns import (
    RACK,
    RackRecordingError,
    check_alive,
    read_columns,
)
from engine_mount.identification.rack.given import (
    FEWEST,
    GivenValues,
    celsius_of,
    checked_files,
    gap_of,
    is_table,
    topic_in,
)
from engine_mount.recordings.place import open_run
from engine_mount.recordings.recording import Recording
from engine_mount.signals.mapping import Mapping as ColumnMapping
from mount_models.coil.gap import measured_inductance
from mount_ros.topics import COIL_RIPPLE, COIL_TEMPERATURE

FloatArray = NDArray[np.float64]
_LARGEST_INVALID = 0.1  # share, chosen
_TEMPERATURES_APART = 5.0  # K between neighbouring readings, chosen: a coil passes through all in between
_LARGEST_DRIFT = 10.0  # K, chosen: 1 um or two of the gap to either side


def read_ripple(
    files: Sequence[Path], mapping: ColumnMapping, given: GivenValues, turns_area: float
) -> list[RippleRecording]:
    """Return one recording for each file and gap; `turns_area` (m^2) makes inductances of slopes.

    Raises `RackRecordingError` and the readers' errors.
    """
    recordings = []
    for file in checked_files(files):
        if is_table(file):
            recordings += _ripple_from_table(file, mapping, given, turns_area)
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


def _ripple_from_table(
    file: Path, mapping: ColumnMapping, given: GivenValues, turns_area: float
) -> list[RippleRecording]:
    columns = read_columns(file, mapping, ('current',), set(RACK) - {'current', 'force'})
    current = columns['current']
    if current.size < FEWEST:
        raise RackRecordingError(
            f'{file} holds {current.size} samples, at least {FEWEST} are needed; record more'
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
        gaps = np.full(current.shape, gap_of(file, given.gap))
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
        return celsius_of(file, given)
    return _settled(file, columns['coil_temperature'][rows])


def _settled(file: Path, values: FloatArray) -> float:
    """Return the mean of the coil's temperatures (degC); raises `RackRecordingError` if they ran away."""
    if np.ptp(values) > _LARGEST_DRIFT:
        raise RackRecordingError(
            f'{file}: the coil temperature ran from {values.min():.1f} to {values.max():.1f} degC, it may by '
            f'{_LARGEST_DRIFT:g} K; let the coil settle between recordings, or make them shorter'
        )
    return float(values.mean())


def _ripple_from_bag(file: Path, given: GivenValues, turns_area: float) -> RippleRecording:
    recording = open_run(file)
    series = topic_in(recording, COIL_RIPPLE.name)
    inductance = measured_inductance(
        turns_area, series.derivative('flux_density'), series.derivative('coil_current')
    )
    current = series['coil_current']
    finite = current[np.isfinite(current)]
    check_alive(file, 'current', 'A', finite, np.zeros(finite.size))
    gap = gap_of(file, given.gap)
    return RippleRecording(file.name, gap, _celsius_of_bag(recording, file, given), current, inductance)


def _celsius_of_bag(recording: Recording, file: Path, given: GivenValues) -> float:
    if file in given.celsius or not (
        COIL_TEMPERATURE.name in recording and len(recording[COIL_TEMPERATURE.name])
    ):
        return celsius_of(file, given)
    return _settled(file, recording[COIL_TEMPERATURE.name]['temperature'])
