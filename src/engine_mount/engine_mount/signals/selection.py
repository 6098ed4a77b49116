"""The one way in which a command chooses columns: quantities of any file in SI units, with their times."""

from collections.abc import Collection, Sequence
from collections.abc import Mapping as Keys
from dataclasses import replace
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from engine_mount.signals.formats.measured import (
    Heading,
    Measured,
    MeasuredColumn,
    Provenance,
    TimeBase,
    found,
    listed,
)
from engine_mount.signals.formats.reading import headings, read
from engine_mount.signals.judgement import unit_of_column
from engine_mount.signals.mapping import MEAN, ColumnChoice, Mapping, with_options
from engine_mount.signals.quantities import QUANTITIES, Quantities, Quantity, quantity
from engine_mount.signals.signal import FEWEST, SECOND, FloatArray, Signal, SignalError, check_count, mean
from engine_mount.signals.sources.uris import name_of
from engine_mount.signals.times import is_time, times_of
from engine_mount.signals.units import is_unit, si_unit, unit_of

_ROWS = 'rows'  # of columns that need no times
_SAME_TIME = 0.5e-3  # s, chosen: half a sample at 1 kHz, for frames of one sample are not sent at once


class Selection(NamedTuple):
    """Signals in SI by quantity, what these are, and where they came from.

    `columns` is plain data for a session: column, unit, factor to SI and times of each quantity; `notes` are
    sentences on the file, those of a signal on what was taken for granted.
    """

    signals: dict[str, Signal]
    quantities: Quantities
    columns: dict[str, dict[str, Any]]
    provenance: Provenance
    notes: tuple[str, ...]


def select(
    source: str | Path | Measured,
    choices: Mapping | Keys[str, str],
    known: Quantities = QUANTITIES,
    *,
    timed: bool = True,
    whole: bool = False,
) -> Selection:
    """Return what `choices`, a mapping or {quantity: `COLUMN[:UNIT]`}, name of a file or folder, path or URI.

    Samples without a number (NaN) are left out, with a note; `whole` refuses them. Where they are not `timed`
    the number of the row takes the place of the time. Raises `SignalError` with file, column, value, guess
    and remedy, or `SourceError`.
    """
    mapping = _mapping(choices, known)
    if not mapping.choices:
        raise SignalError(f'{source}: no column is named; say one as in {mapping.option}')
    measured = source if isinstance(source, Measured) else _read(source, mapping, timed=timed)
    uri = measured.provenance.uri
    signals, quantities, columns, chosen = {}, {}, {}, []
    for name, choice in mapping.choices.items():
        column = measured.column(choice.column)
        if name not in mapping.others:
            wanted = quantity(name, known)
        elif own_unit := choice.unit or column.unit:
            dimension = unit_of(own_unit).dimension
            wanted = Quantity(name, dimension, f'{name}, in {si_unit(dimension).symbol}')
        else:
            raise SignalError(
                f'{name} (column {column.name!r}): no unit is said, and its header has none; name it'
            )
        base, notes = column.time, ()
        if timed:
            base, notes = times_of(measured, column, mapping.time)
        elif base is None:
            base = TimeBase(np.arange(column.values.size, dtype=np.float64), 0, _ROWS)
        chosen.append((name, choice, wanted, column, base, notes))
    measured = measured._replace(columns={})  # what the file holds of a column goes when it is converted
    while chosen:
        name, choice, wanted, column, base, notes = chosen.pop(0)
        where = f'{name_of(uri)}, column {column.name!r}'
        is_known = _known(where, column, base, whole=whole)
        own = replace(column, values=column.values[is_known])
        unit, scale, more = unit_of_column(where, own, wanted, choice, mapping.option)
        values = unit.to_si(own.values)
        values *= scale
        offset = mean(values) if choice.offset == MEAN else float(choice.offset or 0.0)
        if offset:
            values -= offset
            which = 'its mean' if choice.offset == MEAN else 'as said'
            more.append(f'{where}: {offset:.5g} {wanted.unit.symbol} subtracted ({which})')
        times = base.times[is_known]
        begin = base.begin + round(SECOND * float(times[0]))
        if missing := column.values.size - values.size:
            more.append(f'{column.name}: {missing} samples without a number are left out')
        times = times - times[0] if missing else base.from_first
        signals[name] = Signal(where, times, values, begin, base.told, (*notes, *more))
        columns[name] = {
            'column': where, 'unit': unit.symbol, 'factor': unit.factor * scale, 'to': wanted.unit.symbol,
            'times': base.told, 'samples': int(values.size),
            **({'offset': choice.offset} if choice.offset else {}),
        }  # fmt: skip
        quantities[name] = wanted
    return Selection(signals, quantities, columns, measured.provenance, measured.notes)


def select_rows(
    source: str | Path | Measured,
    choices: Mapping | Keys[str, str],
    known: Quantities,
    needed: Collection[str],
    *,
    timed: bool = False,
) -> dict[str, FloatArray]:
    """Return the quantities of a table row by row in SI, (n,) each, with `timed` the `time` in s.

    A quantity is the column that is chosen for it, else `<name>_<unit>` or `<name> [<unit>]`; all of `known`
    are returned that are there, and those `needed` must be. Columns that a format samples at times of their
    own are brought to those of the first by straight lines, as long as all of them last. Raises
    `SignalError` or `SourceError`.
    """
    mapping = _mapping(choices, known).of(known)
    there = source.headings if isinstance(source, Measured) else headings(source, mapping.stated)
    chosen = {name: mapping.columns.get(name) or _by_title(there, one) for name, one in known.items()}
    mapping = mapping.only({name: one for name, one in chosen.items() if one})
    for name in needed:
        if name not in mapping.columns:
            option = mapping.option.format(quantity=name, column='COLUMN', unit='UNIT')
            measured = source if isinstance(source, Measured) else read(source, None, mapping.stated)
            columns = '; '.join((listed(there), *measured.notes))
            raise SignalError(
                f'{measured.provenance.uri} has no column for {name} (its columns: {columns}); name it as in '
                f'{option}'
            )
    signals = select(source, mapping, known, timed=timed, whole=True).signals
    first = next(iter(signals.values()))
    inside = np.full(first.values.size, True)
    rows = {'time': first.times} if timed else {}
    rows |= {name: _at_times_of(first, signal, inside) for name, signal in signals.items()}
    return {name: values[inside] for name, values in rows.items()}


def _mapping(choices: Mapping | Keys[str, str], known: Quantities) -> Mapping:
    if isinstance(choices, Mapping):
        return choices
    return with_options(Mapping(), [f'{name}={text}' for name, text in choices.items()], known=known)


def _read(source: str | Path, mapping: Mapping, *, timed: bool) -> Measured:
    """Return a file with the columns that `mapping` names, and those that may hold their times."""
    there = headings(source, mapping.stated)
    wanted = [choice.column for choice in mapping.choices.values()]
    if timed and mapping.time.column:
        wanted.append(mapping.time.column)
    names = {found(text, there, str(source)).name for text in wanted}
    guessed = timed and not mapping.time.column
    chosen = [one.name for one in there if one.name in names or (guessed and is_time(one))]
    return read(source, chosen, mapping.stated)


def _by_title(there: Sequence[Heading], wanted: Quantity) -> ColumnChoice | None:
    """Return the column `<name>` or `<name>_<unit>`, or one that ends in a title of the quantity."""
    titles = tuple(f'/{title}' for title in (wanted.name, *wanted.titles))
    fitting = [ColumnChoice(one.name) for one in there if f'/{one.name.lower()}'.endswith(titles)]
    for one in there:
        before, _, unit = one.header.lower().partition(f'{wanted.name}_')
        if not before and is_unit(unit, wanted.dimension) and not fitting:
            fitting.append(ColumnChoice(one.name, unit_of(unit, wanted.dimension).symbol))
    if len(fitting) > 1:
        names = ', '.join(choice.column for choice in fitting)
        raise SignalError(f'{wanted.name} may be each of the columns {names}; name one')
    return fitting[0] if fitting else None


def _known(where: str, column: MeasuredColumn, base: TimeBase, *, whole: bool) -> NDArray[np.bool_] | slice:
    """Return which samples hold a number; raises `SignalError` for values without times or bounds."""
    if base.times.size != column.values.size:
        raise SignalError(
            f'{where} has {column.values.size} values but {base.times.size} times; name its own with --time'
        )
    known = np.isfinite(column.values)
    bad = np.flatnonzero(~known if whole else np.isinf(column.values))
    if bad.size:
        place, value = bad[0], column.values[bad[0]]
        said = f'value number {place} is {value}, at {base.times[place]:.4f} s'
        if base.told == _ROWS:
            said = f'row {place + 1} is {value}'
        raise SignalError(f'{where}: {said} ({bad.size} such of {known.size}); repair it or cut it out')
    check_count(where, int(np.count_nonzero(known)), 1 if whole else FEWEST)
    return slice(None) if known.all() else known  # a copy of an hour less


def _at_times_of(first: Signal, signal: Signal, inside: NDArray[np.bool_]) -> FloatArray:
    """Return a signal at the times of the first, and mark in `inside` when it does not last."""
    if signal.begin == first.begin and np.array_equal(signal.times, first.times):
        return signal.values
    at = first.times + (first.begin - signal.begin) / SECOND
    inside &= (at >= -_SAME_TIME) & (at <= signal.times[-1] + _SAME_TIME)
    if signal.clock == _ROWS or not inside.any():
        raise SignalError(
            f'{signal.name} ({signal.values.size} samples) and {first.name} ({first.values.size}) have no '
            'time in common; give columns of one length, or that were sampled together'
        )
    return np.interp(at, signal.times, signal.values)
