"""One topic of two recordings, sample beside sample: its signals, and what no signal shows."""

import functools
from collections.abc import Collection
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from engine_mount.recordings.compare.alignment import (
    Alignment,
    Samples,
    common_samples,
    is_stamped,
    mount_of,
    samples_of,
)
from engine_mount.recordings.compare.signals import Column, Quantity, SignalDifference, signal_difference
from engine_mount.recordings.compare.tolerances import Tolerances
from engine_mount.recordings.layout import OPTIONS, Layout, Numbers
from engine_mount.recordings.series import STAMP, STAMP_BYTES, Series, SeriesError
from mount_ros.messages.force_table import ForceTable, ForceTableMessageError, from_message
from mount_ros.topics import CONTROL_TRACE, CURRENT_FORCE_TABLE, JOINT_STATE

Places = NDArray[np.int64]
Rows = NDArray[np.uint8]
Mask = NDArray[np.bool_]
Place = tuple[str, int]
"""A number or a text of a message: its path, and its place in a run of numbers."""

SWITCH = 'damping_active'
_LARGEST_GRID = 8  # times the samples, chosen: with more holes it is no signal of a fixed rate
_TABLE = {'current': 'A', 'normal_force': 'N'}
_NONE = Numbers(0, np.dtype('u1'), 0)


@dataclass(frozen=True)
class TopicComparison:
    """One topic of both: its signals, and how many samples are in one recording alone.

    `only_a` and `only_b` are samples within the time that both recordings cover with this topic,
    `outside_a` and `outside_b` those before and behind it.
    """

    mount: str  # what stands before the topic where it is of a namespace: `mount_left/`
    topic: str
    samples: int
    signals: tuple[SignalDifference, ...]
    only_a: int
    only_b: int
    outside_a: int
    outside_b: int
    differing_messages: int  # in what no signal shows
    remark: str

    @property
    def name(self) -> str:
        """Mount and topic."""
        return f'{self.mount}{self.topic}'

    def figures(self) -> dict[str, Any]:
        """Return the figures for JSON."""
        return {
            'samples': self.samples,
            'missing_in_b': self.only_a,
            'missing_in_a': self.only_b,
            'outside_in_a': self.outside_a,
            'outside_in_b': self.outside_b,
            'differing_messages': self.differing_messages,
            'remark': self.remark,
            'signals': {signal.signal: signal.figures() for signal in self.signals},
        }


class MatchedTopic:
    """Samples that both recordings have of a topic, and the numbers in them.

    Streams are matched by their stamps, all other topics message by message in the order of recording.
    """

    def __init__(self, a: Series, b: Series, alignment: Alignment):
        self.a, self.b = a, b
        self.topic = a.registered.name if a.registered else a.topic.lstrip('/')
        self.mount = mount_of(a.topic, a.registered)
        rated = a.registered is None or a.registered.rate > 0.0
        self.streamed = rated and is_stamped(a) and is_stamped(b)
        self.of_a, self.of_b = (
            samples_of(series, alignment, counter) if self.streamed else _in_turn(series)
            for series, counter in ((a, alignment.a), (b, alignment.b))
        )
        self._common_a, self._common_b = common_samples(self.of_a, self.of_b)
        self._places_a, self._places_b = self.of_a.order[self._common_a], self.of_b.order[self._common_b]
        self._alignment = alignment

    @property
    def samples(self) -> int:
        """How many samples both have."""
        return len(self._places_a)

    @property
    def period(self) -> float:
        """Time between two samples in s."""
        return self.of_a.period

    @functools.cached_property
    def time(self) -> NDArray[np.float64]:
        """Times of the matched samples in A, s."""
        if is_stamped(self.a):
            return self._alignment.time(self.a.stamps[self._places_a])
        return self._alignment.received(self.a.receive_times[self._places_a])

    @functools.cached_property
    def signals(self) -> dict[str, str]:
        """The signals of both as {name: unit}; a derivative is called `d(name)/dt`."""
        if self.a.registered is CURRENT_FORCE_TABLE:
            return dict(_TABLE) if self._tables else {}
        try:
            names = [name for name in self.a.names if name in self.b.names and not name.startswith('header.')]
        except SeriesError:
            return {}  # no numbers at fixed places
        signals: dict[str, str] = {}
        for name in names:
            signals[name] = _unit(self.a.unit(name))
            if self.a.derivative_unit(name):
                signals[f'd({name})/dt'] = _unit(self.a.derivative_unit(name))
        return signals

    @property
    def unmatched_signals(self) -> list[str]:
        """The signals that one of the recordings lacks."""
        try:
            return sorted(set(self.a.names) ^ set(self.b.names)) if self.samples else []
        except SeriesError:
            return []

    def column(self, signal: str) -> Column:
        """Return the matched samples of one of the `signals`; raises `SeriesError`."""
        unit = self.signals[signal]
        quantity = Quantity(self.mount, self.topic, signal, unit)
        if self._tables:
            a, b = (getattr(table, signal) for table in self._tables)
            return Column(quantity, np.full(len(a), self.time[-1]), a, b)
        if signal.startswith('d(') and signal not in self.a.names:
            name = signal.removeprefix('d(').removesuffix(')/dt')
            a, b = self.a.derivative(name), self.b.derivative(name)
        else:
            a, b = self.a[signal], self.b[signal]
        return Column(quantity, self.time, a[self._places_a], b[self._places_b])

    def different_messages(self) -> Mask:
        """Return which of the matched messages differ in any byte but those of their stamps."""
        if self.a.type != self.b.type:
            return np.ones(self.samples, bool)  # the same bytes mean something else
        rows_a, rows_b, place = self.a.payloads.rows, self.b.payloads.rows, self.a.stamp_place
        if rows_a is not None and rows_b is not None and place == self.b.stamp_place:
            if rows_a.shape[1] != rows_b.shape[1]:
                return np.ones(self.samples, bool)
            different = rows_a[self._places_a] != rows_b[self._places_b]
            different[:, OPTIONS] = False
            if place is not None:
                different[:, place : place + STAMP_BYTES] = False
            return different.any(axis=1)
        pairs = zip(self._places_a.tolist(), self._places_b.tolist(), strict=True)
        return np.array([self.a.content(i) != self.b.content(k) for i, k in pairs], bool)

    def hidden_differences(self) -> Mask:
        """Return which of the matched messages differ where no signal shows it."""
        if self._tables:
            return np.zeros(self.samples, bool)  # the labels name the activation, which is another one
        rows_a, rows_b = self.a.payloads.rows, self.b.payloads.rows
        a, b = self.a.layout, self.b.layout
        if self.a.type != self.b.type or a is None or b is None or rows_a is None or rows_b is None:
            return self.different_messages()
        return _hidden_differences(a, rows_a[self._places_a], b, rows_b[self._places_b], self._shown())

    def _shown(self) -> set[Place]:
        """Return the places of what signals show, of one recording alone too, and of stamps and names."""
        if self.a.type != JOINT_STATE:
            return {*STAMP, *((name, 0) for name in (*self.signals, *self.unmatched_signals))}
        places = range(max(len(self.a.names), len(self.b.names)))
        shown = {*STAMP, *((f'name[{place}]', 0) for place in places)}
        if self._has_columns('position'):
            shown |= {('position', place) for place in places}
        if self._has_columns('velocity'):
            rates = enumerate(self.a.names)
            shown |= {('velocity', place) for place, name in rates if self.a.derivative_unit(name)}
        return shown

    def _has_columns(self, part: str) -> bool:
        """Return whether a `JointState` holds a number for each of its names."""
        layouts = (self.a, self.a.layout), (self.b, self.b.layout)
        return all(layout and layout.numbers[part].count == len(series.names) for series, layout in layouts)

    def unmatched_samples(self) -> tuple[tuple[int, int], tuple[int, int]]:
        """Return how many samples A and B have alone: (within the time that both cover, outside of it)."""
        both = (self.of_a.keys, self.of_b.keys)
        if not all(map(len, both)):
            return (0, len(both[0])), (0, len(both[1]))
        low, high = max(keys.min() for keys in both), min(keys.max() for keys in both)
        within = [int(np.count_nonzero((keys >= low) & (keys <= high))) for keys in both]
        return tuple(
            (inside - self.samples, len(keys) - inside) for inside, keys in zip(within, both, strict=True)
        )  # type: ignore[return-value]

    def grid(self) -> Places | None:
        """Return the numbers of the matched samples in periods, None where they have no rate."""
        if not self.streamed or not self.samples:
            return None
        keys = self.of_a.keys[self._common_a]
        numbers = np.rint((keys - keys[0]) / self.of_a.step).astype(np.int64)
        return numbers if numbers[-1] < _LARGEST_GRID * len(numbers) else None

    @property
    def tells_switching(self) -> bool:
        """Whether it tells in both recordings how far damping was on, from 0 to 1."""
        if self.topic != CONTROL_TRACE.name or not self.samples or SWITCH not in self.signals:
            return False
        return bool(((self._switch >= 0.0) & (self._switch <= 1.0)).all())

    @property
    def _switch(self) -> NDArray[np.float64]:
        column = self.column(SWITCH)
        return np.concatenate([column.a, column.b])

    def compared(self, tolerances: Tolerances) -> TopicComparison:
        """Return how the topic differs; damping that is only on or off shows in the switching."""
        (only_a, outside_a), (only_b, outside_b) = self.unmatched_samples()
        switch = SWITCH if self.tells_switching and np.isin(self._switch, (0.0, 1.0)).all() else ''
        signals = {name: unit for name, unit in self.signals.items() if name != switch}
        hidden, found = 0, []
        if self.different_messages().any():
            hidden, grid = int(np.count_nonzero(self.hidden_differences())), self.grid()
            for name in signals:
                tolerance = tolerances.of(self.mount, self.topic, name)
                found.append(signal_difference(self.column(name), tolerance, grid, self.period))
        else:
            for name, unit in signals.items():
                found.append(SignalDifference(self.mount, self.topic, name, unit, self.samples))
        return TopicComparison(
            mount=self.mount,
            topic=self.topic,
            samples=self.samples,
            signals=tuple(found),
            only_a=only_a,
            only_b=only_b,
            outside_a=outside_a,
            outside_b=outside_b,
            differing_messages=hidden,
            remark=self._remark(),
        )

    def _remark(self) -> str:
        if self.a.type != self.b.type:
            return f'in A it is {self.a.type}, in B {self.b.type}'
        unmatched = self.unmatched_signals
        return f'only one of both has {", ".join(unmatched)}' if unmatched else ''

    @functools.cached_property
    def _tables(self) -> tuple[ForceTable, ForceTable] | None:
        """The last current-force tables of both, None where there are none of one shape."""
        if self.a.registered is not CURRENT_FORCE_TABLE or not self.samples:
            return None
        try:
            a, b = (from_message(series.message(len(series) - 1)) for series in (self.a, self.b))
        except (ForceTableMessageError, SeriesError):
            return None
        return (a, b) if a.current.shape == b.current.shape else None


def _in_turn(series: Series) -> Samples:
    numbers = np.arange(len(series))
    return Samples(numbers, numbers, 1.0, 1)


def _unit(unit: str) -> str:
    return '' if unit == '1' else unit


def _hidden_differences(a: Layout, rows_a: Rows, b: Layout, rows_b: Rows, shown: Collection[Place]) -> Mask:
    """Return which rows (messages x bytes) of A differ from those of B in what is not `shown`.

    Unknown (NaN) in both is equal; bytes between the numbers do not count.
    """
    texts = [path for path in a.strings.keys() | b.strings.keys() if (path, 0) not in shown]
    if any(a.strings.get(path) != b.strings.get(path) for path in texts):
        return np.ones(len(rows_a), bool)  # the texts of a layout are those of all its messages
    different = np.zeros(len(rows_a), bool)
    for path in a.numbers.keys() | b.numbers.keys():
        one, other = a.numbers.get(path, _NONE), b.numbers.get(path, _NONE)
        hidden = [place for place in range(max(one.count, other.count)) if (path, place) not in shown]
        if hidden and one.count != other.count:
            return np.ones(len(rows_a), bool)
        if hidden:
            different |= ~_same(_run(one, rows_a), _run(other, rows_b))[:, hidden].all(axis=1)
    return different


def _run(numbers: Numbers, rows: Rows) -> NDArray:
    """Return a run of numbers, messages x numbers."""
    size = numbers.count * numbers.dtype.itemsize
    return np.ascontiguousarray(rows[:, numbers.offset : numbers.offset + size]).view(numbers.dtype)


def _same(a: NDArray, b: NDArray) -> Mask:
    if a.dtype.kind == b.dtype.kind == 'f':
        return ((a == b) & (np.signbit(a) == np.signbit(b))) | (np.isnan(a) & np.isnan(b))
    return np.asarray(a == b)
