"""Which sample of one recording belongs to which of another, and what time it is said to have."""

from collections.abc import Collection, Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from engine_mount.recordings.recording import Recording
from engine_mount.recordings.run.session import recorded_sample_rate
from engine_mount.recordings.series import Series, SeriesError, Times
from engine_mount.recordings.time_axis import TimeAxis
from engine_mount.recordings.times import distinct, is_in
from mount_models.sampling import SAMPLE_RATE
from mount_recorder.topic_groups import registered_topic
from mount_ros.topics import CONTROL_TRACE, CURRENT_SETPOINT, DISPLACEMENT, Topic

Places = NDArray[np.int64]

_ANCHORS = (DISPLACEMENT, CURRENT_SETPOINT, CONTROL_TRACE)
_SAME_CLOCK = 0.5  # chosen: this share of the stamps in the common span must be equal


class ComparisonError(ValueError):
    """Two recordings have nothing that could be compared; the text says what they have."""


class Counter:
    """Counts the samples of one recording by those of its anchoring topic.

    Steps are rounded one by one, so that a clock that runs fast or slow does not add up.
    """

    def __init__(self, anchor: Series, sample_rate: float = SAMPLE_RATE):
        """`sample_rate` (Hz) is that of the recording."""
        self.stamps = distinct(anchor.stamps)
        self.sample_rate = sample_rate
        self.period = _period(anchor, self.stamps, sample_rate)
        self._numbers = _steps(self.stamps, self.period)

    @property
    def first(self) -> int:
        """Its first stamp, ns."""
        return int(self.stamps[0])

    def numbers(self, stamps: Times, period: float) -> Times:
        """Return the numbers of rising `stamps` (ns) in `period` (s) from the first sample of the anchor."""
        nearest = np.clip(np.searchsorted(self.stamps, stamps), 0, len(self.stamps) - 1)
        passed = self._numbers[nearest] + (stamps - self.stamps[nearest]) / (1e9 * self.period)
        numbers = np.rint(passed * (self.period / period)).astype(np.int64)
        if np.isin(stamps, self.stamps).mean() >= _SAME_CLOCK:
            return numbers
        # Stamps of another clock may stand at any place between those of the anchor: they count themselves.
        return numbers[0] + _steps(stamps, period)


@dataclass(frozen=True)
class Alignment:
    """How samples of A and B become one time axis.

    With `same_stamps` samples of equal stamp belong together, else samples of equal number, counted from the
    first sample of the topic `anchor`. Times are in s on the time axis of A.
    """

    same_stamps: bool
    anchor: str
    a: Counter
    b: Counter
    axis: TimeAxis

    @property
    def shift(self) -> int:
        """What is added to the stamps of B, ns."""
        return 0 if self.same_stamps else self.a.first - self.b.first

    @property
    def sentence(self) -> str:
        """What was chosen, for people."""
        if self.same_stamps:
            return 'samples are matched by their stamps, which both recordings share'
        return (
            f'stamps differ: B is shifted by {self.shift / 1e9:+.6f} s, so that the first samples of '
            f'{self.anchor} coincide, and samples are counted from there'
        )

    def time(self, stamps: Times) -> NDArray[np.float64]:
        """Return the times (s) of stamps of A."""
        return self.axis.of_stamps(stamps)

    def received(self, log_times: Times) -> NDArray[np.float64]:
        """Return the times (s) of messages of A by when they were received."""
        return self.axis.of_logs(log_times)


@dataclass(frozen=True)
class Alignments:
    """The alignment of each mount of A: its electronics have a clock of their own.

    What belongs to no mount is aligned as the first one.
    """

    by_mount: Mapping[str, Alignment]

    @property
    def first(self) -> Alignment:
        """That of the only mount, or of the first."""
        return next(iter(self.by_mount.values()))

    @property
    def sentence(self) -> str:
        """What was chosen, for people."""
        if all(each.same_stamps for each in self.by_mount.values()):
            return self.first.sentence
        return '; '.join(each.sentence for each in self.by_mount.values())

    def of(self, a: Series) -> Alignment:
        """Return the alignment of a topic of A."""
        return self.by_mount.get(mount_of(a.topic, a.registered), self.first)


@dataclass(frozen=True)
class Samples:
    """Samples of one topic in the order of their keys; equal keys belong together."""

    keys: Times  # ns, or numbers of periods
    order: Places  # where each stands in its series
    period: float  # s between neighbouring keys that differ by `step`
    step: int


def mount_of(name: str, registered: Topic | None) -> str:
    """Return what stands before a registered topic in its full name: `mount_left/`, or nothing."""
    return '' if registered is None else name.removesuffix(registered.name).lstrip('/')


def registered_in(recording: Recording, name: str) -> Topic | None:
    """Return the registered topic that `name` is in `recording`, by name and type."""
    return registered_topic(name, recording.topics[name].type)


def paired_topics(a: Recording, b: Recording) -> dict[str, str]:
    """Return {topic of A: topic of B}: of one name, and those of the only mount that is in A and B alone."""
    pairs = {name: name for name in a if name in b.topics}
    alone = _mounts(a, pairs), _mounts(b, pairs)
    if all(len(mounts) == 1 for mounts in alone):
        (of_a,), (of_b,) = (mounts.values() for mounts in alone)
        pairs |= {name: of_b[topic] for topic, name in of_a.items() if topic in of_b}
    return pairs


def _mounts(recording: Recording, paired: Collection[str]) -> dict[str, dict[str, str]]:
    """Return {mount: {registered topic: full name}} of the topics that are not paired.

    A mount is where there is a control loop; only where there is none, any other topic makes one.
    """
    mounts: dict[str, dict[str, str]] = {}
    for name in recording:
        registered = registered_in(recording, name)
        if name not in paired and registered is not None:
            mounts.setdefault(mount_of(name, registered), {})[registered.name] = name
    anchors = {topic.name for topic in _ANCHORS}
    return {mount: topics for mount, topics in mounts.items() if anchors & topics.keys()} or mounts


def align(a: Recording, b: Recording) -> Alignments:
    """Return how to match the samples of `a` and `b`; raises `ComparisonError`."""
    return Alignments({mount: _aligned(a, b, *pair) for mount, pair in _anchors(a, b).items()})


def share_stamps(a: Recording, b: Recording) -> bool:
    """Return whether samples of `a` and `b`, of the first mount, have stamps in common.

    As `align` finds it; raises `ComparisonError`.
    """
    stamps = [distinct(series.stamps) for series in next(iter(_anchors(a, b).values()))]
    return _share(*stamps) >= _SAME_CLOCK


def _aligned(a: Recording, b: Recording, first: Series, second: Series) -> Alignment:
    of_a, of_b = (
        Counter(series, recorded_sample_rate(recording, _namespace(series)))
        for recording, series in ((a, first), (b, second))
    )
    return Alignment(
        same_stamps=_share(of_a.stamps, of_b.stamps) >= _SAME_CLOCK,
        anchor=first.topic.lstrip('/'),
        a=of_a,
        b=of_b,
        axis=a.time_axis,
    )


def samples_of(series: Series, alignment: Alignment, counter: Counter) -> Samples:
    """Return the samples of a stamped topic; `counter` is that of its recording."""
    order = np.argsort(series.stamps, kind='stable')
    stamps = series.stamps[order]
    period = _period(series, stamps, counter.sample_rate)
    if alignment.same_stamps:
        return Samples(stamps, order, period, max(1, round(1e9 * period)))
    return Samples(counter.numbers(stamps, period), order, period, 1)


def common_samples(a: Samples, b: Samples) -> tuple[Places, Places]:
    """Return where the samples that both have stand in `a` and `b`, in the order of their keys."""
    keys_a, keys_b = a.keys, b.keys
    if _repeats(keys_a).any() or _repeats(keys_b).any():
        keys_a, keys_b = _numbered(keys_a), _numbered(keys_b)
    _, places_a, places_b = np.intersect1d(keys_a, keys_b, assume_unique=True, return_indices=True)
    return places_a, places_b


def _anchors(a: Recording, b: Recording) -> dict[str, tuple[Series, Series]]:
    """Return for each mount the first topic with stamps in both; where there is none, of a foreign topic."""
    pairs = paired_topics(a, b)
    if not pairs:
        raise ComparisonError(
            f'no topic is in both recordings: A has {", ".join(a) or "none"}; B has {", ".join(b) or "none"}'
        )
    ranks = {topic: rank for rank, topic in enumerate(_ANCHORS)}
    known = {name: registered_in(a, name) for name in pairs}
    anchors: dict[str, tuple[Series, Series]] = {}
    for name in sorted(
        pairs, key=lambda name: (not _of_a_mount(known[name]), ranks.get(known[name], len(ranks)))
    ):
        mount = mount_of(name, known[name])
        if mount in anchors or (anchors and not _of_a_mount(known[name])):
            continue
        first, second = a[name], b[pairs[name]]
        if len(first) and len(second) and is_stamped(first) and is_stamped(second):
            anchors[mount] = first, second
    if not anchors:
        raise ComparisonError('no topic with stamps has messages in both recordings; nothing can be matched')
    return anchors


def _of_a_mount(registered: Topic | None) -> bool:
    return registered is not None and not registered.name.startswith('/')


def is_stamped(series: Series) -> bool:
    """Return whether the messages carry stamps."""
    try:
        return len(series.stamps) > 0
    except SeriesError:
        return False


def _share(a: Times, b: Times) -> float:
    """Return the share of stamps, which rise, that are equal where both recordings have some."""
    low, high = max(a[0], b[0]), min(a[-1], b[-1])
    inside_a, inside_b = (
        each[np.searchsorted(each, low) : np.searchsorted(each, high, side='right')] for each in (a, b)
    )
    fewer = min(len(inside_a), len(inside_b))
    return float(np.count_nonzero(is_in(inside_a, inside_b))) / fewer if fewer else 0.0


def _steps(stamps: Times, period: float) -> Times:
    """Return the numbers of rising stamps (ns) in periods (s) from the first."""
    return np.cumsum(np.rint(np.diff(stamps, prepend=stamps[0]) / (1e9 * period)).astype(np.int64))


def _namespace(series: Series) -> str:
    return f'/{mount_of(series.topic, series.registered)}'


def _period(series: Series, stamps: Times, sample_rate: float) -> float:
    if series.registered is not None and series.registered.rate:
        return 1.0 / series.registered.rate_at(sample_rate)
    steps = np.diff(stamps)
    steps = steps[steps > 0]
    return float(np.median(steps)) / 1e9 if len(steps) else 1.0


def _repeats(keys: Times) -> NDArray[np.bool_]:
    return np.concatenate([np.zeros(min(1, len(keys)), bool), np.diff(keys) == 0])


def _numbered(keys: Times) -> NDArray[np.void]:
    """Return keys that are unique: the second sample of a key is another than the first."""
    places = np.arange(len(keys))
    begins = np.maximum.accumulate(np.where(_repeats(keys), 0, places))
    numbered = np.empty(len(keys), [('key', np.int64), ('repeat', np.int64)])
    numbered['key'], numbered['repeat'] = keys, places - begins
    return numbered
