"""Measured columns as signals in SI: what is said of them, checked against what they look like."""

import numpy as np

from mount_bags.signals.signal import Signal, check_count
from mount_signals.formats.measured import Measured
from mount_signals.units.column_unit import unit_of_column
from mount_signals.units.columns import column_of, place
from mount_signals.units.mapping import MEAN, ColumnChoice, Mapping, MappingError
from mount_signals.units.quantities import Quantity, other, quantity
from mount_signals.units.time import times_of
from mount_signals.units.unit import Unit, UnitError, unit_of


def signals(measured: Measured, mapping: Mapping) -> dict[str, Signal]:
    """Return {quantity: signal in SI}, by the names of `mapping`, its others among them.

    The notes of a signal say what was taken for granted. Samples without a number (NaN) are left out, with a
    note. Raises `MappingError`, `UnitError` or `SignalError` with file, column, value, guess and remedy.
    """
    if not mapping.columns and not mapping.others:
        raise MappingError(f'{place(measured)}: no column is named; say one as in --column acceleration=az:g')
    chosen = {name: (quantity(name), choice) for name, choice in mapping.columns.items()}
    for name, choice in mapping.others.items():
        chosen[name] = (other(name, _other_unit(measured, choice)), choice)
    return {name: _signal(measured, mapping, wanted, choice) for name, (wanted, choice) in chosen.items()}


def _signal(measured: Measured, mapping: Mapping, wanted: Quantity, choice: ColumnChoice) -> Signal:
    column = column_of(measured, choice.column)
    base, time_notes = times_of(measured, column, mapping.time)
    where = f'{place(measured)}, column {column.name!r}'
    if base.times.size != column.values.size:
        raise MappingError(
            f'{where} has {column.values.size} values but {base.times.size} times; name its own with --time'
        )
    infinite = np.flatnonzero(np.isinf(column.values))
    if infinite.size:
        raise MappingError(
            f'{where}: value number {infinite[0]} is {column.values[infinite[0]]}, at '
            f'{base.times[infinite[0]]:.4f} s; repair it or cut it out'
        )
    known = np.isfinite(column.values)
    missing = int(known.size - np.count_nonzero(known))
    check_count(where, known.size - missing)
    unit, scale, notes = unit_of_column(measured, mapping, wanted, column, choice)
    values = column.values[known] if missing else column.values
    times = base.times[known] if missing else base.times
    if missing:
        notes.append(f'{column.name}: {missing} samples without a number are left out')
    values = unit.to_si(values)
    values = values * scale if scale != 1.0 else values
    offset = float(np.mean(values)) if choice.offset == MEAN else float(choice.offset)
    if offset:
        values = values - offset
        notes.append(f'{column.name}: {offset:.5g} {wanted.unit.symbol} subtracted ({_which(choice)})')
    shift = float(times[0])
    begin = base.begin + round(1e9 * shift)
    times = times - shift if shift else times
    return Signal(column.name, times, values, begin, base.told, (*time_notes, *notes))


def _other_unit(measured: Measured, choice: ColumnChoice) -> Unit:
    column = column_of(measured, choice.column)
    text = choice.unit or column.unit
    if not text:
        raise UnitError(
            f'{place(measured)}, column {column.name!r}: no unit is said, and its header has none; name it'
        )
    return unit_of(text)


def _which(choice: ColumnChoice) -> str:
    return 'its mean' if choice.offset == MEAN else 'as said'
