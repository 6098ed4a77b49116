"""Which sample of one recording belongs to which of another, topic by topic, and what time it has."""

from collections.abc import Mapping
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from engine_mount.recordings.difference import Column, Places, SignalDifference, Tolerances, signal_difference
from engine_mount.recordings.metadata import registered_topic
from engine_mount.recordings.recording import Recording
from engine_mount.recordings.series import STAMP, Series, SeriesError
from engine_mount.recordings.times import TimeAxis, Times, distinct, is_in
from mount_ros.topics import (
    CONTROL_TRACE,
    CURRENT_FORCE_TABLE,
    CURRENT_SETPOINT,
    DISPLACEMENT,
    JOINT_STATE,
    Topic,
)

SWITCH = 'damping_active'
_ANCHORS = (DISPLACEMENT, CURRENT_SETPOINT, CONTROL_TRACE)
_SAME_CLOCK = 0.5  # chosen: this share of the stamps in the common span must be equal


class ComparisonError(ValueError):
    """Two recordings have nothing that could be compared; the text says what they have."""


class Alignment(NamedTuple):
    """How samples of A and B of one mount become one time axis.

    With `same_stamps` samples of equal stamp belong together, else samples of equal number, counted from the
    first sample of the topic `anchor`. `firsts` are its first stamps in A and B (ns). Times are in s on the
    time axis of A.
    """

    same_stamps: bool
    anchor: str
    firsts: tuple[int, int]
    axis: TimeAxis

    @property
    def shift(self) -> int:
        """What is added to the stamps of B, ns."""
        return 0 if self.same_stamps else self.firsts[0] - self.firsts[1]

    @property
    def sentence(self) -> str:
        """What was chosen, for people."""
        if self.same_stamps:
            return 'samples are matched by their stamps, which both recordings share'
        return (
            f'stamps differ: B is shifted by {self.shift / 1e9:+.6f} s, so that the first samples of '
            f'{self.anchor} coincide, and samples are counted from there'
        )


def mount_of(name: str, registered: Topic | None) -> str:
    """Return the part of a full name before a registered topic: `mount_left/`, or nothing."""
    return '' if registered is None else name.removesuffix(registered.name).lstrip('/')


def registered_in(recording: Recording, name: str) -> Topic | None:
    """Return the registered topic that `name` is in `recording`, by name and type."""
    return registered_topic(name, recording.topics[name].type)


def align(a: Recording, b: Recording) -> dict[str, Alignment]:
    """Return how to match the samples of `a` and `b`, by mount: each has a clock of its own.

    The anchor of a mount is the first of its topics with stamps in both; where there is no mount, a foreign
    topic. Raises `ComparisonError`.
    """
    names = [name for name in a if name in b.topics]
    if not names:
        raise ComparisonError(
            f'no topic is in both recordings: A has {", ".join(a) or "none"}; B has {", ".join(b) or "none"}'
        )

    def rank(name: str) -> tuple[bool, int]:
        topic = registered_in(a, name)
        foreign = topic is None or topic.name.startswith('/')
        return foreign, _ANCHORS.index(topic) if topic in _ANCHORS else len(_ANCHORS)

    found: dict[str, Alignment] = {}
    for name in sorted(names, key=rank):
        mount = mount_of(name, registered_in(a, name))
        if mount not in found and not (found and rank(name)[0]) and is_stamped(a[name], b[name]):
            found[mount] = _alignment(a[name], b[name], a.time_axis)
    if not found:
        raise ComparisonError('no topic with stamps has messages in both recordings; nothing can be matched')
    return found


def alignment_sentence(alignments: Mapping[str, Alignment]) -> str:
    """Return what was chosen, for people, once where all mounts share their stamps."""
    return '; '.join(dict.fromkeys(each.sentence for each in alignments.values()))


def share_stamps(a: Recording, b: Recording) -> bool:
    """Return whether samples of `a` and `b`, of the first mount, share stamps; raises `ComparisonError`."""
    return next(iter(align(a, b).values())).same_stamps


def is_stamped(*all_series: Series) -> bool:
    """Return whether each of the series has stamps."""
    try:
        return all(len(series.stamps) for series in all_series)
    except SeriesError:
        return False


def _alignment(a: Series, b: Series, axis: TimeAxis) -> Alignment:
    stamps = distinct(a.stamps), distinct(b.stamps)
    low, high = max(each[0] for each in stamps), min(each[-1] for each in stamps)
    inside = [each[(each >= low) & (each <= high)] for each in stamps]
    fewer = min(map(len, inside))
    return Alignment(
        same_stamps=bool(fewer and np.count_nonzero(is_in(*inside)) >= _SAME_CLOCK * fewer),
        anchor=a.topic.lstrip('/'),
        firsts=(int(stamps[0][0]), int(stamps[1][0])),
        axis=axis,
    )


class TopicComparison(NamedTuple):
    """One topic of both: its signals, and how many samples are in one recording alone.

    Samples are missing within the time that both recordings cover with this topic, those before and behind it
    are outside.
    """

    mount: str  # `mount_left/`, or nothing
    topic: str
    samples: int
    missing_in_b: int
    missing_in_a: int
    outside_in_a: int
    outside_in_b: int
    differing_messages: int  # in what no signal shows
    remark: str
    signals: tuple[SignalDifference, ...]

    @property
    def name(self) -> str:
        """Mount and topic."""
        return f'{self.mount}{self.topic}'

    def figures(self) -> dict[str, Any]:
        """Return the figures for JSON."""
        own = {name: value for name, value in self._asdict().items() if name not in ('mount', 'topic')}
        return {**own, 'signals': {signal.signal: signal.figures() for signal in self.signals}}


class MatchedTopic:
    """Samples that both recordings have of a topic, and the numbers in them.

    Streams are matched by their stamps, all other topics message by message in the order of recording.
    """

    def __init__(self, a: Series, b: Series, alignment: Alignment):
        self.a, self.b = a, b
        self.topic = a.registered.name if a.registered else a.topic.lstrip('/')
        self.mount = mount_of(a.topic, a.registered)
        rated = a.registered is None or a.registered.rate > 0.0
        samples_of = _stamped_samples if rated and is_stamped(a, b) else _counted_samples
        keys_a, order_a, self.period = samples_of(a, alignment, 0)
        keys_b, order_b, _ = samples_of(b, alignment, 1)
        self._keys = keys_a, keys_b
        _, common_a, common_b = np.intersect1d(
            _numbered(keys_a), _numbered(keys_b), assume_unique=True, return_indices=True
        )
        self._places = order_a[common_a], order_b[common_b]
        self._axis = alignment.axis
        self.samples = len(common_a)

    @cached_property
    def time(self) -> NDArray[np.float64]:
        """Times of the matched samples in A, s."""
        if is_stamped(self.a):
            return self._axis.of_stamps(self.a.stamps[self._places[0]])
        return self._axis.of_logs(self.a.receive_times[self._places[0]])

    @cached_property
    def signals(self) -> dict[str, str]:
        """The signals of both as {name: unit}; a derivative is called `d(name)/dt`."""
        if self.a.registered is CURRENT_FORCE_TABLE:
            return {}
        signals: dict[str, str] = {}
        for name in self._names[0]:
            if name in self._names[1] and not name.startswith('header.'):
                signals[name] = self.a.unit(name)
                if rate := self.a.derivative_unit(name):
                    signals[f'd({name})/dt'] = rate
        return {name: '' if unit == '1' else unit for name, unit in signals.items()}

    def column(self, signal: str) -> Column:
        """Return the matched samples of one of the `signals`; raises `SeriesError`."""
        origin = self.mount, self.topic, signal, self.signals[signal]
        derived = signal.startswith('d(') and signal not in self.a.names
        name = signal.removeprefix('d(').removesuffix(')/dt') if derived else signal
        a, b = (each.derivative(name) if derived else each[name] for each in (self.a, self.b))
        return Column(*origin, self.time, a[self._places[0]], b[self._places[1]])

    @cached_property
    def tells_switching(self) -> bool:
        """Whether it tells in both recordings how far damping was on, from 0 to 1."""
        if self.topic != CONTROL_TRACE.name or not self.samples or SWITCH not in self.signals:
            return False
        return bool(((self._switch >= 0.0) & (self._switch <= 1.0)).all())

    def compared(self, tolerances: Tolerances) -> TopicComparison:
        """Return how the topic differs; damping that is only on or off shows in the switching."""
        hidden = SWITCH if self.tells_switching and np.isin(self._switch, (0.0, 1.0)).all() else ''
        signals = [
            signal_difference(self.column(name), tolerances.of(self.topic, name))
            for name in self.signals
            if name != hidden
        ]
        within = [0, 0]
        if all(map(len, self._keys)):
            low, high = max(each[0] for each in self._keys), min(each[-1] for each in self._keys)
            within = [int(np.count_nonzero((each >= low) & (each <= high))) for each in self._keys]
        return TopicComparison(
            mount=self.mount,
            topic=self.topic,
            samples=self.samples,
            missing_in_b=within[0] - self.samples,
            missing_in_a=within[1] - self.samples,
            outside_in_a=len(self._keys[0]) - within[0],
            outside_in_b=len(self._keys[1]) - within[1],
            differing_messages=self._differing_messages(),
            remark=self._remark,
            signals=tuple(signals),
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
        if self._remark:
            return 0
        a, b = self.a.layout, self.b.layout
        if a is None or b is None or self.a.registered is CURRENT_FORCE_TABLE:
            pairs = zip(*(places.tolist() for places in self._places), strict=True)
            return sum(_content(self.a, i) != _content(self.b, k) for i, k in pairs)
        if a.numbers != b.numbers or a.strings != b.strings:
            return self.samples
        unseen = [
            byte
            for path, numbers in a.numbers.items()
            for place in range(numbers.count)
            if not self._is_shown(path, place)
            for byte in numbers.bytes_at(place)
        ]
        one, other = (
            series.payloads.messages[places[:, None], unseen]
            for series, places in zip((self.a, self.b), self._places, strict=True)
        )
        return int(np.count_nonzero((one != other).any(axis=1)))

    def _is_shown(self, path: str, place: int) -> bool:
        """Return whether a number of a message is part of a stamp or of a signal."""
        if path in STAMP:
            return True
        if self.a.type != JOINT_STATE:
            return path in self.signals and place == 0
        names = self._names[0]
        if self.a.layout is None or self.a.layout.numbers[path].count != len(names):
            return False
        return path == 'position' or (path == 'velocity' and bool(self.a.derivative_unit(names[place])))

    @cached_property
    def _switch(self) -> NDArray[np.float64]:
        column = self.column(SWITCH)
        return np.concatenate([column.a, column.b])


def _stamped_samples(series: Series, alignment: Alignment, side: int) -> tuple[Times, Places, float]:
    """Return keys (ns, or numbers of periods) of a stamped topic, their places, and the period (s).

    `side` is 0 for A, 1 for B. Steps are rounded one by one, so that a clock that runs fast or slow does not
    add up.
    """
    order = np.argsort(series.stamps, kind='stable')
    stamps = series.stamps[order]
    steps = np.diff(stamps)
    rising = steps[steps > 0]
    period = float(np.median(rising)) / 1e9 if len(rising) else 1.0
    if alignment.same_stamps:
        return stamps, order, period
    begin = stamps[:1] - alignment.firsts[side]
    numbers = np.cumsum(np.rint(np.concatenate([begin, steps]) / (1e9 * period)).astype(np.int64))
    return numbers, order, period


def _counted_samples(series: Series, alignment: Alignment, side: int) -> tuple[Times, Places, float]:
    numbers = np.arange(len(series))
    return numbers, numbers, 1.0


def _numbered(keys: Times) -> NDArray[np.void]:
    """Return keys (rising) that are unique: the second sample of a key is another than the first."""
    numbered = np.empty(len(keys), [('key', np.int64), ('repeat', np.int64)])
    numbered['key'], numbered['repeat'] = keys, np.arange(len(keys)) - np.searchsorted(keys, keys)
    return numbered


def _content(series: Series, index: int) -> bytes:
    """Return the bytes of a message without its stamp and without the options of its encoding.

    Of a force table those of its numbers: its labels name the activation, which is another one.
    """
    raw, layout = series.payloads[index], series.layout_at(index)
    if layout and series.registered is CURRENT_FORCE_TABLE:
        runs = [
            range(run.bytes_at(0).start, run.bytes_at(run.count).start) for run in layout.numbers.values()
        ]
        return b''.join(raw[run.start : run.stop] for run in runs)
    seconds = layout.numbers.get(STAMP[0]) if layout else None
    place = len(raw) if seconds is None else seconds.offset
    return raw[:2] + raw[4:place] + raw[place + 8 :]
