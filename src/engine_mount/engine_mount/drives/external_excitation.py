"""A recorded or measured signal that shakes the simulated car, written as the plain file that it reads."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from engine_mount.recordings.recording import recording_hash
from engine_mount.signals.channels import recorded_as
from engine_mount.signals.even_grid import evenly_spaced
from engine_mount.signals.excitation import LONGEST_GAP, LOWEST_RATE
from engine_mount.signals.formats.content import NOT_STATED, Stated
from engine_mount.signals.formats.measured import listed
from engine_mount.signals.formats.reading import headings
from engine_mount.signals.mapping import ColumnChoice, mapping_in_file, with_options
from engine_mount.signals.mapping import Mapping as ColumnMapping
from engine_mount.signals.quantities import QUANTITIES
from engine_mount.signals.roads.driving import STEP_TIME, Road, wheel_height
from engine_mount.signals.selection import select
from engine_mount.signals.signal import FloatArray, SignalError

FOLDER = 'given'
"""In the folder of a run: the files that its simulator reads."""
_ACCELERATION = 'acceleration'
_QUANTITY = {_ACCELERATION: QUANTITIES[_ACCELERATION]}
_TOPIC, _FIELD = recorded_as(QUANTITIES[_ACCELERATION])
_OWN_COLUMN = f'/{_TOPIC.name}.{_FIELD}'


@dataclass(frozen=True)
class ExternalExcitation:
    """A signal in a foreign file: `parameter` of mount_sim names its plain copy, which `write` makes.

    `write` takes a folder and returns the path of the file in it. `origin` is plain data for the session,
    `notes` are sentences.
    """

    parameter: str
    write: Callable[[Path], Path]
    origin: Mapping[str, Any]
    notes: Sequence[str] = ()

    @property
    def scenario(self) -> str:
        """The scenario of mount_sim that reads it."""
        return self.parameter.partition('.')[0]

    def parameters(self, folder: Path) -> dict[str, Any]:
        """Write the file into `folder` and return the parameters of mount_sim that name it."""
        return {self.parameter: str(self.write(folder).absolute())}

    def provenance(self, file: str) -> dict[str, Any]:
        """Return what the session says of it: origin, and name and hash of the written `file`.

        The hash identifies the file when the folder has been moved and its path no longer holds.
        """
        read = {'file': f'{FOLDER}/{Path(file).name}', 'sha256': recording_hash(Path(file))}
        return {self.parameter: {**self.origin, 'read': read}}


def recorded_acceleration(
    file: str,
    columns: Sequence[str],
    *,
    time: str = '',
    rate: float | None = None,
    scale: float | None = None,
    mapping_file: Path | None = None,
    stated: Stated = NOT_STATED,
) -> ExternalExcitation:
    """Return the acceleration that `columns` (`COLUMN[:UNIT]`) choose in `file`, a path or URI, in m/s^2.

    One column where a mapping file names none; of a recording of this project none is needed. Raises
    `SignalError` or `SourceError`, also for values that could be in another unit.
    """
    mapping = mapping_in_file(mapping_file) if mapping_file else ColumnMapping()
    mapping = mapping.of(_QUANTITY)
    mapping = with_options(
        mapping, columns, time, rate, default=_ACCELERATION, known=_QUANTITY, stated=stated
    )
    if not mapping.columns:
        there = headings(file, mapping.stated)
        if not any(heading.name == _OWN_COLUMN for heading in there):
            raise SignalError(
                f'{file}: say which column is the acceleration, upwards, with --column COLUMN:UNIT; there '
                f'are {listed(there)}'
            )
        mapping = mapping.only({_ACCELERATION: ColumnChoice(_OWN_COLUMN)})
    mapping = with_options(mapping, scale=scale)
    selection = select(file, mapping)
    signal = selection.signals[_ACCELERATION]
    evenly_spaced(signal, LONGEST_GAP, LOWEST_RATE)  # refuses by the names of the file
    origin = {
        **selection.provenance.for_session(),
        'mapping': mapping.for_session(mapping_file.name if mapping_file else ''),
        'columns': selection.columns,
    }
    plain = ''.join(sign if sign.isalnum() else ' ' for sign in signal.name)
    name = '_'.join(plain.split()) or _ACCELERATION
    write = partial(_write, name, signal.times, signal.values)
    return ExternalExcitation('recorded.file', write, origin, (*selection.notes, *signal.notes))


def measured_road(
    road: Road, *, duration: float = 0.0, contact_length: float | None = None, repeat: bool = False
) -> ExternalExcitation:
    """Return a road at its speed as excitation for `duration` s (0: once).

    With `repeat` it is driven forth and back. The tyre stands on `contact_length` m (None: 0.1). Raises
    `SignalError`, also for a road without a speed.
    """
    if road.speed is None:
        raise SignalError('a road needs a speed: --speed 60/3.6 (m/s)')
    over = wheel_height(
        road.profile, road.speed, contact_length=contact_length, duration=duration, repeat=repeat
    )
    sentences = (*road.unevenness.sentences(), *over.notes)
    notes = tuple(f'{road.profile.name}: {sentence}' for sentence in sentences)
    write = partial(_write, 'road', STEP_TIME * np.arange(over.height.size), over.height)
    return ExternalExcitation('road.file', write, over.told, notes)


def _write(name: str, times: FloatArray, values: FloatArray, folder: Path) -> Path:
    """Write a pair of NPY files, values and times (s), both (n,); return that of the values."""
    folder.mkdir(parents=True, exist_ok=True)
    np.save(folder / f'{name}_t.npy', times)
    file = folder / f'{name}_value.npy'
    np.save(file, values)
    return file
