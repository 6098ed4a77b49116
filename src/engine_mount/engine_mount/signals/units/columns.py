"""The columns of a file that a user means, and reading no others."""

import contextlib
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

from engine_mount.signals.formats.content import Stated
from engine_mount.signals.formats.measured import Heading, Measured, MeasuredColumn, found, listed
from engine_mount.signals.formats.reading import headings, read
from engine_mount.signals.signal import SignalError
from engine_mount.signals.units.mapping import Mapping, TimeChoice
from engine_mount.signals.units.unit import UnitError, unit_of

TITLES = (
    't', 'time', 'times', 'timestamp', 'timestamps', 'time_s', 't_s', 'seconds', 'zeit', 'zeitstempel',
    'elapsed', 'elapsed_time', 'time_stamp', 'seconds_elapsed',
)  # fmt: skip
"""Titles of columns that hold times, in small letters."""


def read_chosen(uri: str | Path, mapping: Mapping, stated: Stated | None = None) -> Measured:
    """Return what `mapping` names of the file or folder at `uri`, with the columns that may hold its times.

    Raises `SignalError`, `SourceError` or `UnitError`.
    """
    stated = stated_with(mapping, stated)
    there = headings(uri, stated)
    wanted = [choice.column for choice in (*mapping.columns.values(), *mapping.others.values())]
    chosen = {heading_of(there, text, str(uri)).name for text in wanted}
    chosen |= may_hold_times(there, mapping.time, str(uri))
    return read(uri, [heading.name for heading in there if heading.name in chosen], stated)


def stated_with(mapping: Mapping, stated: Stated | None = None) -> Stated:
    """Return what is said of a file beside its columns: options go before the mapping file."""
    stated = stated or Stated()
    return replace(
        stated,
        decimal=stated.decimal or mapping.decimal,
        delimiter=stated.delimiter or mapping.delimiter,
    )


def may_hold_times(there: Sequence[Heading], choice: TimeChoice, uri: str) -> set[str]:
    """Return the names of the columns that are read for the times of others; raises as `heading_of`."""
    if choice.column:
        return {heading_of(there, choice.column, uri).name}
    # also beside a stated rate, which they may contradict
    titled = {heading.name for heading in there if is_time(heading)}
    return titled | {heading.name for heading in there[:1] if not heading.timed}


def column_of(measured: Measured, wanted: str) -> MeasuredColumn:
    """Return the column that `wanted` names; raises `SignalError`, or `UnitError` for an unknown unit."""
    there = [*measured.columns.values(), *measured.others]
    return measured.column(heading_of(there, wanted, measured.provenance.uri).name)


def heading_of(there: Sequence[Heading], wanted: str, uri: str) -> Heading:
    """Return the heading that `wanted` names; raises `SignalError`, or `UnitError` for an unknown unit."""
    name, colon, unit = wanted.rpartition(':')
    try:
        return found(wanted, there, uri)
    except SignalError:
        if colon:
            with contextlib.suppress(SignalError):
                _check_unit(found(name, there, uri), unit, uri)
        raise


def _check_unit(heading: Heading, unit: str, uri: str) -> None:
    """Raise `UnitError` for a unit that is not known, with the column that it was said of."""
    try:
        unit_of(unit)
    except UnitError as error:
        raise UnitError(f'{uri}, column {heading.name!r}: {error}') from None


def is_time(heading: Heading) -> bool:
    """Return whether a column is called as one of times is, whatever group it is in."""
    title = heading.name[len(group(heading)) :]
    return heading.date or title.lower().replace(' ', '_') in TITLES


def group(heading: Heading) -> str:
    """Return the part of a name that says in which group a column is, with the sign behind it."""
    return heading.name[: max(heading.name.rfind('/'), heading.name.rfind('.')) + 1]


def known(measured: Measured) -> str:
    """Return the names of the columns of a file, for sentences."""
    return listed([*measured.columns.values(), *measured.others])


def place(measured: Measured) -> str:
    """Return the name of the file, for sentences."""
    return name_of(measured.provenance.uri)


def name_of(uri: str) -> str:
    """Return the last part of a path or URI."""
    return uri.rstrip('/').rpartition('/')[2] or uri
