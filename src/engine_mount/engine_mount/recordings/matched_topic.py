"""One topic of two recordings, sample beside sample: its signals, and what no signal shows."""

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from engine_mount.recordings.alignment import (
    Alignment,
    Samples,
    common_samples,
    is_stamped,
    mount_of,
    samples_of,
)
from engine_mount.recordings.difference import Column, Places, Quantity, SignalDifference, signal_difference
from engine_mount.recordings.layout import Numbers
from engine_mount.recordings.series import STAMP, Series, SeriesError
from engine_mount.recordings.tolerances import Tolerances
from mount_ros.messages.force_table import ForceTable, from_message
from mount_ros.messages.scalars import MessageError
from mount_ros.topics import CONTROL_TRACE, CURRENT_FORCE_TABLE, JOINT_STATE

SWITCH = 'damping_active'
_LARGEST_GRID = 8  # times the samples, chosen: with more holes it is no signal of a fixed rate
_TABLE = {'current': 'A', 'normal_force': 'N'}


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
        self._streamed = rated and is_stamped(a) and is_stamped(b)
        self._of_a, self._of_b = (
            samples_of(series, alignment, side) if self._streamed else _in_turn(series)
            for side, series in enumerate((a, b))
        )
        self._common, common_b = common_samples(self._of_a, self._of_b)
        self._places_a, self._places_b = self._of_a.order[self._common], self._of_b.order[common_b]
        self._axis = alignment.axis
        self.samples, self.period = len(self._common), self._of_a.period

    @cached_property
    def time(self) -> NDArray[np.float64]:
        """Times of the matched samples in A, s."""
        if is_stamped(self.a):
            return self._axis.of_stamps(self.a.stamps[self._places_a])
        return self._axis.of_logs(self.a.receive_times[self._places_a])

    @cached_property
    def signals(self) -> dict[str, str]:
        """The signals of both as {name: unit}; a derivative is called `d(name)/dt`."""
        if self.a.registered is CURRENT_FORCE_TABLE:
            return dict(_TABLE) if self._tables else {}
        signals: dict[str, str] = {}
        for name in self._names[0]:
            if name in self._names[1] and not name.startswith('header.'):
                signals[name] = self.a.unit(name)
                if rate := self.a.derivative_unit(name):
                    signals[f'd({name})/dt'] = rate
        return {name: '' if unit == '1' else unit for name, unit in signals.items()}

    def column(self, signal: str) -> Column:
        """Return the matched samples of one of the `signals`; raises `SeriesError`."""
        quantity = Quantity(self.mount, self.topic, signal, self.signals[signal])
        if self._tables:
            a, b = (getattr(table, signal) for table in self._tables)
            return Column(quantity, np.full(len(a), self.time[-1]), a, b)
        if signal.startswith('d(') and signal not in self.a.names:
            name = signal.removeprefix('d(').removesuffix(')/dt')
            a, b = self.a.derivative(name), self.b.derivative(name)
        else:
            a, b = self.a[signal], self.b[signal]
        return Column(quantity, self.time, a[self._places_a], b[self._places_b])

    @cached_property
    def tells_switching(self) -> bool:
        """Whether it tells in both recordings how far damping was on, from 0 to 1."""
        if self.topic != CONTROL_TRACE.name or not self.samples or SWITCH not in self.signals:
            return False
        return bool(((self._switch >= 0.0) & (self._switch <= 1.0)).all())

    def compared(self, tolerances: Tolerances) -> TopicComparison:
        """Return how the topic differs; damping that is only on or off shows in the switching."""
        switch = SWITCH if self.tells_switching and np.isin(self._switch, (0.0, 1.0)).all() else ''
        grid = self._grid()
        found = [
            signal_difference(
                self.column(name), tolerances.of(self.mount, self.topic, name), grid, self.period
            )
            for name in self.signals
            if name != switch
        ]
        (only_a, outside_a), (only_b, outside_b) = self._unmatched()
        return TopicComparison(
            mount=self.mount,
            topic=self.topic,
            samples=self.samples,
            signals=tuple(found),
            only_a=only_a,
            only_b=only_b,
            outside_a=outside_a,
            outside_b=outside_b,
            differing_messages=self._differing_messages(),
            remark=self._remark,
        )

    @cached_property
    def _names(self) -> tuple[tuple[str, ...], tuple[str, ...]]:
        try:
            return self.a.names, self.b.names
        except SeriesError:
            return (), ()  # no numbers at fixed places

    @cached_property
    def _remark(self) -> str:
        if self.a.type != self.b.type:
            return f'in A it is {self.a.type}, in B {self.b.type}'
        unmatched = sorted(set(self._names[0]) ^ set(self._names[1])) if self.samples else []
        return f'only one of both has {", ".join(unmatched)}' if unmatched else ''

    def _differing_messages(self) -> int:
        """Return how many matched messages differ where no signal shows it; stamps do not count.

        Where one of them has signals that the other lacks, the remark says so, and nothing else is compared.
        """
        if self.a.type != self.b.type:
            return self.samples  # the same bytes mean something else
        if self._tables or self._remark:
            return 0  # the labels of tables name the activation, which is another one
        rows, layouts = [each.payloads.rows for each in (self.a, self.b)], [self.a.layout, self.b.layout]
        if any(each is None for each in (*rows, *layouts)):
            pairs = zip(self._places_a.tolist(), self._places_b.tolist(), strict=True)
            return sum(self.a.content(i) != self.b.content(k) for i, k in pairs)
        a, b = layouts
        if a.numbers != b.numbers or a.strings != b.strings:
            return self.samples
        different = np.zeros(self.samples, bool)
        for path, numbers in a.numbers.items():
            hidden = [place for place in range(numbers.count) if not self._is_shown(path, place)]
            if hidden:
                one, other = (
                    _run(numbers, each[places])[:, hidden]
                    for each, places in zip(rows, (self._places_a, self._places_b), strict=True)
                )
                bits = f'u{numbers.dtype.itemsize}'
                unlike = (one.view(bits) != other.view(bits)) & ~((one != one) & (other != other))
                different |= unlike.any(axis=1)
        return int(np.count_nonzero(different))

    def _is_shown(self, path: str, place: int) -> bool:
        """Return whether a number of a message is part of a stamp or of a signal."""
        if (path, place) in STAMP:
            return True
        if self.a.type != JOINT_STATE:
            return path in self.signals and place == 0
        names = self._names[0]
        if self.a.layout is None or self.a.layout.numbers[path].count != len(names):
            return False
        return path == 'position' or (path == 'velocity' and bool(self.a.derivative_unit(names[place])))

    def _unmatched(self) -> list[tuple[int, int]]:
        """Return how many samples A and B have alone: (within the time that both cover, outside of it)."""
        both = (self._of_a.keys, self._of_b.keys)
        if not all(map(len, both)):
            return [(0, len(keys)) for keys in both]
        low, high = max(keys[0] for keys in both), min(keys[-1] for keys in both)
        within = [int(np.count_nonzero((keys >= low) & (keys <= high))) for keys in both]
        return [
            (inside - self.samples, len(keys) - inside) for inside, keys in zip(within, both, strict=True)
        ]

    def _grid(self) -> Places | None:
        """Return the numbers of the matched samples in periods, None where they have no rate."""
        if not self._streamed or not self.samples:
            return None
        keys = self._of_a.keys[self._common]
        numbers = np.rint((keys - keys[0]) / self._of_a.step).astype(np.int64)
        return numbers if numbers[-1] < _LARGEST_GRID * len(numbers) else None

    @cached_property
    def _switch(self) -> NDArray[np.float64]:
        column = self.column(SWITCH)
        return np.concatenate([column.a, column.b])

    @cached_property
    def _tables(self) -> tuple[ForceTable, ForceTable] | None:
        """The last current-force tables of both, None where there are none of one shape."""
        if self.a.registered is not CURRENT_FORCE_TABLE or not self.samples:
            return None
        try:
            a, b = (from_message(series.message(len(series) - 1)) for series in (self.a, self.b))
        except (MessageError, SeriesError):
            return None
        return (a, b) if a.current.shape == b.current.shape else None


def _run(numbers: Numbers, rows: NDArray[np.uint8]) -> NDArray[Any]:
    """Return a run of numbers, messages x numbers."""
    size = numbers.count * numbers.dtype.itemsize
    return np.ascontiguousarray(rows[:, numbers.offset : numbers.offset + size]).view(numbers.dtype)


def _in_turn(series: Series) -> Samples:
    numbers = np.arange(len(series))
    return Samples(numbers, numbers, 1.0, 1)
