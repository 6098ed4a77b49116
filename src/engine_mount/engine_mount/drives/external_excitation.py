"""A recorded or measured signal that shakes the simulated car, written as the plain file that it reads."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from engine_mount.recordings.place import recording_hash
from engine_mount.signals.even_grid import evenly_spaced
from engine_mount.signals.excitation import LONGEST_GAP, LOWEST_RATE
from engine_mount.signals.formats.content import Stated
from engine_mount.signals.formats.reading import headings
from engine_mount.signals.importing.provenance import told_columns, told_mapping, told_source
from engine_mount.signals.importing.topics import recorded_as
from engine_mount.signals.signal import Signal
from engine_mount.signals.units.columns import read_chosen, stated_with
from engine_mount.signals.units.mapping import (
    ColumnChoice,
    MappingError,
    checked_scale,
    mapping_in_file,
    with_options,
)
from engine_mount.signals.units.mapping import Mapping as ColumnMapping
from engine_mount.signals.units.quantities import quantity
from engine_mount.signals.units.signals import chosen_signals

FOLDER = 'given'
"""In the folder of a run: the files that its simulator reads."""
_ACCELERATION = 'acceleration'
_OWN = recorded_as(quantity(_ACCELERATION))
_OWN_COLUMN = f'/{_OWN.topic.name}.{_OWN.field}'


@dataclass(frozen=True)
class ExternalExcitation:
    """A signal in a foreign file: `parameter` of mount_sim names its plain copy, which `write` makes.

    `write` takes a folder and returns the path of the file in it. `origin` is plain data for the session,
    `settings` are further parameters of mount_sim, `notes` sentences.
    """

    parameter: str
    write: Callable[[Path], Path]
    origin: Mapping[str, Any]
    notes: Sequence[str] = ()
    settings: Mapping[str, Any] = field(default_factory=dict)

    @property
    def scenario(self) -> str:
        """The scenario of mount_sim that reads it."""
        return self.parameter.partition('.')[0]

    def parameters(self, folder: Path) -> dict[str, Any]:
        """Write the file into `folder` and return the parameters of mount_sim that name it."""
        return {**self.settings, self.parameter: str(self.write(folder).absolute())}

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
    stated: Stated | None = None,
) -> ExternalExcitation:
    """Return the acceleration that `columns` (`COLUMN[:UNIT]`) choose in `file`, a path or URI.

    One column where a mapping file names none; of a recording of this project none is needed. The samples
    stay in the unit of the file, so that the simulation does not depend on who reads them. Raises
    `MappingError`, `UnitError`, `SignalError` or `SourceError`, also where the unit may be another one.
    """
    mapping = mapping_in_file(mapping_file) if mapping_file else ColumnMapping()
    mapping = with_options(mapping, columns, time, rate, default=_ACCELERATION)
    choice = mapping.columns.get(_ACCELERATION) or _own_column(file, stated_with(mapping, stated))
    if scale is not None:
        choice = replace(choice, scale=checked_scale(scale, '--scale'))
    mapping = replace(mapping, columns={_ACCELERATION: choice}, others={})
    measured = read_chosen(file, mapping, stated)
    chosen = chosen_signals(measured, mapping)
    signal = chosen[_ACCELERATION].signal
    evenly_spaced(signal, LONGEST_GAP, LOWEST_RATE)  # refuses by the names of the file
    origin = {
        **told_source(measured),
        'mapping': told_mapping(mapping, mapping_file.name if mapping_file else ''),
        'columns': told_columns(chosen),
    }
    notes = (*measured.notes, *signal.notes)
    scaled = {'recorded.scale': chosen[_ACCELERATION].factor}
    return ExternalExcitation('recorded.file', partial(_write, signal), origin, notes, scaled)


def _write(signal: Signal, folder: Path) -> Path:
    """Write a pair of NPY files, values and times; return that of the values."""
    folder.mkdir(parents=True, exist_ok=True)
    plain = ''.join(sign if sign.isalnum() else ' ' for sign in signal.name)
    name = '_'.join(plain.split()) or _ACCELERATION
    np.save(folder / f'{name}_value.npy', signal.values)
    np.save(folder / f'{name}_t.npy', signal.times)
    return folder / f'{name}_value.npy'


def _own_column(file: str, stated: Stated | None) -> ColumnChoice:
    """Return the column of an acceleration that this project recorded; raises `MappingError`."""
    there = headings(file, stated)
    if any(heading.name == _OWN_COLUMN for heading in there):
        return ColumnChoice(_OWN_COLUMN)
    raise MappingError(
        f'{file}: say which column is the acceleration, upwards, with --column COLUMN:UNIT; there are '
        + ', '.join(f'{one.name} [{one.unit}]' if one.unit else one.name for one in there)
    )
