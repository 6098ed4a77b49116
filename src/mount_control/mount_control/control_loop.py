"""The way of one displacement sample to its current; no ROS, no clock.

Node, lock-step, core runs and replay answer here and nowhere else.
"""

from collections import deque
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from enum import Enum
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from mount_control.controller import ControlLaw, Controller
from mount_control.engine_speed import EngineSpeed
from mount_control.force_maker import CurrentTable
from mount_control.plausibility import Plausibility, doubt_of
from mount_control.settings import ControlParameters, ControlSettings
from mount_models.sampling import sample_time_ns

OFF = 0.0
"""The current (A) of the safe state."""
_NEVER = -(2**62)  # ns, instead of the stamp of a sample that has not come
_KEPT_STEPS = 200  # chosen: steps between samples of which their rate is taken
_CLOSEST = 0.75  # of a period, chosen: mount_driver's stamps lie 0.9 of a period apart or more
_INTRUSIONS = 3  # chosen: samples between those of the stream
_INTRUSION_PERIOD = 1_000_000_000  # ns, chosen: in it they are those of another sender
_STREAM_BREAK = 1_000_000_000  # ns, chosen: a longer silence may have been a loss of power
_INTERRUPTED = (
    'the measurements were interrupted for more than 1 s since the table was made, or their time '
    'went back; deactivate mount_control and activate mount_init again'
)


class Judgement(Enum):
    """What becomes of a sample."""

    USE = 'use'
    RESTART = 'restart'  # usable, but the past is too far away to be continued
    INVALID = 'invalid'  # NaN or beyond the sensor's range: answered with 0 A
    IMPLAUSIBLE = 'implausible'  # it moves as no mount does, see `plausibility`: answered with 0 A
    INTERRUPTED = 'interrupted'  # the table may be of another state of the mount: answered with 0 A
    FOREIGN = 'foreign'  # another sender is or may be there: answered with 0 A
    IGNORE = 'ignore'  # repeated or out of order: already answered
    EARLY = 'early'  # not after the activation: mount_init answers
    INACTIVE = 'inactive'  # before `begin` or after `end`


_UNANSWERED = {Judgement.IGNORE, Judgement.EARLY, Judgement.INACTIVE}


@dataclass
class SampleCounts:
    """What came in since activation."""

    samples: int = 0
    bridged: int = 0
    restarts: int = 0
    ignored: int = 0
    invalid: int = 0
    implausible: int = 0


class Answers(NamedTuple):
    """The answers to n samples: currents (A, NaN where there is none), records `traces` where `traced`."""

    currents: NDArray[np.float64]
    traced: NDArray[np.bool_]
    traces: NDArray[np.void]


class ControlLoop:
    """Answers the displacement samples of one mount, between `begin` and `end`."""

    def __init__(self) -> None:
        self.first: int | None = None
        self.last: int | None = None
        """The stamps (ns) between which the displacement came without a break; None before the first one."""
        self.measured_before = False
        """Whether the measurements are known to have come without a break before the first sample, too."""
        self.steps: deque[int] = deque(maxlen=_KEPT_STEPS)  # ns, between the samples before `begin`
        self.controller: Controller | None = None  # None: nothing is answered
        self.engine_speed = EngineSpeed()
        self.judgement = Judgement.INACTIVE  # of the last sample
        self.trace: NDArray[np.uint8] | None = None
        """The bytes of the last sample's trace, None where there is none; overwritten by the next sample."""
        self.counts = SampleCounts()
        self.changes_made: deque[str] = deque()  # texts of the changes that hold from the last sample on
        self.foreign = ''  # which other sender there is, since the activation
        self.writer_doubt = ''  # which other sender there may be at present
        self._changes: deque[tuple[ControlLaw, str]] = deque()
        self._intruded: deque[int] = deque(maxlen=_INTRUSIONS)  # stamps of samples that came too soon, ns
        self._reset(ControlParameters(), 0)

    def _reset(self, parameters: ControlParameters, activation: int) -> None:
        self._activation = activation
        self._period = sample_time_ns(parameters.sample_rate)
        self._closest = round(_CLOSEST * self._period)
        self._longest_bridge = round(parameters.longest_bridge * 1e9)  # ns
        self._range = parameters.displacement_range  # m
        self.plausibility = Plausibility(parameters)
        self.counts = SampleCounts()
        self.engine_speed.timeout = round(parameters.engine_speed_timeout * 1e9)  # ns
        self.refusal = ''  # why the table no longer holds since the activation
        self.foreign = ''
        self._used = self._compared = _NEVER  # stamps of the last samples that controller, plausibility took
        self._horizon = 0
        """So far (ns) behind `_used` a sample is the usual next one; 0 while there is anything to look at."""
        self._intruded.clear()
        self._changes.clear()
        self.steps.clear()

    def begin(self, settings: ControlSettings, table: CurrentTable, activation: int) -> None:
        """Answer what comes after `activation` (ns), the stamp of the table."""
        controller = Controller(ControlLaw(settings, table))
        self._reset(settings.parameters, activation)
        self._table, self.controller = table, controller

    def end(self) -> None:
        """Answer nothing from now on; the stamps are noted all the same."""
        self.controller, self._horizon = None, 0

    def change(self, settings: ControlSettings, text: str = '') -> None:
        """Continue with other settings from the next usable sample on; may come from another thread."""
        self._changes.append((ControlLaw(settings, self._table), text))
        self._horizon = 0

    def on_publisher_conflict(self, confirmed: str, suspected: str) -> None:
        """Answer with 0 A: until the next activation for a `confirmed` one, and while one is `suspected`.

        May come from another thread.
        """
        self.foreign = confirmed or self.foreign
        self.writer_doubt = suspected
        self._horizon = 0

    def step(self, stamp: int, displacement: float, crank_frequency: float | None = None) -> float | None:
        """Return the current (A) that answers a sample (ns, m), None where it is not to be answered.

        `crank_frequency`: turns of the crankshaft in a second (Hz), by default those of `engine_speed`.
        """
        elapsed = stamp - self._used
        usual = self._closest <= elapsed < self._horizon and abs(displacement) <= self._range
        unseen = 0  # samples missing since the last one that was compared
        if not usual:
            self._horizon = self._period + self._period // 2  # before the look at what other threads change
            if judgement := self._refusal(stamp, displacement, elapsed):
                return self._refuse(judgement)
            unseen = missing_samples(stamp - self._compared, self._period)
        self._compared = stamp
        if doubt_of(self.plausibility.limits, self.plausibility.memory, displacement, unseen):
            self.counts.implausible += 1
            return self._refuse(Judgement.IMPLAUSIBLE)

        controller, missing = self.controller, 0
        assert controller is not None
        self._used = self.last = stamp
        self.judgement = Judgement.USE
        self.counts.samples += 1
        if not usual:
            self._make_changes(controller)
            if elapsed > self._longest_bridge:
                self.judgement = Judgement.RESTART
                self.counts.restarts += 1
                controller.restart(displacement)
            else:
                missing = missing_samples(elapsed, self._period)
                self.counts.bridged += missing
        self.trace = controller.trace_record
        if crank_frequency is None:
            crank_frequency = self.engine_speed.at(stamp)
        return controller.advance(displacement, missing, crank_frequency)

    def _refusal(self, stamp: int, displacement: float, elapsed: int) -> Judgement | None:
        """Return why a sample that is not the usual next one is not to be controlled, None where it is."""
        self.note(stamp)
        if self.controller is None:
            return Judgement.INACTIVE
        assert self.first is not None
        assert self.last is not None
        if not self.first <= self._activation <= self.last:
            self.refusal = _INTERRUPTED
        if self.refusal:
            return Judgement.INTERRUPTED
        if stamp <= self._activation:
            return Judgement.EARLY
        if elapsed < self._closest:
            self._note_intrusion(stamp)
        if self.foreign or self.writer_doubt:
            return Judgement.FOREIGN
        if elapsed <= 0:
            self.counts.ignored += 1
            return Judgement.IGNORE
        if not abs(displacement) <= self._range:  # also NaN
            self.counts.invalid += 1
            return Judgement.INVALID
        return None

    def _refuse(self, judgement: Judgement) -> float | None:
        """Return the answer to a sample that the controller does not take; the next one is looked at, too."""
        self.judgement, self.trace, self._horizon = judgement, None, 0
        return None if judgement in _UNANSWERED else OFF

    def note(self, stamp: int) -> None:
        """Note the stamp (ns) of a sample; one that comes a little too late changes nothing."""
        if self.last is None:
            self.first, self.last = 0 if self.measured_before else stamp, stamp
        elif abs(stamp - self.last) > _STREAM_BREAK:
            self.first = self.last = stamp
            self.steps.clear()
        elif stamp > self.last:
            if self.controller is None:
                self.steps.append(stamp - self.last)
            self.last = stamp

    def _note_intrusion(self, stamp: int) -> None:
        found = self._intruded
        found.append(stamp)
        if len(found) == _INTRUSIONS and stamp - found[0] <= _INTRUSION_PERIOD and not self.foreign:
            self.foreign = (
                f'{len(found)} displacement samples within {_INTRUSION_PERIOD * 1e-9:g} s were repeated, '
                f'older than the one before or less than {self._closest * 1e-6:g} ms behind it: end one of '
                'the two nodes that publish displacement'
            )

    def _make_changes(self, controller: Controller) -> None:
        while self._changes:
            law, text = self._changes.popleft()
            controller.change(law)
            self.changes_made.append(text)

    # Many samples at once.

    def step_many(
        self,
        stamps: NDArray[np.int64],
        displacements: NDArray[np.float64],
        changes: Mapping[int, Sequence[ControlSettings]] | None = None,
        crank_frequency: NDArray[np.float64] | float = 0.0,
    ) -> Answers:
        """Return the answers to n samples, ns, m and Hz, to the bit those of n calls of `step`.

        Samples that follow each other without a doubt pass the compiled controller at once. `changes` are
        made known before the samples at their places. Only between `begin` and `end`.
        """
        count, changes = len(stamps), changes or {}
        frequencies = np.broadcast_to(crank_frequency, (count,))
        answers = Answers(np.full(count, np.nan), np.zeros(count, bool), np.zeros(count, self.trace_type))
        begins = sorted({*np.flatnonzero(~self._following(stamps, displacements)).tolist(), *changes})
        for begin, end in zip(begins, [*begins[1:], count], strict=True):
            for settings in changes.get(begin, ()):
                self.change(settings)
            place = begin
            while place < end:
                sample = int(stamps[place]), float(displacements[place]), float(frequencies[place])
                current = self.step(*sample)
                answers.currents[place] = np.nan if current is None else current
                place += 1
                if self.trace is not None:
                    answers.traced[place - 1] = True
                    answers.traces[place - 1] = self.trace.view(self.trace_type)[0]
                    part = slice(place, end)
                    place += self._run(stamps[part], displacements[part], frequencies[part], answers, place)
        answers.currents[answers.traced] = answers.traces['current'][answers.traced]
        return answers

    def expects(self, stamp: int) -> bool:
        """Whether a believable sample of time `stamp` (ns) needs nothing but a step of the controller."""
        return self._horizon > 0 and stamp - self._used == self._period

    def follow(self, last_stamp: int, count: int) -> None:
        """Note `count` samples that followed each other without a doubt, the last at `last_stamp` (ns).

        They have passed `plausibility` and controller. However long they lasted, nothing was interrupted.
        """
        self.last = self._used = self._compared = last_stamp
        self.counts.samples += count

    def _following(self, stamps: NDArray[np.int64], displacement: NDArray[np.float64]) -> NDArray[np.bool_]:
        """Return which of the samples (n,) are believable and one period after the one before."""
        valid = np.abs(displacement) <= self._range  # not so for NaN
        follows = np.zeros(len(stamps), bool)
        steps = np.diff(stamps)
        follows[1:] = valid[1:] & (steps >= self._closest) & (steps < self._period + self._period // 2)
        return follows

    def _run(self, stamps, displacements, frequencies, answers: Answers, place: int) -> int:
        """Answer samples that follow each other up to the first in doubt; return how many."""
        count = self.plausibility.believed(displacements)
        if count and self.controller is not None:
            self.follow(int(stamps[count - 1]), count)
            traces = answers.traces[place : place + count]
            self.controller.run(displacements[:count], traces, frequencies[:count])
            answers.traced[place : place + count] = True
        return count

    # What the diagnostics show.

    @property
    def trace_type(self) -> np.dtype:
        """The record type of the traces since `begin`."""
        assert self.controller is not None
        return self.controller.compiled.trace

    @property
    def damping_active(self) -> bool:
        """Whether damping was on in the last step."""
        return self.controller is not None and bool(self.controller.trace['damping_active'])

    @property
    def current(self) -> float:
        """The current (A) of the last step."""
        return float(self.controller.trace['current']) if self.controller is not None else OFF

    @property
    def faults(self) -> int:
        """How often the controller's memory was found spoiled since the activation."""
        return self.controller.faults if self.controller is not None else 0


def missing_samples(elapsed: int, period: int) -> int:
    """Return how many samples are missing between two that are `elapsed` ns apart, one a `period`."""
    return max(0, (elapsed + period // 2) // period - 1)
