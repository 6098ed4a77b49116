"""Which sample of one recording belongs to which of another, and what time it is said to have."""

from collections.abc import Collection, Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from engine_mount.recordings.recording import Recording
from engine_mount.recordings.series import Series, SeriesError, Times
from engine_mount.recordings.session import recorded_sample_rate
from engine_mount.recordings.time_axis import TimeAxis
from engine_mount.recordings.times import distinct, is_in
from mount_recorder.topic_groups import registered_topic
from mount_ros.topics import CONTROL_TRACE, CURRENT_SETPOINT, DISPLACEMENT, Topic

Places = NDArray[np.int64]

_ANCHORS = (DISPLACEMENT, CURRENT_SETPOINT, CONTROL_TRACE)
_SAME_CLOCK = 0.5  # chosen: this share of the stamps in the common span must be equal


class ComparisonError(ValueError):
    """Two recordings have nothing that could be compared; the text says what they have."""


@dataclass(frozen=True)
class Alignment:
    """How samples of A and B of one mount become one time axis.

    With `same_stamps` samples of equal stamp belong together, else samples of equal number, counted from the
    first sample of the topic `anchor`. `firsts` are its first stamps in A and B (ns), `sample_rates` theirs
    (Hz). Times are in s on the time axis of A.
    """

    same_stamps: bool
    anchor: str
    firsts: tuple[int, int]
    sample_rates: tuple[float, float]
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


def align(a: Recording, b: Recording) -> dict[str, Alignment]:
    """Return how to match the samples of `a` and `b`, by mount: each has a clock of its own.

    The anchor of a mount is the first of its topics with stamps in both; where there is no mount, a foreign
    topic. Raises `ComparisonError`.
    """
    pairs = paired_topics(a, b)
    if not pairs:
        raise ComparisonError(
            f'no topic is in both recordings: A has {", ".join(a) or "none"}; B has {", ".join(b) or "none"}'
        )
    found: dict[str, Alignment] = {}
    registered = {name: registered_in(a, name) for name in pairs}

    def rank(name: str) -> tuple[bool, int]:
        topic = registered[name]
        return not _of_a_mount(topic), _ANCHORS.index(topic) if topic in _ANCHORS else len(_ANCHORS)

    for name in sorted(pairs, key=rank):
        mount = mount_of(name, registered[name])
        if mount not in found and (not found or _of_a_mount(registered[name])):
            first, second = a[name], b[pairs[name]]
            if is_stamped(first) and is_stamped(second):
                found[mount] = _alignment(a, b, first, second)
    if not found:
        raise ComparisonError('no topic with stamps has messages in both recordings; nothing can be matched')
    return found


def alignment_sentence(alignments: Mapping[str, Alignment]) -> str:
    """Return what was chosen, for people, once where all mounts share their stamps."""
    return '; '.join(dict.fromkeys(each.sentence for each in alignments.values()))


def share_stamps(a: Recording, b: Recording) -> bool:
    """Return whether samples of `a` and `b`, of the first mount, share stamps; raises `ComparisonError`."""
    return next(iter(align(a, b).values())).same_stamps


def samples_of(series: Series, alignment: Alignment, side: int) -> Samples:
    """Return the samples of a stamped topic of A (`side` 0) or B (1).

    Steps are rounded one by one, so that a clock that runs fast or slow does not add up.
    """
    order = np.argsort(series.stamps, kind='stable')
    stamps = series.stamps[order]
    steps = np.diff(stamps)
    if series.registered is not None and series.registered.rate:
        period = 1.0 / series.registered.rate_at(alignment.sample_rates[side])
    else:
        rising = steps[steps > 0]
        period = float(np.median(rising)) / 1e9 if len(rising) else 1.0
    if alignment.same_stamps:
        return Samples(stamps, order, period, max(1, round(1e9 * period)))
    begin = stamps[:1] - alignment.firsts[side]
    numbers = np.cumsum(np.rint(np.concatenate([begin, steps]) / (1e9 * period)).astype(np.int64))
    return Samples(numbers, order, period, 1)


def common_samples(a: Samples, b: Samples) -> tuple[Places, Places]:
    """Return where the samples that both have stand in `a` and `b`, in the order of their keys."""
    keys_a, keys_b = a.keys, b.keys
    if any((keys[1:] == keys[:-1]).any() for keys in (keys_a, keys_b)):
        keys_a, keys_b = _numbered(keys_a), _numbered(keys_b)
    _, places_a, places_b = np.intersect1d(keys_a, keys_b, assume_unique=True, return_indices=True)
    return places_a, places_b


def is_stamped(series: Series) -> bool:
    """Return whether there are messages that carry stamps."""
    try:
        return len(series.stamps) > 0
    except SeriesError:
        return False


def _alignment(a: Recording, b: Recording, first: Series, second: Series) -> Alignment:
    stamps = distinct(first.stamps), distinct(second.stamps)
    low, high = max(each[0] for each in stamps), min(each[-1] for each in stamps)
    inside = [each[(each >= low) & (each <= high)] for each in stamps]
    fewer = min(map(len, inside))
    rates = (
        recorded_sample_rate(recording, f'/{mount_of(series.topic, series.registered)}')
        for recording, series in ((a, first), (b, second))
    )
    return Alignment(
        same_stamps=bool(fewer and np.count_nonzero(is_in(*inside)) >= _SAME_CLOCK * fewer),
        anchor=first.topic.lstrip('/'),
        firsts=(int(stamps[0][0]), int(stamps[1][0])),
        sample_rates=(next(rates), next(rates)),
        axis=a.time_axis,
    )


def _of_a_mount(registered: Topic | None) -> bool:
    return registered is not None and not registered.name.startswith('/')


def _numbered(keys: Times) -> NDArray[np.void]:
    """Return keys (rising) that are unique: the second sample of a key is another than the first."""
    numbered = np.empty(len(keys), [('key', np.int64), ('repeat', np.int64)])
    numbered['key'], numbered['repeat'] = keys, np.arange(len(keys)) - np.searchsorted(keys, keys)
    return numbered
