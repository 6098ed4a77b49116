"""The electronics of all mounts at work, each on a bus of its own, in one thread."""

import threading
import time
from collections.abc import Callable, Iterator, Mapping

from mount_sim.loop import ElectronicsLoop, NoAnswerError

_LOCKSTEP_WAIT = 0.1  # s: how often a loop in lock-step looks whether it shall end
_DISCHARGE_LIMIT = 0.1  # s, chosen: the setpoint timeout, then several times what a sound coil needs
_FORGOTTEN = 0.01  # chosen: of the longest time that the work took, from one sample to the next
_RESERVE = 1.5  # chosen: times the work's longest time are kept for it


def until_ending(ending: threading.Event, discharged: Callable[[], bool]) -> Iterator[None]:
    """Yield for each sample until `ending` is set and the coils are `discharged`, or 0.1 s after `ending`.

    Electronics outlive the graph: its last setpoint is followed, and the truth shows that the current goes.
    """
    while not ending.is_set():
        yield
    limit = time.monotonic() + _DISCHARGE_LIMIT
    while not discharged() and time.monotonic() < limit:
        yield


class OwnWork:
    """How long the simulator's own work on a sample takes, which waits until the graph has answered.

    Electronics have a processor of their own; with two of them the simulator would take one from the graph.
    """

    def __init__(self, longest: float):
        """`longest` in s: what is to be expected at first."""
        self._longest = longest
        self._begin = 0.0

    def latest_begin(self, end: float) -> float:
        """Return when it must begin so that it is done at `end` (s)."""
        return end - _RESERVE * self._longest

    def __enter__(self) -> None:
        self._begin = time.monotonic()

    def __exit__(self, *_: object) -> None:
        taken = time.monotonic() - self._begin
        self._longest = max(taken, (1.0 - _FORGOTTEN) * self._longest)


class CarLoop:
    """Takes each sample of all mounts, one after the other, before it takes the next of the first."""

    def __init__(self, loops: Mapping[str, ElectronicsLoop], clock_drift: float, sample_rate: float):
        self._sample_rate = sample_rate
        self._loops = list(loops.items())
        self._clock_drift = clock_drift
        self._turn = 0  # lock-step: whose sample comes next

    def run_in_real_time(self, ending: threading.Event) -> None:
        """Sample by the electronics' clock until `ending` is set and the coils are discharged.

        So it goes on after the end of the run: electronics do not fall silent when a drive is over; if they
        did, the control would rightly report it.
        """
        period = 1.0 / self._sample_rate / (1.0 + self._clock_drift)
        own = OwnWork(period)
        begin = time.monotonic()
        for number, _ in enumerate(until_ending(ending, self._discharged), 1):
            for _, loop in self._loops:
                loop.send_sample()
            for _, loop in self._loops:
                loop.wait_for_answer(own.latest_begin(begin + number * period))
            with own:
                for _, loop in self._loops:
                    loop.go_on()
            now = time.monotonic()
            remaining = begin + number * period - now
            for _, loop in self._loops:
                loop.figures.wall_time = now - begin
                loop.figures.overruns += remaining <= 0.0  # the next samples follow at once: none is skipped
            if remaining > 0.0:
                time.sleep(remaining)

    def _discharged(self) -> bool:
        return all(loop.discharged() for _, loop in self._loops)

    def run_in_lockstep(self, ending: threading.Event, patience: float) -> None:
        """Sample as fast as all answers come; raise `NoAnswerError` after `patience` s without one."""
        while not self.finished and not ending.is_set():
            self.step_in_lockstep(patience, _LOCKSTEP_WAIT)

    def step_in_lockstep(self, patience: float, wait: float = 0.0) -> bool:
        """Take the next sample of the mount whose turn it is; as `ElectronicsLoop.step_in_lockstep`.

        A mount alone has no name; of several the name of the mount leads an error.
        """
        name, loop = self._loops[self._turn]
        try:
            taken = loop.step_in_lockstep(patience, wait)
        except NoAnswerError as error:
            raise NoAnswerError(f'{name}: {error}' if name else str(error)) from None
        if taken or loop.finished:
            self._turn = (self._turn + 1) % len(self._loops)
        return taken or (loop.finished and not self.finished)

    @property
    def finished(self) -> bool:
        """Whether the run is over, in lock-step with all last samples answered."""
        return all(loop.finished for _, loop in self._loops)
