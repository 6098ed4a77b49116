"""All messages of one topic as columns of numbers."""

import functools
import math
import re
from collections.abc import Callable, Iterator, Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from engine_mount.recordings.layout import (
    Definition,
    Layout,
    LayoutError,
    decode,
    installed_definition,
    layout_of,
)
from engine_mount.recordings.mcap_records import ReadingError
from engine_mount.recordings.metadata import registered_topic
from engine_mount.recordings.times import NO_TIMES, Times
from mount_ros.topics import JOINT_STATE, Scalar, Topic

Column = NDArray[np.float64]

STAMP = ('header.stamp.sec', 'header.stamp.nanosec')
_OTHER_CLOCK = 86_400 * 1_000_000_000  # ns, chosen: stamps so far off are of another clock


class SeriesError(ReadingError):
    """The messages of a topic have no such column or message; the text has those that are there."""


class Payloads:
    """Serialised messages: one block of rows where all have the same length, else one by one."""

    def __init__(self, pieces: Sequence[NDArray[np.uint8] | list[bytes]]):
        """Join pieces, each an array (messages x bytes) or a list."""
        widths = {piece.shape[1] if isinstance(piece, np.ndarray) else -1 for piece in pieces}
        self.rows: NDArray[np.uint8] | None = None
        if len(widths) == 1 and -1 not in widths:
            self.rows = np.concatenate(pieces)
        self.messages: Any = self.rows
        if self.rows is None:
            self.messages = [bytes(message) for piece in pieces for message in piece]

    def __len__(self) -> int:
        return len(self.messages)

    def __getitem__(self, index: int) -> bytes:
        return bytes(self.messages[index])

    def at(self, places: NDArray[np.int64]) -> 'Payloads':
        """Return the messages at `places`."""
        found = [self[place] for place in places.tolist()] if self.rows is None else self.rows[places]
        return Payloads([found])


Messages = tuple[Payloads, np.ndarray]
"""Bytes and heads (dtype `HEAD` of a stored file) of messages."""


class Series:
    """The messages of one topic in the order in which they were recorded.

    `receive_times` and `publish_times` are those of the recording, `stamps` those of the samples (from
    the messages' headers), all in ns.
    `series[name]` is a column: of a `JointState` the position of
    that name, of other types the number at that path, such as `wrench.force.z`. Unknown is NaN.
    `time` is that of all columns, to plot.
    """

    def __init__(
        self,
        topic: str,
        type_name: str,
        messages: Messages | Callable[[], Messages],
        *,
        definition: Definition | None = None,
        obstacle: str = '',
        zero: int = 0,
        units: Mapping[str, str] | None = None,
    ):
        """Hold the messages, or a function that reads them when needed.

        `definition` is that of the type, or `obstacle` the reason why there is none; without both the
        installed type counts. `zero` (ns) is where `time` begins; `units` are those that the recording has
        for fields that no registry knows.
        """
        self.topic = topic
        self.type = type_name
        self.columns: dict[str, Column] = {}
        """Columns of all messages that were read without these."""
        self.count: int | None = None
        """How many messages there are, where times or columns were read without these."""
        self.first_names: tuple[str, ...] = ()
        """The names in the first messages of a `JointState`, likewise."""
        self.registered: Topic | None = registered_topic(topic, type_name)
        self._source = messages
        self._known_definition, self._obstacle = definition, obstacle
        self._zero, self._units = zero, units or {}

    def __len__(self) -> int:
        return len(self._messages[1]) if self.count is None else self.count

    @functools.cached_property
    def receive_times(self) -> Times:
        """When the messages came in, ns."""
        return np.ascontiguousarray(self._messages[1]['log_time'])

    @functools.cached_property
    def publish_times(self) -> Times:
        """When the messages were sent, ns."""
        return np.ascontiguousarray(self._messages[1]['publish_time'])

    @property
    def heads(self) -> np.ndarray:
        """The heads of the messages as a file has them, dtype `HEAD`."""
        return self._messages[1]

    @property
    def payloads(self) -> Payloads:
        """The serialised messages."""
        return self._messages[0]

    @property
    def loaded(self) -> bool:
        """Whether the messages are in memory, not only `columns` of them."""
        return isinstance(self._source, tuple)

    @property
    def _messages(self) -> Messages:
        if not isinstance(self._source, tuple):
            self._source = self._source()
        return self._source

    @functools.cached_property
    def stamps(self) -> Times:
        """The stamps of the samples in ns; raises `SeriesError` for a type without a header."""
        absent = SeriesError(f'{self.topic}: {self.type} has no header with a stamp; use receive_times')
        if 'header' not in dict(self._definition.types[self._definition.name]):
            raise absent
        found = [NO_TIMES]
        for layout, rows in self._layouts:
            if not layout.numbers.keys() >= set(STAMP):
                raise absent
            seconds, nanoseconds = (layout.numbers[path].column(rows).astype(np.int64) for path in STAMP)
            found.append(seconds * 1_000_000_000 + nanoseconds)
        return np.concatenate(found)

    @functools.cached_property
    def time(self) -> Column:
        """Time in s from the beginning of the recording: of the samples, or of reception without stamps.

        Stamps of another clock, as in lock-step, count from that clock's own zero.
        """
        try:
            times = self.stamps
        except SeriesError:
            times = self.receive_times
        other = times.size and abs(int(times[0]) - self._zero) > _OTHER_CLOCK
        return np.asarray((times - (0 if other else self._zero)) * 1e-9, np.float64)

    @functools.cached_property
    def names(self) -> tuple[str, ...]:
        """The names of the columns."""
        if not len(self):
            return self.registered.names if self.registered else ()
        if self.type != JOINT_STATE:
            if self.layout is None:
                raise SeriesError(f'{self.topic}: messages of different shape have no columns; use message()')
            return tuple(path for path, numbers in self.layout.numbers.items() if numbers.count == 1)
        self._check_part('name')
        return tuple(dict.fromkeys(name for layout, _ in self._layouts for name in _names_in(layout)))

    def __getitem__(self, name: str) -> Column:
        """Return the column `name` in the unit `unit(name)`; raises `SeriesError` with the known names."""
        if name in self.columns:
            return self.columns[name]
        if self.type == JOINT_STATE:
            return self._joint_column(name, 'position')
        return self._path_column(name)

    def derivative(self, name: str) -> Column:
        """Return the time derivative that the messages carry for `name` (velocity of a `JointState`)."""
        if self.type != JOINT_STATE:
            raise SeriesError(f'{self.topic}: only JointState carries derivatives, this is {self.type}')
        return self._joint_column(name, 'velocity')

    def unit(self, name: str) -> str:
        """Return the unit of `series[name]`, empty where neither registry nor recording has it."""
        return self.registered.unit(name) if self.registered else self._units.get(name, '')

    def derivative_unit(self, name: str) -> str:
        """Return the unit of `series.derivative(name)`, empty where the registry does not know it."""
        scalars: tuple[Scalar, ...] = self.registered.scalars if self.registered else ()
        return next((scalar.derivative_unit for scalar in scalars if scalar.name == name), '')

    def message(self, index: int) -> Any:
        """Return message `index` as an object with its fields as attributes; raises `SeriesError`."""
        try:
            return decode(self.payloads[index], self._definition)
        except LayoutError as error:
            raise self._no_message(index, error) from None

    def messages(self) -> Iterator[Any]:
        """Yield all messages."""
        return (self.message(index) for index in range(len(self)))

    def layout_at(self, index: int) -> Layout | None:
        """Return the layout of one message, None if it cannot be read."""
        try:
            return self.layout or layout_of(self.payloads[index], self._definition)
        except (LayoutError, SeriesError):
            return None

    @functools.cached_property
    def layout(self) -> Layout | None:
        """The common layout of all messages, None where they differ or cannot be read in place."""
        rows = self.payloads.rows
        if rows is None or not len(rows):
            return None
        try:
            layout = layout_of(rows[0].tobytes(), self._definition)
        except LayoutError:
            return None
        return layout if layout.fits(rows) else None

    @functools.cached_property
    def _definition(self) -> Definition:
        try:
            if not self._obstacle:
                return self._known_definition or installed_definition(self.type)
            obstacle = self._obstacle
        except ValueError as error:
            obstacle = str(error)
        raise SeriesError(f'{self.topic}: only its raw bytes can be read: {obstacle}')

    @functools.cached_property
    def _layouts(self) -> list[tuple[Layout, NDArray[np.uint8]]]:
        """The common layout with all messages as rows; where they differ, the layout and row of each."""
        if self.layout is not None and self.payloads.rows is not None:
            return [(self.layout, self.payloads.rows)]
        found = []
        for place in range(len(self)):
            raw = self.payloads[place]
            try:
                found.append((layout_of(raw, self._definition), np.frombuffer(raw, np.uint8)[None]))
            except LayoutError as error:
                raise self._no_message(place, error) from None
        return found

    def _no_message(self, place: int, error: LayoutError) -> SeriesError:
        return SeriesError(f'{self.topic}: message {place} is no {self.type} ({error})')

    def _check_part(self, part: str) -> None:
        if part not in dict(self._definition.types[self._definition.name]):
            raise SeriesError(f'{self.topic}: its definition of {self.type} has no {part!r}')

    def _joint_column(self, name: str, part: str) -> Column:
        if name not in self.names:
            known = ', '.join(self.names) or 'no messages'
            raise SeriesError(f'{self.topic} has no {name!r}; it has {known}')
        if not len(self):
            return np.empty(0)
        self._check_part(part)
        found = []
        for layout, rows in self._layouts:
            names, numbers = _names_in(layout), layout.numbers.get(part)
            if numbers is not None and name in names and numbers.count == len(names):
                found.append(numbers.column(rows, names.index(name)))
            else:
                found.append(np.full(len(rows), math.nan))
        return np.concatenate(found)

    def _path_column(self, path: str) -> Column:
        match = re.fullmatch(r'(.*)\[(\d+)\]', path)
        owner, place = (match[1], int(match[2])) if match else (path, 0)
        found = [np.empty(0)]
        for layout, rows in self._layouts:
            numbers = layout.numbers.get(path) or layout.numbers.get(owner)
            if numbers is None or place >= numbers.count:
                if self.layout is None:
                    raise SeriesError(f'{self.topic}: not every message has a number {path!r}')
                raise SeriesError(f'{self.topic} has no number {path!r}; it has {", ".join(self.names)}')
            found.append(numbers.column(rows, place).astype(np.float64))
        return np.concatenate(found)


def _names_in(layout: Layout) -> list[str]:
    return [text for path, text in layout.strings.items() if path.startswith('name[')]
