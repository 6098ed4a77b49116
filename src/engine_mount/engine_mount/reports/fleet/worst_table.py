"""The worst recordings of a fleet in one table: what differs in them, before and after the change."""

from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING

from engine_mount.reports.fleet.looks import Look
from engine_mount.reports.fleet.readable import handy_unit, number
from engine_mount.reports.sections.section import Cell, Link, Section, Table

if TYPE_CHECKING:
    import pyarrow

_AT = 'at'  # a time is told to 1 ms, as samples are
_SWITCHINGS = ('switchings_appeared', 'switchings_vanished', 'switchings_moved')
_DAMPING = (
    ('switchings appeared, vanished, moved', '', _SWITCHINGS),
    ('energy in the pads', 'J', ('pad_energy_j', 'pad_energy_changed_j')),
)
_SETPOINT, _MOTION = 'setpoint_difference', 'displacement_difference'
_COLUMNS = {
    'setpoints': (
        ('largest difference of the setpoints', 'A', (f'{_SETPOINT}_largest_a',)),
        (_AT, 's', (f'{_SETPOINT}_largest_at_s',)),
        ('rms of it', 'A', (f'{_SETPOINT}_rms_a',)),
        *_DAMPING,
    ),
    'displacement': (
        ('largest difference of the displacements', 'm', (f'{_MOTION}_largest_m',)),
        (_AT, 's', (f'{_MOTION}_largest_at_s',)),
        ('rms of it', 'm', (f'{_MOTION}_rms_m',)),
        ('largest displacement', 'm', ('peak_displacement_m', 'peak_displacement_changed_m')),
        ('largest force', 'N', ('peak_mount_force_n', 'peak_mount_force_changed_n')),
        *_DAMPING,
    ),
}
"""What is told of a row, by what was asked: head, unit in the result, columns (two: before and after)."""


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
    words = [f'The largest absolute values of {by}; a → b: as recorded and with the change.']
    return Section('worst', 'Worst', words, tables=[Table(('', 'recording', *heads), rows)])


def _columns(looks: Sequence[Look], by: str, schema: 'pyarrow.Schema') -> Iterator[tuple[str, list[str]]]:
    """Yield head and cells of each column, that by which the worst were chosen first."""
    rows = [look.row for look in looks]
    columns = _COLUMNS.get(rows[0].get('asked', ''), _DAMPING)
    if all(names != (by,) for _, _, names in columns):
        columns = ((by, (schema.field(by).metadata or {}).get(b'unit', b'').decode(), (by,)), *columns)
    for head, unit, names in columns:
        values = [row[name] for row in rows for name in names if row.get(name) is not None]
        if not values:
            continue
        factor, shown = handy_unit(unit, values)
        between = ', ' if names is _SWITCHINGS else '\u00a0→\u00a0'
        cells = [
            between.join(_text(row.get(name), factor, name, head == _AT) for name in names) for row in rows
        ]
        yield f'{head} ({shown})' if shown else head, cells


def _text(value: float | int | None, factor: float, name: str, is_time: bool) -> str:
    if value is None:
        return ''
    if isinstance(value, int):
        return str(value)
    return f'{value:.3f}' if is_time else number(factor * value, signed='difference_largest' in name)
