"""A recorded acceleration of others as what the simulator reads: a plain file, its origin told beside it."""

from collections.abc import Sequence
from dataclasses import replace
from functools import partial
from pathlib import Path

import numpy as np

from engine_mount.drives.brought import Brought
from engine_mount.signals.even_grid import evenly_spaced
from engine_mount.signals.excitation import LONGEST_GAP, LOWEST_RATE
from engine_mount.signals.formats.content import Stated
from engine_mount.signals.formats.measured import Heading
from engine_mount.signals.formats.reading import headings
from engine_mount.signals.importing.provenance import told_columns, told_mapping, told_source
from engine_mount.signals.importing.topics import recorded_as
from engine_mount.signals.signal import Signal
from engine_mount.signals.units.columns import read_chosen, stated_with
from engine_mount.signals.units.mapping import (
    ColumnChoice,
    Mapping,
    MappingError,
    checked_scale,
    mapping_in_file,
    with_options,
)
from engine_mount.signals.units.quantities import quantity
from engine_mount.signals.units.signals import chosen_signals

_ACCELERATION = 'acceleration'
_OWN = recorded_as(quantity(_ACCELERATION))
_OWN_COLUMN = f'/{_OWN.topic.name}.{_OWN.field}'


def recorded_acceleration(
    file: str,
    columns: Sequence[str],
    *,
    time: str = '',
    rate: float | None = None,
    scale: float | None = None,
    mapping_file: Path | None = None,
    stated: Stated | None = None,
) -> tuple[Brought, float]:
    """Return the acceleration that the options of the command name in `file`, and the factor to m/s^2.

    `file` is a path or URI. `columns` are `COLUMN[:UNIT]`, one where a mapping file names none; of a
    recording of this project it may be left out. What is brought are the samples in the unit of the file:
    what the simulator computes does not depend on who reads them. Raises `MappingError`, `UnitError`,
    `SignalError` or `SourceError`, also for values that could be in another unit.
    """
    mapping = mapping_in_file(mapping_file) if mapping_file else Mapping()
    mapping = with_options(mapping, columns, time, rate, default=_ACCELERATION)
    if _ACCELERATION not in mapping.columns:
        there = headings(file, stated_with(mapping, stated))
        mapping = replace(mapping, columns={_ACCELERATION: _own_column(there, file)})
    choice = mapping.columns[_ACCELERATION]
    if scale is not None:
        choice = replace(choice, scale=checked_scale(scale, '--scale'))
    mapping = replace(mapping, columns={_ACCELERATION: choice}, others={})
    measured = read_chosen(file, mapping, stated)
    chosen = chosen_signals(measured, mapping)
    signal = chosen[_ACCELERATION].signal
    evenly_spaced(signal, LONGEST_GAP, LOWEST_RATE)  # refuses by the names of the file
    told = {
        **told_source(measured),
        'mapping': told_mapping(mapping, mapping_file.name if mapping_file else ''),
        'columns': told_columns(chosen),
    }
    brought = Brought('recorded.file', partial(_write, signal), told, (*measured.notes, *signal.notes))
    return brought, chosen[_ACCELERATION].factor


def _write(signal: Signal, folder: Path) -> Path:
    """Write a pair of NPY files, values and times; return that of the values."""
    folder.mkdir(parents=True, exist_ok=True)
    name = _plain(signal.name)
    np.save(folder / f'{name}_value.npy', signal.values)
    np.save(folder / f'{name}_t.npy', signal.times)
    return folder / f'{name}_value.npy'


def _own_column(there: Sequence[Heading], file: str) -> ColumnChoice:
    """Return the column of an acceleration that this project recorded; raises `MappingError`."""
    if any(heading.name == _OWN_COLUMN for heading in there):
        return ColumnChoice(_OWN_COLUMN)
    raise MappingError(
        f'{file}: say which column is the acceleration, upwards, with --column COLUMN:UNIT; there are '
        + ', '.join(f'{one.name} [{one.unit}]' if one.unit else one.name for one in there)
    )


def _plain(name: str) -> str:
    """Return a name for files: letters, digits and _ of a name in sentences."""
    return '_'.join(''.join(sign if sign.isalnum() else ' ' for sign in name).split()) or _ACCELERATION
