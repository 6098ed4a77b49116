"""One file of others as a row of a catalogue: what its columns and their mapping tell."""

import json
from collections.abc import Iterator, Mapping
from datetime import UTC, datetime
from pathlib import Path

import numpy as np

from engine_mount.fleet.catalogue.columns import FOREIGN
from engine_mount.fleet.catalogue.figures import Figures
from engine_mount.fleet.catalogue.motion import motion_figures
from engine_mount.fleet.catalogue.places import Place
from engine_mount.fleet.catalogue.rows import Row, Rows, named, place_of, reason_of, unreadable
from engine_mount.fleet.foreign import ACCELERATION, Mapped, Said, columns_in, mapped_in
from engine_mount.signals.importing.channels import channels_of
from engine_mount.signals.importing.parts import DATED
from engine_mount.signals.importing.reading import read_files
from engine_mount.signals.quantities import QUANTITIES
from engine_mount.signals.signal import SECOND, Signal
from mount_models.sampling import SAMPLE_RATE

_SPEED = 'speed'


def foreign_rows(path: Path, place: Place, said: Said) -> Rows:
    """Return the row of the file of others at `path`; what cannot be told of it has its reason there."""
    row: Row = {**place_of(place), 'kind': FOREIGN, 'mount': '', 'whole': True}
    reasons: list[str] = []
    try:
        there = columns_in(path, said)
        row['columns'] = json.dumps({one.name: one.unit for one in there}, ensure_ascii=False)
    except ValueError as error:
        return unreadable(place, named(str(error), path, place))
    try:
        mapped = mapped_in(path, said)
    except ValueError as error:
        reasons.append(str(error))
    else:
        row |= mapped.told
        for figures in _figures(mapped, reasons):
            row |= {name: value for name, value in figures.items() if name not in row}
    return Rows([row | {'reason': reason_of(reasons, path, place)}])


def _figures(mapped: Mapped, reasons: list[str]) -> Iterator[Figures]:
    """Return the figures of displacement, acceleration and speed, as far as they are mapped."""
    for columns in (mapped.motion(), mapped.of(ACCELERATION), mapped.of(_SPEED)):
        if not columns:
            continue
        try:
            (read,) = read_files([str(mapped.path)], mapped.mapping.only(columns))
            yield _times(next(iter(read.signals.values())))
            yield _of(read.signals)
        except ValueError as error:
            reasons.append(str(error))


def _times(signal: Signal) -> Figures:
    """Return when a signal began, how long it is, and its rate."""
    span = float(signal.times[-1] - signal.times[0])
    dated = datetime.fromtimestamp(signal.begin / SECOND, UTC).replace(tzinfo=None)
    return {
        'started': dated if signal.begin > DATED else None,
        'duration_s': span,
        'rate_hz': (signal.times.size - 1) / span if span > 0.0 else None,
    }


def _of(signals: Mapping[str, Signal]) -> Figures:
    """Return the figures of signals in SI, at the rate at which a replay takes them."""
    if _SPEED in signals:
        speed = signals[_SPEED]
        return {'distance_m': float(np.trapezoid(np.abs(speed.values), speed.times))}
    channels, _ = channels_of(signals, QUANTITIES)
    values = channels[0].values
    if ACCELERATION in signals:
        return {'rms_acceleration_m_s2': float(np.std(values))}
    return {
        'samples': values.size,
        **motion_figures(channels[0].stamps, values, SAMPLE_RATE),
    }
