"""Which samples the control had to answer, which have no setpoint, and when none came in time."""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from mount_bags.audit.latency import setpoint_latency
from mount_bags.messages.series import Times
from mount_models.sampling import SETPOINT_TIMEOUT

_PAUSE = 500_000_000  # ns, chosen: a control that says nothing for so long may have been deactivated
_HALF_SAMPLE = 500_000  # ns
_LATE = round(1e9 * SETPOINT_TIMEOUT)  # ns
NO_TIMES: Times = np.empty(0, np.int64)


class Setpoints(NamedTuple):
    """Setpoints of one mount: the stamps of the samples that they answer, and when they were sent, in ns."""

    stamps: Times
    sent: Times


class Control(NamedTuple):
    """What else tells when control was active; all in ns on the clock of the stamps.

    `steps` are the stamps of its traces, `handovers` those at which an initialisation ended, `inactive` the
    times at which its diagnostics said so, None where they were not recorded.
    """

    steps: Times = NO_TIMES
    handovers: Times = NO_TIMES
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
    stamps = np.unique(samples)
    answers, places = np.unique(setpoints.stamps, return_index=True)
    if not stamps.size or not answers.size:
        return Answers()
    ages = None if setpoint_latency(*setpoints) is None else setpoints.sent[places] - answers
    is_late = np.zeros(len(answers), bool) if ages is None else ages > _LATE
    spans = _spans(answers, int(stamps[-1]), control)
    asked = unanswered = late = 0
    silences: list[Silence] = []
    for begin, end in spans:
        inside = _within(stamps, begin, end)
        asked += len(inside)
        unanswered += int(np.count_nonzero(~np.isin(inside, answers)))
        late += len(_within(answers[is_late], begin, end))
        silences += _silences(_within(answers[~is_late], begin, end), begin, end)
    return Answers(asked, unanswered, None if ages is None else late, tuple(silences), tuple(spans))


def _spans(answers: Times, last_sample: int, control: Control) -> list[tuple[int, int]]:
    """Return from which to which stamp control was active."""
    breaks = (np.diff(answers) > _PAUSE) | np.isin(answers[:-1], control.handovers)
    ends = np.flatnonzero(np.append(breaks, True))
    begins = np.concatenate([[0], ends[:-1] + 1])
    found: list[tuple[int, int]] = []
    handed_over = True  # at the beginning, and behind a ramp, silence says nothing
    for begin, end in zip(answers[begins].tolist(), answers[ends].tolist(), strict=True):
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


def _is_control(begin: int, end: int, control: Control) -> bool:
    if control.steps.size:
        return bool(_within(control.steps, begin, end).size)
    return end not in control.handovers


def _stayed_active(begin: int, end: int, control: Control) -> bool:
    """Whether the diagnostics of control were there to say that it was deactivated, and did not."""
    return control.inactive is not None and not _within(control.inactive, begin, end + _PAUSE).size


def _silences(in_time: Times, begin: int, end: int) -> list[Silence]:
    ticks = np.unique(np.concatenate([[begin], in_time, [end]]))
    long = np.flatnonzero(np.diff(ticks) > _LATE + _HALF_SAMPLE)
    return [Silence(int(ticks[place]), int(ticks[place + 1])) for place in long]


def _within(stamps: Times, begin: int, end: int) -> Times:
    return stamps[(stamps >= begin) & (stamps <= end)]
