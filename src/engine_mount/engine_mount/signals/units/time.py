"""The times of a column: from the format, from a column, or from a stated rate, in s."""

import numpy as np

from engine_mount.signals.formats.measured import Measured, MeasuredColumn, TimeBase
from engine_mount.signals.signal import SECOND, FloatArray
from engine_mount.signals.units.columns import column_of, group, is_time, known, place
from engine_mount.signals.units.mapping import MappingError, TimeChoice
from engine_mount.signals.units.unit import Unit, UnitError, si_unit, unit_of

SLOWEST, FASTEST = 10.0, 2e5
"""Hz, chosen: between these engine mounts are sampled; beyond, the unit of the times is doubted."""
_GUESSED = ('s', 'ms', 'us', 'ns', 'min')
_LIKELY = (20.0, 2e4)  # Hz, chosen: a unit is only guessed where the rate that follows is common
_SHORTEST = 0.5  # s, chosen: what is shorter shows no motion of an engine
_EPOCH = (5e8, 4e9)  # s, chosen: 1985 .. 2096, what counts from 1970 lies here
_SAME_RATE = 0.02  # chosen: a stated rate may differ so much from that of times that stand there


Bases = dict[str, tuple[TimeBase, tuple[str, ...]]]
"""Times that were made of columns, by their names: those that were sampled together share them."""


def times_of(
    measured: Measured, column: MeasuredColumn, choice: TimeChoice, bases: Bases
) -> tuple[TimeBase, tuple[str, ...]]:
    """Return the times of a column, and sentences on what was taken for granted; adds them to `bases`.

    What is said by hand goes before what the format tells, that before a column with a usual title, and that
    before a first column that rises. Raises `MappingError` or `UnitError`.
    """
    if choice.rate is not None:
        return _at_rate(measured, column, choice.rate)
    if choice.column:
        return _in_column(measured, column_of(measured, choice.column), choice.unit, bases)
    if column.time is not None:
        return column.time, ()
    found = time_column(measured, column)
    if found is None:
        raise MappingError(
            f'{place(measured)} tells no times for column {column.name!r}: name their column with --time '
            f'COLUMN:UNIT (there are {known(measured)}), or the rate with --rate HZ'
        )
    base, notes = _in_column(measured, found, choice.unit, bases)
    first = () if is_time(found) else (f'{found.name}: the first column rises: taken as the time',)
    return base, (*first, *notes)


def time_column(measured: Measured, column: MeasuredColumn) -> MeasuredColumn | None:
    """Return the column of times by its title, else the first if it rises; None where there is none.

    Times of the same group go before others.
    """
    columns = list(measured.columns.values())
    titled = [candidate for candidate in columns if is_time(candidate) and candidate is not column]
    if titled:
        return next((one for one in titled if group(one) == group(column)), titled[0])
    first = columns[0]
    rises = first is not column and first.number == 0 and first.values.size > 1
    rises = rises and bool(np.all(np.diff(first.values) > 0.0))
    return first if rises else None


def _at_rate(measured: Measured, column: MeasuredColumn, rate: float) -> tuple[TimeBase, tuple[str, ...]]:
    there = column.time.times if column.time is not None else _told_times(measured, column)
    told = f'the stated rate of {rate:g} Hz'
    if there is not None and there.size == column.values.size and there.size > 1 and there[-1] > there[0]:
        own = (there.size - 1) / (there[-1] - there[0])
        if abs(own / rate - 1.0) > _SAME_RATE:
            raise MappingError(
                f'{place(measured)}: its times tell {own:.5g} samples per second, --rate says {rate:g}; '
                'leave --rate out, or remove the times if they are wrong'
            )
        told += f' (the times in the file tell {own:.5g})'
    begin = column.time.begin if column.time is not None else 0
    return TimeBase(np.arange(column.values.size) / rate, begin, told), ()


def _told_times(measured: Measured, column: MeasuredColumn) -> FloatArray | None:
    """Return the times in s of a column that says its unit itself, None where none does."""
    found = time_column(measured, column)
    if found is None or not found.unit:
        return None
    return unit_of(found.unit).to_si(found.values)


def _in_column(
    measured: Measured, column: MeasuredColumn, said: str, bases: Bases
) -> tuple[TimeBase, tuple[str, ...]]:
    if column.name not in bases:
        bases[column.name] = _made_of(measured, column, said)
    return bases[column.name]


def _made_of(measured: Measured, column: MeasuredColumn, said: str) -> tuple[TimeBase, tuple[str, ...]]:
    where = f'{place(measured)}, column {column.name!r}'
    if column.time is not None and column.unit == '' and not np.isfinite(column.values).any():
        return column.time, ()  # dates, which are no numbers
    bad = np.flatnonzero(~np.isfinite(column.values))
    if bad.size:
        raise MappingError(
            f'{where}: time number {bad[0]} is {column.values[bad[0]]} ({bad.size} such of '
            f'{column.values.size}); remove these samples, or say the rate with --rate HZ'
        )
    if column.values.size < 2:
        raise MappingError(f'{where} holds {column.values.size} times; at least 2 are needed')
    unit, notes = _time_unit(where, column, said)
    raw = column.values
    origin = raw[0] * unit.factor
    epoch = _EPOCH[0] < origin < _EPOCH[1]
    begin = round(float(raw[0]) * round(unit.factor * SECOND))
    told = f'column {column.name!r} in {unit.symbol}' + (', counted from 1970' if epoch else '')
    return TimeBase((raw - raw[0]) * unit.factor, begin, told), notes


def _time_unit(where: str, column: MeasuredColumn, said: str) -> tuple[Unit, tuple[str, ...]]:
    """Return the unit of a column of times; the one that is said must give a rate that can be."""
    header = column.unit
    contradicted = said and header and unit_of(said) != unit_of(header)
    notes = (f'{column.name}: its header says {header}; taken as {said}, as you say',) if contradicted else ()
    chosen = said or header
    if chosen and unit_of(chosen).dimension != 'time':
        raise UnitError(
            f'{where} is in {chosen}, which is no unit of time; name another with --time COLUMN:UNIT'
        )
    unit = unit_of(chosen) if chosen else si_unit('time')
    step = _common_step(column.values)
    if step <= 0.0:
        return unit, notes  # of times that do not rise the even grid tells
    rate = 1.0 / (step * unit.factor)
    if _can_be(rate, column.values.size):
        assumed = f'{column.name}: no unit is said; taken as s: {rate:.4g} samples per second'
        return unit, notes if chosen else (assumed,)
    guess = _guess(step)
    if chosen and not guess:
        return unit, notes  # of a rate that is too low the even grid tells
    says = f'in {unit.symbol}, as {"you say" if said else "its header says"},' if chosen else 'in s'
    remedy = f'; these look like {guess}: write --time {column.name}:{guess}' if guess else ''
    raise UnitError(
        f'{where}: steps of {step:.4g} are {rate:.4g} samples per second {says}'
        f'{remedy or "; say the unit with --time COLUMN:UNIT, or the rate with --rate HZ"}'
    )


def _common_step(values: FloatArray) -> float:
    """Return the mean step between times: stamps in bursts have a median of 0."""
    return float((values.max() - values.min()) / (values.size - 1))


def _can_be(rate: float, samples: int) -> bool:
    """Whether samples were taken at `rate` (Hz): fast ones, only if they last."""
    return SLOWEST <= rate <= FASTEST and (rate <= _LIKELY[1] or samples >= _SHORTEST * rate)


def _guess(step: float) -> str:
    low, high = _LIKELY
    return next((name for name in _GUESSED if low <= 1.0 / (step * unit_of(name).factor) <= high), '')
