"""The worst recordings of a fleet in one table: what differs in them, before and after the change."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from engine_mount.reports.fleet.looks import Look
from engine_mount.reports.fleet.readable import handy_unit, number
from engine_mount.reports.sections.section import Cell, Link, Section, Table

if TYPE_CHECKING:
    import pyarrow


@dataclass(frozen=True)
class _Told:
    """A column of the table: its head, the unit of its values in the result, and the columns they are in.

    Of two columns the second is the value with the change; of `each` all stand beside one another. A time is
    told to 1 ms, as samples are.
    """

    head: str
    unit: str
    names: tuple[str, ...]
    signed: bool = False
    each: bool = False
    is_time: bool = False


_DAMPING = (
    _Told(
        'switchings appeared, vanished, moved',
        '',
        ('switchings_appeared', 'switchings_vanished', 'switchings_moved'),
        each=True,
    ),
    _Told('energy in the pads', 'J', ('pad_energy_j', 'pad_energy_changed_j')),
)
_COLUMNS = {
    'setpoints': (
        _Told('largest difference of the setpoints', 'A', ('setpoint_difference_largest_a',), signed=True),
        _Told('at', 's', ('setpoint_difference_largest_at_s',), is_time=True),
        _Told('rms of it', 'A', ('setpoint_difference_rms_a',)),
        *_DAMPING,
    ),
    'displacement': (
        _Told(
            'largest difference of the displacements',
            'm',
            ('displacement_difference_largest_m',),
            signed=True,
        ),
        _Told('at', 's', ('displacement_difference_largest_at_s',), is_time=True),
        _Told('rms of it', 'm', ('displacement_difference_rms_m',)),
        _Told('largest displacement', 'm', ('peak_displacement_m', 'peak_displacement_changed_m')),
        _Told('largest force', 'N', ('peak_mount_force_n', 'peak_mount_force_changed_n')),
        *_DAMPING,
    ),
}
"""What is told of a row, by what was asked."""


def worst_section(looks: Sequence[Look], by: str, schema: 'pyarrow.Schema') -> Section:
    """Return the section about the worst rows by the column `by` of a result with `schema`."""
    if not looks:
        return Section('worst', 'Worst', [f'No row has a number in the column {by}.'])
    columns = list(_columns(looks, by, schema))
    rows: list[Sequence[Cell]] = [
        (str(place), Link(look.name, f'look_{place}'), *(told[place - 1] for _, told in columns))
        for place, look in enumerate(looks, 1)
    ]
    head = ('', 'recording', *(title for title, _ in columns))
    words = [f'The largest absolute values of {by}; a → b: as recorded and with the change.']
    return Section('worst', 'Worst', words, tables=[Table(head, rows)])


def _columns(looks: Sequence[Look], by: str, schema: 'pyarrow.Schema') -> Iterator[tuple[str, list[str]]]:
    """Yield head and cells of each column, that by which the worst were chosen first."""
    rows = [look.row for look in looks]
    columns = list(_COLUMNS.get(rows[0].get('asked', ''), _DAMPING))
    chosen = next((told for told in columns if told.names == (by,)), None)
    if chosen is None:
        metadata = schema.field(by).metadata or {}
        columns.insert(0, _Told(by, metadata.get(b'unit', b'').decode(), (by,)))
    for told in columns:
        values = [row[name] for row in rows for name in told.names if row.get(name) is not None]
        if values:
            factor, unit = handy_unit(told.unit, values)
            yield f'{told.head} ({unit})' if unit else told.head, [_cell(told, row, factor) for row in rows]


def _cell(told: _Told, row: Mapping[str, Any], factor: float) -> str:
    known = [_text(row.get(name), factor, told) for name in told.names]
    return ', '.join(known) if told.each else '\u00a0→\u00a0'.join(known)


def _text(value: float | int | None, factor: float, told: _Told) -> str:
    if value is None:
        return ''
    if isinstance(value, int):
        return str(value)
    return f'{value:.3f}' if told.is_time else number(factor * value, signed=told.signed)
