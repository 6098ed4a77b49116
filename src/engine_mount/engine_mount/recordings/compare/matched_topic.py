"""One topic of two recordings, sample beside sample."""

import functools

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
from engine_mount.recordings.compare.hidden_differences import Place, hidden_differences
from engine_mount.recordings.compare.signal_difference import Column
from engine_mount.recordings.messages.layout import OPTIONS
from engine_mount.recordings.messages.series import STAMP, STAMP_BYTES, Series, SeriesError
from mount_ros.messages.force_table import ForceTable, ForceTableMessageError, from_message
from mount_ros.topics import CURRENT_FORCE_TABLE, JOINT_STATE

Places = NDArray[np.int64]
Mask = NDArray[np.bool_]

_LARGEST_GRID = 8  # times the samples, chosen: with more holes it is no signal of a fixed rate
_TABLE = {'current': 'A', 'normal_force': 'N'}


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
        if self._tables:
            a, b = (getattr(table, signal) for table in self._tables)
            return Column(self.mount, self.topic, signal, unit, np.full(len(a), self.time[-1]), a, b)
        if signal.startswith('d(') and signal not in self.a.names:
            name = signal.removeprefix('d(').removesuffix(')/dt')
            a, b = self.a.derivative(name), self.b.derivative(name)
        else:
            a, b = self.a[signal], self.b[signal]
        return Column(self.mount, self.topic, signal, unit, self.time, a[self._places_a], b[self._places_b])

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
        return hidden_differences(a, rows_a[self._places_a], b, rows_b[self._places_b], self._shown())

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
