"""Which samples the control had to answer, which have no setpoint, and how long the answers took."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from engine_mount.recordings.times import Times, distinct, is_in
from mount_models.sampling import SETPOINT_TIMEOUT

_PAUSE = 500_000_000  # ns, chosen: a control that says nothing for so long may have been deactivated
_HALF_SAMPLE = 500_000  # ns
_LATE = round(1e9 * SETPOINT_TIMEOUT)  # ns


class Setpoints(NamedTuple):
    """Setpoints of one mount: the stamps of the samples that they answer, and when they were sent, in ns."""

    stamps: Times
    sent: Times


class Control(NamedTuple):
    """What else tells when control was active; all in ns on the clock of the stamps.

    `steps` are the stamps of its traces, `handovers` those at which an initialisation ended, `inactive` the
    times at which its diagnostics said so, None where they were not recorded.
    """

    steps: Times
    handovers: Times
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


def judge_answers(samples: Times, setpoints: Setpoints, control: Control) -> Answers:
    """Return how `setpoints` answer `samples` (stamps in ns).

    Control is active from its first answer to its last. The ramp of an initialisation is not control, nor is
    the time from its end to control's first answer. Silence for more than 0.5 s means that control was
    deactivated unless its diagnostics were recorded and do not say so.
    """
    if not len(samples) or not len(setpoints.stamps):
        return Answers()
    samples, answers = distinct(samples), distinct(setpoints.stamps)
    spans = _spans(answers, int(samples[-1]), control)
    asked = samples[spanned(samples, spans) >= 0]
    late = _late(setpoints) if on_one_clock(*setpoints) else None
    in_time = answers if late is None else answers[~is_in(answers, late)]
    return Answers(
        len(asked),
        int(np.count_nonzero(~is_in(asked, answers))),
        None if late is None else int(np.count_nonzero(spanned(late, spans) >= 0)),
        tuple(silence for span in spans for silence in _silences(in_time, *span)),
        tuple(spans),
    )


def spanned(stamps: Times, spans: Sequence[tuple[int, int]]) -> NDArray[np.intp]:
    """Return in which of `spans`, which rise and do not overlap, each of the stamps is; -1: in none."""
    if not spans:
        return np.full(len(stamps), -1)
    begins, ends = np.array(spans, np.int64).T
    places = np.searchsorted(begins, stamps, side='right') - 1
    return np.where(stamps <= ends[places], places, -1)


def _silences(in_time: Times, begin: int, end: int) -> list[Silence]:
    """Return the silences of one span; the answers rise."""
    inside = in_time[(in_time >= begin) & (in_time <= end)]
    ticks = np.concatenate([[begin], inside, [end]])
    long = np.flatnonzero(np.diff(ticks) > _LATE + _HALF_SAMPLE)
    return [Silence(int(ticks[place]), int(ticks[place + 1])) for place in long]


def _late(setpoints: Setpoints) -> Times:
    """Return which samples (stamps, rising) were answered too late by the first of their setpoints."""
    stamps, first = np.unique(setpoints.stamps, return_index=True)
    return stamps[setpoints.sent[first] - stamps > _LATE]


def _spans(answers: Times, last_sample: int, control: Control) -> list[tuple[int, int]]:
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


def _stretches(answers: Times, control: Control) -> list[tuple[int, int]]:
    """Return from which to which answer there is neither a pause nor the end of an initialisation."""
    breaks = (np.diff(answers) > _PAUSE) | is_in(answers[:-1], np.sort(control.handovers))
    parts = np.split(answers, np.flatnonzero(breaks) + 1)
    return [(int(part[0]), int(part[-1])) for part in parts]


def _is_control(begin: int, end: int, control: Control) -> bool:
    if len(control.steps):
        return _has_any(control.steps, begin, end)
    return end not in control.handovers


def _stayed_active(begin: int, end: int, control: Control) -> bool:
    """Whether the diagnostics of control were there to say that it was deactivated, and did not."""
    return control.inactive is not None and not _has_any(control.inactive, begin, end + _PAUSE)


def _has_any(times: Times, begin: int, end: int) -> bool:
    return bool(((times >= begin) & (times <= end)).any())


EDGES = (0.0, 0.25e-3, 0.5e-3, 0.75e-3, 1e-3, 1.5e-3, 2e-3, 3e-3, 5e-3, 10e-3, 20e-3)  # s, chosen
_SAME_PACE = 0.02  # chosen: two clocks that differ by more are not the same
_SAME_CLOCK = 60 * 1_000_000_000  # ns, chosen: a setpoint that comes later is no answer
_ANY_CLOCK = 1 << 62  # ns, 146 years: differences beyond it do not fit into 64 bits


@dataclass(frozen=True)
class Latency:
    """Latencies in s; `counts` has one number below `EDGES`, one for each step of it, and one above."""

    counts: tuple[int, ...]
    median: float
    p99: float
    worst: float


def setpoint_latency(stamps: Times, receive_times: Times) -> Latency | None:
    """Return the latencies of setpoints, None where their stamps are not of the clock of reception.

    In lock-step the stamps count the time of the simulation. All times are in ns.
    """
    if not on_one_clock(stamps, receive_times):
        return None
    ages = (receive_times - stamps) * 1e-9
    counts = np.bincount(np.searchsorted(EDGES, ages, side='right'), minlength=len(EDGES) + 1)
    return Latency(
        tuple(counts.tolist()), float(np.median(ages)), float(np.quantile(ages, 0.99)), float(ages.max())
    )


def on_one_clock(stamps: Times, times: Times) -> bool:
    """Return whether the stamps of setpoints are on the clock of `times`, when they were sent or came."""
    if len(stamps) < 2:
        return False
    ages = times - stamps
    if int(ages.max()) - int(ages.min()) > _ANY_CLOCK or abs(float(np.median(ages))) > _SAME_CLOCK:
        return False
    stamped, timed = int(np.ptp(stamps)), int(np.ptp(times))
    return not (stamped > 1_000_000_000 and abs(timed / stamped - 1.0) > _SAME_PACE)
