"""What any file of measured signals is read into: columns as the file holds them, none converted."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any, NamedTuple

from engine_mount.signals.signal import FloatArray, SignalError
from engine_mount.signals.sources.uris import is_local, name_of, shown
from engine_mount.signals.units import unit_of

_LISTED = 40  # names in a refusal, chosen


class Provenance(NamedTuple):
    """Where a recording came from: URI, SHA-256 of its bytes, size in bytes, format, and what read it.

    Of a folder the SHA-256 is that of the lines `sha256  relative path` of its files, sorted by path.
    """

    uri: str
    sha256: str
    size: int
    format: str
    reader: str

    def for_session(self) -> dict[str, Any]:
        """Return what a session says of a file: its name, any URI, hash, size, format, reader."""
        uri = {} if is_local(self.uri) else {'uri': shown(self.uri)}
        own = {'sha256': self.sha256, 'bytes': self.size, 'format': self.format, 'reader': self.reader}
        return {'file': name_of(self.uri), **uri, **own}


@dataclass(frozen=True, eq=False)
class TimeBase:
    """When the samples of a column were taken: s after `begin` (ns since 1970, or 0), shape (n,).

    `told` says in words where these times come from. Columns that were sampled together share one. With
    `begin` 0 the times are those of the file's own clock, with its own zero.
    """

    times: FloatArray
    begin: int
    told: str

    @cached_property
    def from_first(self) -> FloatArray:
        """The times in s after the first, shared by the columns too."""
        return self.times - self.times[0] if self.times[0] else self.times


@dataclass(frozen=True)
class Heading:
    """A column before its values are read: `name` without the unit, `header` as the file writes it.

    `name` is the only one of its file: `group/name`, `topic.field` or `Message.Signal` where the format has
    such. `unit` is as told there or ''. `number` is the place in the file from 0 on. `date` says that the
    values are s since 1970 made of a date.
    """

    name: str
    header: str
    unit: str
    number: int
    date: bool = False


@dataclass(frozen=True, eq=False, kw_only=True)
class MeasuredColumn(Heading):
    """One column: its values (n,) in the file's own unit, NaN where the file holds none.

    `time` is the time base where the format itself tells one, in s; None where a column holds it.
    """

    values: FloatArray
    time: TimeBase | None = None


class Measured(NamedTuple):
    """A file as named columns, with what a reader must know: `notes` are sentences.

    `others` are the headings of columns that were not asked for.
    """

    columns: Mapping[str, MeasuredColumn]
    provenance: Provenance
    notes: tuple[str, ...] = ()
    others: tuple[Heading, ...] = ()

    @property
    def headings(self) -> list[Heading]:
        """All columns of the file."""
        return [*self.columns.values(), *self.others]

    def column(self, wanted: str) -> MeasuredColumn:
        """Return the column meant by `wanted`, see `found`; raises `SignalError` with what there is."""
        heading = found(wanted, self.headings, self.provenance.uri)
        if heading.name not in self.columns:
            raise SignalError(f'{self.provenance.uri}: column {heading.name!r} was not read; ask for it too')
        return self.columns[heading.name]


def found(wanted: str, headings: Sequence[Heading], uri: str) -> Heading:
    """Return the heading meant by `wanted`: its name, header, last part of the name, or number from 0 on.

    Names are tried in this order, then once more without regard to capitals; raises `SignalError`, also for
    an unknown unit behind a name.
    """
    for fitting in _fitting(wanted, headings):
        if len(fitting) == 1:
            return fitting[0]
        if fitting:
            raise SignalError(
                f'{uri}: column {wanted!r} is ambiguous: {listed(fitting)}; name one of these in full'
            )
    name, _, unit = wanted.rpartition(':')
    if any(name in (one.name, one.header) for one in headings):
        try:
            unit_of(unit)
        except SignalError as error:
            raise SignalError(f'{uri}, column {name!r}: {error}') from None
    raise SignalError(f'{uri} has no column {wanted!r}; its columns are {listed(headings)}')


def listed(headings: Sequence[Heading]) -> str:
    """Return names with units in one line, as many as a person reads."""
    texts = [f'{one.name} [{one.unit}]' if one.unit else one.name for one in headings[:_LISTED]]
    if len(headings) > _LISTED:
        texts.append(f'{len(headings) - _LISTED} more')
    return ', '.join(texts) or 'none'


def _fitting(wanted: str, headings: Sequence[Heading]) -> Iterator[list[Heading]]:
    for text in (str, str.casefold):
        word = text(wanted.strip())
        yield [one for one in headings if text(one.name) == word]
        yield [one for one in headings if text(one.header) == word]
        yield [one for one in headings if text(one.name).endswith(('/' + word, '.' + word))]
    yield [one for one in headings if wanted.isdecimal() and one.number == int(wanted)]
