"""The times of a column: from the format, from a column, or from a stated rate, in s."""

import numpy as np

from engine_mount.signals.formats.measured import Heading, Measured, MeasuredColumn, TimeBase, listed
from engine_mount.signals.mapping import TimeChoice
from engine_mount.signals.signal import SECOND, SignalError
from engine_mount.signals.units import Unit, unit_of

SLOWEST, FASTEST = 10.0, 2e5
"""Hz, chosen: between these engine mounts are sampled; beyond, the unit of the times is doubted."""
TITLES = (
    't', 'time', 'times', 'timestamp', 'timestamps', 'time_s', 't_s', 'seconds', 'zeit', 'zeitstempel',
    'elapsed', 'elapsed_time', 'time_stamp', 'seconds_elapsed',
)  # fmt: skip
"""Titles of columns that hold times, in small letters."""
_COMMON = 2e4  # Hz, chosen: faster ones must last for half a second, else the unit is doubted
_EPOCH = (5e8, 4e9)  # s, chosen: 1985 .. 2096, what counts from 1970 lies here
_SAME_RATE = 0.02  # chosen: a stated rate may differ so much from that of times that stand there

Times = tuple[TimeBase, tuple[str, ...]]
"""Times, and sentences on what was taken for granted."""


def is_time(heading: Heading) -> bool:
    """Return whether a column is called as one of times is, whatever group it is in."""
    return heading.date or heading.name[len(_group(heading)) :].lower().replace(' ', '_') in TITLES


def times_of(measured: Measured, column: MeasuredColumn, choice: TimeChoice) -> Times:
    """Return the times of a column.

    What is said by hand goes before what the format tells, and that before a column with a usual title.
    Raises `SignalError`.
    """
    if choice.column:
        return _in_column(measured, measured.column(choice.column), choice.unit)
    found = min(
        (one for one in measured.columns.values() if one is not column and is_time(one)),
        key=lambda one: -len(_group(one)) if column.name.startswith(_group(one)) else 1,
        default=None,
    )
    if choice.rate is not None:
        return _at_rate(measured, column, choice.rate, found)
    if column.time is not None:
        return column.time, ()
    if found is None:
        raise SignalError(
            f'{measured.provenance.uri} tells no times for column {column.name!r}: name their column with '
            f'--time COLUMN:UNIT (there are {listed(measured.headings)}), or the rate with --rate HZ'
        )
    return _in_column(measured, found, choice.unit)


def _group(heading: Heading) -> str:
    """Return the part of a name that says in which group a column is, with the sign behind it."""
    return heading.name[: max(heading.name.rfind('/'), heading.name.rfind('.')) + 1]


def _at_rate(measured: Measured, column: MeasuredColumn, rate: float, found: MeasuredColumn | None) -> Times:
    """Return the times of a stated rate, which those in the file may not contradict."""
    told, own = f'the stated rate of {rate:g} Hz', column.time.times if column.time else np.zeros(0)
    if not own.size and found is not None and found.unit:
        own = unit_of(found.unit, 'time').to_si(found.values)
    if own.size == column.values.size > 1 and own[-1] > own[0]:
        real = (own.size - 1) / (own[-1] - own[0])
        if abs(real / rate - 1.0) > _SAME_RATE:
            raise SignalError(
                f'{measured.provenance.uri}: its times tell {real:.5g} samples per second, --rate says '
                f'{rate:g}; leave --rate out, or remove the times if they are wrong'
            )
        told += f' (the times in the file tell {real:.5g})'
    begin = column.time.begin if column.time else 0
    return TimeBase(np.arange(column.values.size) / rate, begin, told), ()


def _in_column(measured: Measured, column: MeasuredColumn, said: str) -> Times:
    where, raw = f'{measured.provenance.uri}, column {column.name!r}', column.values
    bad = np.flatnonzero(~np.isfinite(raw))
    if column.time is not None and bad.size == raw.size:
        return column.time, ()  # dates, which are no numbers
    if bad.size or raw.size < 2:
        raise SignalError(
            f'{where}: {bad.size} of {raw.size} times are no numbers (the first: number {bad[:1]}); at least '
            '2 are needed: remove these samples, or say the rate with --rate HZ'
        )
    unit, notes = _unit(where, column, said)
    origin = float(raw[0]) * unit.factor
    told = f'column {column.name!r} in {unit.symbol}'
    told += ', counted from 1970' if _EPOCH[0] < origin < _EPOCH[1] else ''
    begin = round(float(raw[0]) * round(unit.factor * SECOND))
    return TimeBase((raw - raw[0]) * unit.factor, begin, told), notes


def _unit(where: str, column: MeasuredColumn, said: str) -> tuple[Unit, tuple[str, ...]]:
    """Return the unit of a column of times; it must give a rate that can be."""
    chosen = said or column.unit
    unit = unit_of(chosen or 's', 'time')
    if unit.dimension != 'time':
        raise SignalError(
            f'{where} is in {chosen}, which is no unit of time; name another with --time COLUMN:UNIT'
        )
    count = column.values.size
    # the mean step: stamps in bursts have a median of 0
    step = float((column.values.max() - column.values.min()) / (count - 1))
    rate = 1.0 / (step * unit.factor) if step > 0.0 else SLOWEST  # of these the even grid tells
    who = 'as you say' if said else 'as its header says' if chosen else 'for no unit is said'
    if not SLOWEST <= rate <= FASTEST or rate > max(_COMMON, 2.0 * count):
        steps = {one: step * unit_of(one).factor for one in ('s', 'ms', 'us', 'ns', 'min')}
        guess = next(
            (one for one, each in steps.items() if 2.0 * SLOWEST * each <= 1.0 <= _COMMON * each), ''
        )
        raise SignalError(
            f'{where}: steps of {step:.4g} are {rate:.4g} samples per second in {unit.symbol}, {who}; '
            + (f'these look like {guess}: write --time {column.name}:{guess}, or ' if guess else '')
            + 'say the rate with --rate HZ'
        )
    if not chosen:
        return unit, (f'{column.name}: no unit is said; taken as s: {rate:.4g} samples per second',)
    if said and column.unit and unit_of(column.unit, 'time') != unit:
        return unit, (f'{column.name}: its header says {column.unit}; taken as {said}, as you say',)
    return unit, ()
