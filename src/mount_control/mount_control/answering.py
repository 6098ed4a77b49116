"""The way of a displacement sample to its answer: judged, taken over by new laws, stepped; no ROS, no clock.

Node, lock-step, core runs and replay answer here and nowhere else.
"""

from collections import deque
from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from mount_control.controller import ControlLaw, Controller
from mount_control.force_to_current import CurrentTable
from mount_control.sample_watch import INTERRUPTED, Judgement, SampleWatch
from mount_control.settings import ControlSettings

OFF = 0.0
"""The current (A) of the safe state."""


class Answer(NamedTuple):
    """What is made of one sample: current (A) and trace (bytes of its record), None where there is none.

    `told` belongs to the changes that hold from this sample on.
    """

    current: float | None
    trace: bytes | None
    reason: Judgement
    told: tuple[str, ...] = ()


class Answers(NamedTuple):
    """The answers to n samples: currents (A, NaN where there is none), records `traces` where `traced`."""

    currents: NDArray[np.float64]
    traced: NDArray[np.bool_]
    traces: NDArray[np.void]


_WITHOUT_STEP = {
    reason: Answer(current, None, reason)
    for reason, current in {
        Judgement.INVALID: OFF,
        Judgement.IMPLAUSIBLE: OFF,
        Judgement.INTERRUPTED: OFF,
        Judgement.FOREIGN: OFF,
        Judgement.IGNORE: None,
        Judgement.EARLY: None,
        Judgement.INACTIVE: None,
    }.items()
}


class Answering:
    """Answers the displacement samples of one mount, between `begin` and `end`."""

    def __init__(self) -> None:
        self.watch = SampleWatch()
        self.controller: Controller | None = None  # None: every answer is INACTIVE
        self.last_fault = 0  # stamp (ns) of the last sample at which the controller's memory was spoiled
        self._faults = 0
        self._table: CurrentTable | None = None
        self._changes: deque[tuple[ControlLaw, str]] = deque()

    @property
    def trace_type(self) -> np.dtype:
        """The record type of the traces since `begin`."""
        assert self.controller is not None
        return self.controller.compiled.trace

    @property
    def refusal(self) -> str:
        """Why the table no longer holds since the activation, or empty."""
        return INTERRUPTED if self.watch.interrupted else ''

    @property
    def damping_active(self) -> bool:
        """Whether damping was on in the last step."""
        return bool(self.controller.trace['damping_active']) if self.controller is not None else False

    @property
    def current(self) -> float:
        """The current (A) of the last step."""
        return float(self.controller.trace['current']) if self.controller is not None else OFF

    @property
    def faults(self) -> int:
        """How often the controller's memory was found spoiled since the activation."""
        return self.controller.faults if self.controller is not None else 0

    def begin(self, settings: ControlSettings, table: CurrentTable, activation: int) -> None:
        """Answer what comes after `activation` (ns), the stamp of the table."""
        controller = Controller(ControlLaw(settings, table))
        self.watch.begin(activation, settings.parameters)
        self._table, self._faults, self.last_fault = table, 0, 0
        self._changes.clear()
        self.controller = controller

    def end(self) -> None:
        """Answer nothing from now on; the watch goes on."""
        self.controller = None

    def on_publisher_conflict(self, confirmed: str, suspected: str) -> None:
        """Answer with 0 A: until the next activation for a `confirmed` one, and while one is `suspected`."""
        self.watch.on_publisher_conflict(confirmed, suspected)

    def change(self, settings: ControlSettings, told: str = '') -> None:
        """Go on with other settings from the next usable sample on; may come from another thread."""
        assert self._table is not None
        self._changes.append((ControlLaw(settings, self._table), told))

    def answer(self, stamp: int, displacement: float) -> Answer:
        """Return the answer to one sample: its time in ns, its displacement in m."""
        self.watch.note(stamp)
        controller = self.controller
        if controller is None:
            return _WITHOUT_STEP[Judgement.INACTIVE]
        judgement, missing = self.watch.judge(stamp, displacement)
        if judgement in _WITHOUT_STEP:
            return _WITHOUT_STEP[judgement]
        told = self._take_changes(controller) if self._changes else ()
        if judgement is Judgement.RESTART:
            controller.restart(displacement)
        current = controller.step(displacement, missing)
        if controller.faults != self._faults:
            self._faults, self.last_fault = controller.faults, stamp
        return Answer(current, controller.trace_bytes, judgement, told)

    def answer_many(
        self,
        stamps: NDArray[np.int64],
        displacements: NDArray[np.float64],
        changes: Mapping[int, Sequence[ControlSettings]] | None = None,
    ) -> Answers:
        """Return the answers to n samples, ns and m, to the bit those of n calls of `answer`.

        Samples that follow each other without a doubt pass the compiled controller at once. `changes` are
        made known before the samples at their places. Only between `begin` and `end`.
        """
        count, changes = len(stamps), changes or {}
        answers = Answers(np.full(count, np.nan), np.zeros(count, bool), np.zeros(count, self.trace_type))
        follows = self.watch.following(stamps, displacements)
        begins = sorted({*np.flatnonzero(~follows).tolist(), *changes})
        for begin, end in zip(begins, [*begins[1:], count], strict=True):
            for settings in changes.get(begin, ()):
                self.change(settings)
            place = begin
            while place < end:
                place = self._answer_doubtful(stamps, displacements, answers, place, end)
                place += self._answer_believed(stamps, displacements, answers, place, end)
        answers.currents[answers.traced] = answers.traces['current'][answers.traced]
        return answers

    def expects(self, stamp: int) -> bool:
        """Whether a believable sample of time `stamp` (ns) needs nothing but a step of the controller."""
        return self.controller is not None and not self._changes and self.watch.expects(stamp)

    def _answer_doubtful(self, stamps, displacements, answers: Answers, begin: int, end: int) -> int:
        """Answer samples one by one until one was stepped; return the place of the next."""
        for place in range(begin, end):
            answer = self.answer(int(stamps[place]), float(displacements[place]))
            if answer.current is not None:
                answers.currents[place] = answer.current
            if answer.trace is not None:
                answers.traced[place] = True
                answers.traces[place] = np.frombuffer(answer.trace, self.trace_type)[0]
                return place + 1
        return end

    def _answer_believed(self, stamps, displacements, answers: Answers, begin: int, end: int) -> int:
        """Answer samples that follow each other up to the first in doubt; return how many."""
        if begin >= end or self.controller is None:
            return 0
        count = self.watch.believed(stamps[begin:end], displacements[begin:end])
        part = slice(begin, begin + count)
        if count:
            self.controller.run(displacements[part], answers.traces[part])
            answers.traced[part] = True
        return count

    def _take_changes(self, controller: Controller) -> tuple[str, ...]:
        """Go on with the newest law from this sample on; return what is told of it."""
        told = []
        while self._changes:
            law, text = self._changes.popleft()
            controller.change(law)
            told.append(text)
        return tuple(told)
