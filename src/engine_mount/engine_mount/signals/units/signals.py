"""Measured columns as signals: what is said of them, checked against what they look like."""

from dataclasses import dataclass, replace

import numpy as np

from engine_mount.signals.formats.measured import FloatArray, Measured, MeasuredColumn
from engine_mount.signals.signal import SECOND, Signal, check_count
from engine_mount.signals.units.column_unit import unit_of_column
from engine_mount.signals.units.columns import column_of, place
from engine_mount.signals.units.mapping import MEAN, ColumnChoice, Mapping, MappingError
from engine_mount.signals.units.quantities import Quantity, other, quantity
from engine_mount.signals.units.time import Bases, times_of
from engine_mount.signals.units.unit import Unit, UnitError, unit_of
from mount_models.arithmetic.averages import mean


@dataclass(frozen=True, eq=False)
class ChosenSignal:
    """A signal in the unit of its file, and what leads to SI: `unit`, then `scale`, then `offset` subtracted.

    `offset` is in SI, a number, `mean` or None.
    """

    quantity: Quantity
    signal: Signal
    unit: Unit
    scale: float
    offset: float | str | None

    @property
    def factor(self) -> float:
        """SI for each unit of the file, the scale in it."""
        return self.unit.factor * self.scale

    def in_si(self) -> Signal:
        """Return the signal in SI."""
        values = self.unit.to_si(self.signal.values)
        if values is self.signal.values:
            values = values.copy()  # from here on in place: it can be an hour
        if self.scale != 1.0:
            values *= self.scale
        offset = mean(values) if self.offset == MEAN else float(self.offset or 0.0)
        if not offset:
            return replace(self.signal, values=values)
        which = 'its mean' if self.offset == MEAN else 'as said'
        note = f'{self.signal.name}: {offset:.5g} {self.quantity.unit.symbol} subtracted ({which})'
        values -= offset
        return replace(self.signal, values=values, notes=(*self.signal.notes, note))


def signals(measured: Measured, mapping: Mapping) -> dict[str, Signal]:
    """Return {quantity: signal in SI}, by the names of `mapping`, its others among them.

    The notes of a signal say what was taken for granted. Samples without a number (NaN) are left out, with a
    note. Raises `MappingError`, `UnitError` or `SignalError` with file, column, value, guess and remedy.
    """
    return {name: chosen.in_si() for name, chosen in chosen_signals(measured, mapping).items()}


def chosen_signals(measured: Measured, mapping: Mapping) -> dict[str, ChosenSignal]:
    """Return what `signals` does before anything is converted, checked all the same."""
    if not mapping.columns and not mapping.others:
        raise MappingError(f'{place(measured)}: no column is named; say one as in --column acceleration=az:g')
    bases: Bases = {}
    chosen = {name: (quantity(name), choice) for name, choice in mapping.columns.items()}
    for name, choice in mapping.others.items():
        chosen[name] = (other(name, _other_unit(measured, choice)), choice)
    return {
        name: _chosen(measured, mapping, wanted, choice, bases) for name, (wanted, choice) in chosen.items()
    }


def _chosen(
    measured: Measured, mapping: Mapping, wanted: Quantity, choice: ColumnChoice, bases: Bases
) -> ChosenSignal:
    column = column_of(measured, choice.column)
    base, notes = times_of(measured, column, mapping.time, bases)
    where = f'{place(measured)}, column {column.name!r}'
    _check(where, column, base.times)
    known = np.isfinite(column.values)
    missing = int(known.size - np.count_nonzero(known))
    check_count(where, known.size - missing)
    unit, scale, more = unit_of_column(measured, mapping, wanted, column, choice)
    values = column.values[known] if missing else column.values
    times = base.times[known] if missing else base.times
    if missing:
        more.append(f'{column.name}: {missing} samples without a number are left out')
    shift = float(times[0])
    begin = base.begin + round(SECOND * shift)
    times = times - shift if shift else times
    signal = Signal(where, times, values, begin, base.told, (*notes, *more))
    return ChosenSignal(wanted, signal, unit, scale, choice.offset)


def _check(where: str, column: MeasuredColumn, times: FloatArray) -> None:
    """Raise `MappingError` for values without times, and for values without bounds."""
    if times.size != column.values.size:
        raise MappingError(
            f'{where} has {column.values.size} values but {times.size} times; name its own with --time'
        )
    infinite = np.flatnonzero(np.isinf(column.values))
    if infinite.size:
        place = int(infinite[0])
        raise MappingError(
            f'{where}: value number {place} is {column.values[place]}, at {times[place]:.4f} s; repair it or '
            'cut it out'
        )


def _other_unit(measured: Measured, choice: ColumnChoice) -> Unit:
    column = column_of(measured, choice.column)
    text = choice.unit or column.unit
    if not text:
        raise UnitError(
            f'{place(measured)}, column {column.name!r}: no unit is said, and its header has none; name it'
        )
    return unit_of(text)
