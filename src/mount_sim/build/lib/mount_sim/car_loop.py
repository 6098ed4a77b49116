"""The electronics of several mounts at work, each on a bus of its own, in one thread."""

import threading
import time
from collections.abc import Mapping

from mount_sim.loop import LOCKSTEP_WAIT, ElectronicsLoop, NoAnswerError, OwnWork, until_ending


class CarLoop:
    """Takes each sample of all mounts, one after the other, before it takes the next of the first."""

    def __init__(self, loops: Mapping[str, ElectronicsLoop], clock_drift: float, sample_rate: float):
        self._sample_rate = sample_rate
        self._loops = list(loops.items())
        self._clock_drift = clock_drift
        self._turn = 0  # lock-step: whose sample comes next

    def run_in_real_time(self, ending: threading.Event) -> None:
        """Sample all mounts by the electronics' clock, as `ElectronicsLoop` does for one."""
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
            self.step_in_lockstep(patience, LOCKSTEP_WAIT)

    def step_in_lockstep(self, patience: float, wait: float = 0.0) -> bool:
        """Take the next sample of the mount whose turn it is; as `ElectronicsLoop.step_in_lockstep`."""
        name, loop = self._loops[self._turn]
        try:
            taken = loop.step_in_lockstep(patience, wait)
        except NoAnswerError as error:
            raise NoAnswerError(f'{name}: {error}') from None
        if taken or loop.finished:
            self._turn = (self._turn + 1) % len(self._loops)
        return taken or (loop.finished and not self.finished)

    @property
    def finished(self) -> bool:
        """Whether the run is over, in lock-step with all last samples answered."""
        return all(loop.finished for _, loop in self._loops)
