"""A foreign recorded acceleration as what the simulator reads: a plain file, its origin told beside it."""

from collections.abc import Sequence
from functools import partial
from pathlib import Path

import numpy as np

from engine_mount.drives.brought import Brought
from engine_mount.signals.even_grid import evenly_spaced
from engine_mount.signals.excitation import LONGEST_GAP, LOWEST_RATE
from engine_mount.signals.formats.content import Stated
from engine_mount.signals.formats.measured import listed
from engine_mount.signals.formats.reading import headings
from engine_mount.signals.importing.provenance import told_mapping, told_provenance
from engine_mount.signals.importing.topics import recorded_as
from engine_mount.signals.mapping import ColumnChoice, Mapping, mapping_in_file, with_options
from engine_mount.signals.quantities import QUANTITIES
from engine_mount.signals.selection import select
from engine_mount.signals.signal import Signal, SignalError

_ACCELERATION = 'acceleration'
_QUANTITY = {_ACCELERATION: QUANTITIES[_ACCELERATION]}
_OWN = recorded_as(QUANTITIES[_ACCELERATION])
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
) -> Brought:
    """Return the acceleration that `columns` (`COLUMN[:UNIT]`) choose in `file`, a path or URI, in m/s^2.

    One column where a mapping file names none; of a recording of this project none is needed. Raises
    `SignalError` or `SourceError`, also for values that could be in another unit.
    """
    mapping = mapping_in_file(mapping_file) if mapping_file else Mapping()
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
    told = {
        **told_provenance(selection.provenance),
        'mapping': told_mapping(mapping, mapping_file.name if mapping_file else ''),
        'columns': selection.columns,
    }
    return Brought('recorded.file', partial(_write, signal), told, (*selection.notes, *signal.notes))


def _write(signal: Signal, folder: Path) -> Path:
    """Write a pair of NPY files, values and times; return that of the values."""
    folder.mkdir(parents=True, exist_ok=True)
    plain = ''.join(sign if sign.isalnum() else ' ' for sign in signal.name)
    name = '_'.join(plain.split()) or _ACCELERATION
    np.save(folder / f'{name}_value.npy', signal.values)
    np.save(folder / f'{name}_t.npy', signal.times)
    return folder / f'{name}_value.npy'
