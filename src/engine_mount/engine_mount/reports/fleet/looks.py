"""Recordings of a fleet that differ most: each around its largest difference, and all beside each other."""

import math
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from engine_mount.reports.drawing.chart import (
    COLOUR_OF,
    COLOURS,
    DASHED,
    DIFFERENCE_COLOUR,
    Array,
    Chart,
    Curve,
    Panel,
)
from engine_mount.reports.sections.section import Cell, Link, Section, Table

if TYPE_CHECKING:
    import pyarrow

_DIGITS = 3  # chosen
_SMALL = 1e-4  # m, chosen: where all is below, µm


def handy_unit(unit: str, values: Iterable[float]) -> tuple[float, str]:
    """Return the factor to the unit in which `values` in `unit` are read, and that unit."""
    if unit != 'm':
        return 1.0, unit
    largest = max((abs(value) for value in values if math.isfinite(value)), default=0.0)
    return (1e6, 'µm') if 0.0 < largest < _SMALL else (1e3, 'mm')


def number(value: float, *, signed: bool = False) -> str:
    """Return a number with three digits that count."""
    if value == 0.0 or not math.isfinite(value):
        return '0' if value == 0.0 else 'unknown'
    places = max(0, _DIGITS - 1 - math.floor(math.log10(abs(value))))
    return f'{value:{"+" if signed else ""}.{places}f}'


def quantity(value: float, unit: str, *, signed: bool = False) -> str:
    """Return a number in `unit` with the unit in which it is read."""
    factor, shown = handy_unit(unit, [value])
    return ' '.join(filter(None, (number(factor * value, signed=signed), shown)))


_COLUMNS = {
    'setpoints': {
        'setpoint_difference_largest_a': ('largest difference of the setpoints', 'A'),
        'setpoint_difference_largest_at_s': ('at', 's'),
    },
    'displacement': {
        'displacement_difference_largest_m': ('largest difference of the displacements', 'm'),
        'displacement_difference_largest_at_s': ('at', 's'),
    },
}
"""{question: {column of the result: head, unit}} of the worst; few, so that they fit a narrow page."""


def _text(value: float | int | None, factor: float, name: str) -> str:
    if value is None or isinstance(value, int):
        return '' if value is None else str(value)
    if name.endswith('_at_s'):  # to 1 ms, as samples are
        return f'{value:.3f}'
    return number(factor * value, signed='difference_largest' in name)


AROUND = 1.0
"""s, chosen: what is there before and after the largest difference."""
AT_FIRST = 0.4
"""s, chosen: what of it is seen at first."""
_MM = 1e3


class Signals(NamedTuple):
    """Signals (n,) over `time` (s); pairs are as recorded and with the change.

    `given`: the recorded displacement (m), to which the controllers answered the `setpoints` (A); where there
    are `displacements` (m), which were simulated, the recorded acceleration (m/s^2) over which they were.
    """

    time: Array
    given: Array
    setpoints: tuple[Array, Array]
    displacements: tuple[Array, Array] | None = None


@dataclass(frozen=True)
class Look:
    """One recording: its row, the commands that open it, its signals, or the `reason` why there are none."""

    row: Mapping[str, Any]
    commands: Sequence[str] = ()
    signals: Signals | None = None
    reason: str = ''

    @property
    def name(self) -> str:
        """The recording, and which of its mounts."""
        return ' '.join(filter(None, (self.row['recording'], self.row['mount'])))


def look_section(number: int, look: Look) -> Section:
    """Return the section about the recording at place `number` (1: the first) of the worst."""
    title, name = f'{number}. {look.name}', f'look_{number}'
    largest = []
    for what, unit in (('displacement', 'm'), ('setpoint', 'A')):
        value = look.row.get(f'{what}_difference_largest_{unit.lower()}')
        place = look.row.get(f'{what}_difference_largest_at_s')
        if value is not None:
            at = '' if place is None else f' at {place:.3f} s'
            largest.append(f'{what} {quantity(value, unit, signed=True)}{at}')
    words = [f'Largest difference, changed minus as recorded: {"; ".join(largest)}.'] if largest else []
    if look.signals is None:
        words.append(f'No picture: {look.reason}')
    chart = None if look.signals is None else _chart(name, title, look.signals)
    return Section(name, title, words, chart, commands=look.commands, is_listed=False)


def _chart(name: str, title: str, signals: Signals) -> Chart:
    time, moved = signals.time, signals.displacements
    before, after = moved or signals.setpoints
    size = np.abs(after - before)
    place = np.nanargmax(size) if np.isfinite(size).any() else 0
    part = slice(*np.searchsorted(time, [time[place] - AROUND, time[place] + AROUND]))
    x, given = time[part], signals.given[part]

    def compared(label: str, unit: str, pair: tuple[Array, Array]) -> list[Panel]:
        """Return two panels: both, and the difference."""
        one, other = (each[part] for each in pair)
        (factor, shown), (scale, small) = handy_unit(unit, [*one, *other]), handy_unit(unit, other - one)
        curves = [
            Curve('as recorded', x, factor * one, COLOURS[0]),
            Curve('changed', x, factor * other, COLOURS[1], DASHED),
        ]
        left = [Curve('difference', x, scale * (other - one), DIFFERENCE_COLOUR)]
        title = f'{label}, changed minus as recorded ({small})'
        return [Panel(f'{label} ({shown})', curves), Panel(title, left, share=0.7)]

    if moved is None:
        curve = Curve('displacement', x, _MM * given, COLOUR_OF['displacement'])
        panels = [
            Panel('recorded displacement (mm)', [curve]),
            *compared('setpoint', 'A', signals.setpoints),
        ]
    else:
        curve = Curve('acceleration', x, given, COLOURS[2])
        panels = [
            Panel('recorded acceleration of the chassis (m/s²)', [curve]),
            *compared('simulated displacement', 'm', moved),
            compared('setpoint in the simulation', 'A', signals.setpoints)[0],
        ]
    origin = 'sample' if moved is None else 'acceleration'
    # at first what is around the difference is seen, and nothing beyond the ends of the recording
    begin = min(time[place] - AT_FIRST, time[-1] - 2.0 * AT_FIRST)
    begin = max(begin, time[0])
    view = begin, min(begin + 2.0 * AT_FIRST, time[-1])
    return Chart(name, title, f'seconds from the first {origin}', panels, view=view)


def worst_section(looks: Sequence[Look], by: str, schema: 'pyarrow.Schema') -> Section:
    """Return the section about the worst rows by the column `by` of a result with `schema`."""
    if not looks:
        return Section('worst', 'Worst', [f'No row has a number in the column {by}.'])
    found = list(_columns(looks, by, schema))
    heads, columns = [head for head, _ in found], [cells for _, cells in found]
    rows: list[Sequence[Cell]] = [
        (str(place), Link(look.name, f'look_{place}'), *cells)
        for place, (look, *cells) in enumerate(zip(looks, *columns, strict=True), 1)
    ]
    words = [f'The largest absolute values of {by}.']
    return Section('worst', 'Worst', words, tables=[Table(('', 'recording', *heads), rows)])


def _columns(looks: Sequence[Look], by: str, schema: 'pyarrow.Schema') -> Iterator[tuple[str, list[str]]]:
    """Yield head and cells of each column, that by which the worst were chosen first."""
    rows = [look.row for look in looks]
    unit = (schema.field(by).metadata or {}).get(b'unit', b'').decode()
    columns = {by: (by, unit), **_COLUMNS.get(rows[0].get('asked', ''), {})}
    for name, (head, unit) in columns.items():
        values = [row[name] for row in rows if row.get(name) is not None]
        if values:
            factor, shown = handy_unit(unit, values)
            cells = [_text(row.get(name), factor, name) for row in rows]
            yield f'{head} ({shown})' if shown else head, cells
