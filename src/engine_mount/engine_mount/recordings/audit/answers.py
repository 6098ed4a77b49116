"""Which samples the control had to answer, which have no setpoint, and when none came in time."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from engine_mount.recordings.audit.latency import on_one_clock
from engine_mount.recordings.messages.compact_times import (
    CompactTimes,
    Times,
    compact,
    is_in,
    together,
    within,
)
from mount_models.sampling import SETPOINT_TIMEOUT

_PAUSE = 500_000_000  # ns, chosen: a control that says nothing for so long may have been deactivated
_HALF_SAMPLE = 500_000  # ns
_LATE = round(1e9 * SETPOINT_TIMEOUT)  # ns
NO_TIMES: Times = np.empty(0, np.int64)


class Setpoints(NamedTuple):
    """Setpoints of one mount: the stamps of the samples that they answer, and when they were sent, in ns."""

    stamps: CompactTimes
    sent: CompactTimes


class Control(NamedTuple):
    """What else tells when control was active; all in ns on the clock of the stamps.

    `steps` are the stamps of its traces, `handovers` those at which an initialisation ended, `inactive` the
    times at which its diagnostics said so, None where they were not recorded.
    """

    steps: CompactTimes
    handovers: CompactTimes
    inactive: Times | None = None


@dataclass(frozen=True)
class Silence:
    """Between two setpoints (stamps in ns) none came in time while control was active: 0 A."""

    begin: int
    end: int

    @property
    def duration(self) -> float:
        """Length in s."""
        return (self.end - self.begin) / 1e9


@dataclass(frozen=True)
class Answers:
    """How control answered: counts of samples, and the stretches (stamps in ns) in which it was active.

    `asked` were taken while it was active; of these `unanswered` have no setpoint and `late` have one that
    was sent more than 20 ms after it, which the driver refuses (None: its clock is not that of the stamps).
    """

    asked: int = 0
    unanswered: int = 0
    late: int | None = None
    silences: tuple[Silence, ...] = ()
    spans: tuple[tuple[int, int], ...] = ()


def judge_answers(samples: CompactTimes, setpoints: Setpoints, control: Control) -> Answers:
    """Return how `setpoints` answer `samples` (stamps in ns).

    Control is active from its first answer to its last. The ramp of an initialisation is not control, nor is
    the time from its end to control's first answer. Silence for more than 0.5 s means that control was
    deactivated unless its diagnostics were recorded and do not say so.
    """
    if not len(samples) or not len(setpoints.stamps):
        return Answers()
    late = _late(setpoints) if on_one_clock(*setpoints) else None
    stamps, answers = samples.ordered(), setpoints.stamps.ordered()
    spans = _spans(answers, stamps.highest, control)
    late_stamps = NO_TIMES if late is None else late
    asked = unanswered = 0
    silences = [_Silences(begin) for begin, _ in spans]
    for taken, answered in together([stamps, answers]):
        inside = taken[spanned(taken, spans) >= 0]
        asked += len(inside)
        unanswered += int(np.count_nonzero(~is_in(inside, answered)))
        in_time = answered[~is_in(answered, late_stamps)]
        owners = spanned(in_time, spans)
        for place in np.unique(owners[owners >= 0]).tolist():
            silences[place].add(in_time[owners == place])
    for each, (_, end) in zip(silences, spans, strict=True):
        each.add(np.array([end]))
    return Answers(
        asked,
        unanswered,
        None if late is None else int(np.count_nonzero(spanned(late, spans) >= 0)),
        tuple(silence for each in silences for silence in each.found),
        tuple(spans),
    )


def spanned(stamps: Times, spans: Sequence[tuple[int, int]]) -> NDArray[np.intp]:
    """Return in which of `spans`, which rise and do not overlap, each of the stamps is; -1: in none."""
    if not spans:
        return np.full(len(stamps), -1)
    begins, ends = np.array(spans, np.int64).T
    places = np.searchsorted(begins, stamps, side='right') - 1
    return np.where(stamps <= ends[places], places, -1)


class _Silences:
    """The silences of one span, from `begin` on; the answers come in the order of time."""

    def __init__(self, begin: int):
        self.found: list[Silence] = []
        self._last = begin

    def add(self, in_time: Times) -> None:
        ticks = np.append(self._last, in_time)
        long = np.flatnonzero(np.diff(ticks) > _LATE + _HALF_SAMPLE)
        self.found += [Silence(int(ticks[place]), int(ticks[place + 1])) for place in long]
        self._last = int(ticks[-1])


def _late(setpoints: Setpoints) -> Times:
    """Return which samples (stamps, rising) were answered too late by the first of their setpoints."""
    stamps, sent = setpoints
    if not stamps.rising:
        all_stamps = stamps.whole()
        order = np.argsort(all_stamps, kind='stable')
        stamps, sent = compact(all_stamps[order]), compact(sent.whole()[order])
    late, last = NO_TIMES, stamps.least - 1
    for answered, told in zip(stamps.blocks(), sent.blocks(), strict=True):
        first = np.diff(answered, prepend=last) > 0
        late = np.append(late, answered[first & (told - answered > _LATE)])
        last = int(answered[-1])
    return late


def _spans(answers: CompactTimes, last_sample: int, control: Control) -> list[tuple[int, int]]:
    """Return from which to which stamp control was active; the answers rise."""
    found: list[tuple[int, int]] = []
    handed_over = True  # at the beginning, and behind a ramp, silence says nothing
    for begin, end in _stretches(answers, control):
        if not _is_control(begin, end, control):
            handed_over = True
            continue
        if found and not handed_over and _stayed_active(found[-1][1], begin, control):
            begin = found.pop()[0]
        found.append((begin, end))
        handed_over = False
    if found and not handed_over and last_sample - found[-1][1] > _PAUSE:
        begin, end = found[-1]
        if _stayed_active(end, last_sample, control):
            found[-1] = (begin, last_sample)
    return found


def _stretches(answers: CompactTimes, control: Control) -> Iterator[tuple[int, int]]:
    """Yield from which to which answer there is neither a pause nor the end of an initialisation."""
    handovers = np.sort(control.handovers.whole())
    begin = last = answers.least
    for block in answers.blocks():
        before = np.append(last, block[:-1])
        breaks = (block - before > _PAUSE) | (is_in(before, handovers) & (block > before))
        for place in np.flatnonzero(breaks).tolist():
            yield begin, int(before[place])
            begin = int(block[place])
        last = int(block[-1])
    yield begin, last


def _is_control(begin: int, end: int, control: Control) -> bool:
    if len(control.steps):
        return control.steps.has_any(begin, end)
    return end not in control.handovers.whole()


def _stayed_active(begin: int, end: int, control: Control) -> bool:
    """Whether the diagnostics of control were there to say that it was deactivated, and did not."""
    return control.inactive is not None and not within(control.inactive, begin, end + _PAUSE).size
