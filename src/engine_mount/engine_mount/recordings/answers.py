"""Which samples the control had to answer, which have no setpoint, how long answers took, the highest one."""

import contextlib
import math
from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from engine_mount.recordings.metadata import registered_topic
from engine_mount.recordings.recording import Recording
from engine_mount.recordings.series import SeriesError
from engine_mount.recordings.times import Times, distinct, is_in
from mount_models.sampling import SETPOINT_TIMEOUT
from mount_ros.topics import CURRENT_SETPOINT

Span = tuple[int, int]
"""First and last stamp, ns."""

_PAUSE = 500_000_000  # ns, chosen: a control that says nothing for so long may have been deactivated
_HALF_SAMPLE = 500_000  # ns
_LATE = round(1e9 * SETPOINT_TIMEOUT)  # ns
_SAME_PACE = 0.02  # chosen: two clocks that differ by more are not the same
_SAME_CLOCK = 60 * 1_000_000_000  # ns, chosen: a setpoint that comes later is no answer
_ANY_CLOCK = 1 << 62  # ns, 146 years: differences beyond it do not fit into 64 bits
_CURRENT = CURRENT_SETPOINT.names[0]


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

    def stayed_active(self, begin: int, end: int) -> bool:
        """Return whether diagnostics were there to say that control was deactivated, and did not."""
        return self.inactive is not None and not _has_any(self.inactive, begin, end + _PAUSE)


class Answers(NamedTuple):
    """How control answered: counts of samples, and the spans in which it was active.

    `asked` were taken while it was active; of these `unanswered` have no setpoint and `late` have one that
    was sent more than 20 ms after it, which the driver refuses (None: its clock is not that of the stamps).
    Between the setpoints of a span of `silences` none came in time: 0 A.
    """

    asked: int = 0
    unanswered: int = 0
    late: int | None = None
    silences: tuple[Span, ...] = ()
    spans: tuple[Span, ...] = ()


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
    late, in_time = None, answers
    if on_one_clock(*setpoints):
        stamps, first = np.unique(setpoints.stamps, return_index=True)
        too_late = stamps[setpoints.sent[first] - stamps > _LATE]
        late = int(np.count_nonzero(spanned(too_late, spans) >= 0))
        in_time = answers[~is_in(answers, too_late)]
    silences = list[Span]()
    for begin, end in spans:
        ticks = np.concatenate([[begin], in_time[(in_time >= begin) & (in_time <= end)], [end]])
        long = np.flatnonzero(np.diff(ticks) > _LATE + _HALF_SAMPLE)
        silences += zip(ticks[long].tolist(), ticks[long + 1].tolist(), strict=True)
    unanswered = int(np.count_nonzero(~is_in(asked, answers)))
    return Answers(len(asked), unanswered, late, tuple(silences), tuple(spans))


def spanned(stamps: Times, spans: Sequence[Span]) -> NDArray[np.intp]:
    """Return in which of `spans`, which rise and do not overlap, each of the stamps is; -1: in none."""
    if not spans:
        return np.full(len(stamps), -1)
    begins, ends = np.array(spans, np.int64).T
    places = np.searchsorted(begins, stamps, side='right') - 1
    return np.where(stamps <= ends[places], places, -1)


def _spans(answers: Times, last_sample: int, control: Control) -> list[Span]:
    """Return from which to which stamp control was active; the answers rise."""
    breaks = (np.diff(answers) > _PAUSE) | is_in(answers[:-1], np.sort(control.handovers))
    found: list[Span] = []
    handed_over = True  # at the beginning, and behind a ramp, silence says nothing
    for part in np.split(answers, np.flatnonzero(breaks) + 1):
        begin, end = int(part[0]), int(part[-1])
        is_ramp = end in control.handovers
        if len(control.steps):
            is_ramp = not _has_any(control.steps, begin, end)
        if is_ramp:
            handed_over = True
            continue
        if found and not handed_over and control.stayed_active(found[-1][1], begin):
            begin = found.pop()[0]
        found.append((begin, end))
        handed_over = False
    if found and not handed_over:
        begin, end = found[-1]
        if last_sample - end > _PAUSE and control.stayed_active(end, last_sample):
            found[-1] = (begin, last_sample)
    return found


def _has_any(times: Times, begin: int, end: int) -> bool:
    return bool(((times >= begin) & (times <= end)).any())


class Latency(NamedTuple):
    """Latencies in s."""

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
    return Latency(float(np.median(ages)), float(np.quantile(ages, 0.99)), float(ages.max()))


def on_one_clock(stamps: Times, times: Times) -> bool:
    """Return whether the stamps of setpoints are on the clock of `times`, when they were sent or came."""
    if len(stamps) < 2:
        return False
    ages = times - stamps
    if int(ages.max()) - int(ages.min()) > _ANY_CLOCK or abs(float(np.median(ages))) > _SAME_CLOCK:
        return False
    stamped, timed = int(np.ptp(stamps)), int(np.ptp(times))
    return not (stamped > 1_000_000_000 and abs(timed / stamped - 1.0) > _SAME_PACE)


def peak_current(recording: Recording, spans: Mapping[str, Sequence[Span]]) -> float:
    """Return the highest setpoint (A) while control was active, NaN where none is known.

    The ramp of an initialisation does not count. `spans` are those of control by the topic of its setpoints.
    """
    names = [
        name
        for name in spans
        if name in recording.topics
        and registered_topic(name, recording.topics[name].type) is CURRENT_SETPOINT
    ]
    recording.load_columns(dict.fromkeys(names, (_CURRENT,)))
    highest = math.nan
    for name in names:
        series = recording[name]
        with contextlib.suppress(SeriesError):  # foreign setpoints without a current
            inside = series[_CURRENT][spanned(series.stamps, spans[name]) >= 0]
            if np.isfinite(inside).any():
                highest = float(np.fmax(highest, inside[np.isfinite(inside)].max()))
    return highest
