"""The simulated electronics of all mounts at work, each on a bus of its own, in one thread.

Samples out, setpoints in, the plant moved on; in real time and in lock-step.
"""

import copy
import math
import threading
import time
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field

from mount_driver.bus import Frame
from mount_driver.can_messages import Status
from mount_ros.timing import LatencyHistogram
from mount_sim.electronics.can_end import CanEnd, ReceivedSetpoint
from mount_sim.electronics.electronics import status_every
from mount_sim.electronics.vehicle_bus import sent_every
from mount_sim.plant.simulated_car import BeyondRange, SimulatedMount
from mount_sim.quantisation import quantised_displacement, quantised_setpoint_current

_REMEMBERED = 1024  # samples whose sending time is kept
_NS = 1000  # ns per us
_DISCHARGED = 0.01  # A, chosen: a coil with less carries no current
_DISCHARGE_LIMIT = 0.1  # s, chosen: the setpoint timeout, then several times what a sound coil needs
_FORGOTTEN = 0.01  # chosen: of the longest time that the work took, from one sample to the next
_RESERVE = 1.5  # chosen: times the work's longest time are kept for it


class NoAnswerError(RuntimeError):
    """In lock-step a sample was not answered in time."""


@dataclass
class LoopFigures:
    """What happened on the bus so far; times in s."""

    samples: int = 0
    answered: int = 0
    overruns: int = 0
    wall_time: float = 0.0
    latency: LatencyHistogram = field(default_factory=LatencyHistogram)
    failure: str = ''
    beyond_range: BeyondRange = field(default_factory=BeyondRange)


class ElectronicsLoop:
    """Measures, sends, lets the plant go on, takes setpoints over; `publish` shows each sample's truth."""

    def __init__(
        self,
        mount: SimulatedMount,
        can_end: CanEnd,
        publish: Callable[[int], None],
        speed: Frame | None = None,
    ):
        """`speed` is what the vehicle sends of its engine every 10 ms, nothing by default."""
        self._mount = mount
        self._speed, self._speed_every = speed, sent_every(mount.sample_rate)
        self._can_end = can_end
        self._status_every = status_every(mount.sample_rate)
        self._publish = publish
        self._sent_at = [math.nan] * _REMEMBERED
        self._asked: int | None = None  # lock-step: the sample that waits for its answer
        self._answer: ReceivedSetpoint | None = None
        self._taken: tuple[float | None, int] = (None, 0)  # current (A), and how many samples late
        self._counted = 0  # the newest sample as the electronics count it, not yet cut to its width
        self._asked_at = 0.0
        self._answered_first = math.nan
        self._failed_told = 0  # setpoint frames that had failed their check by the last status
        self._beyond_told = 0  # samples beyond the sensor's range, when the last status was sent
        self.figures = LoopFigures(beyond_range=mount.beyond_range)
        self.last_latency = math.nan

    def discharged(self) -> bool:
        """Whether the coil carries no current any more."""
        return abs(self._mount.truth['coil_current']) < _DISCHARGED

    def send_sample(self) -> None:
        """Send the next sample, and take the newest setpoint, if one has come, for the time from it on."""
        self._taken = self._send(self._can_end.newest())

    def wait_for_answer(self, end: float) -> None:
        """Return when a frame has come, or at `end` (s, steady clock)."""
        self._can_end.wait_for_frame(max(0.0, end - time.monotonic()))

    def go_on(self) -> None:
        """Let the plant go on to the next sample, and show the truth of the last."""
        self._publish(self._mount.sample)
        self._mount.advance(*self._taken)
        self.figures.samples += 1

    def step_in_lockstep(self, patience: float) -> bool:
        """Take the next sample if the last one is answered; return whether it was.

        Raises `NoAnswerError` when no answer came for `patience` s; the first sample waits for the
        activation of the node that answers it.
        """
        if self._asked is not None:
            answer = self._can_end.answer_to(self._asked)
            if answer is None:
                self._check_patience(self._asked, patience)
                return False
            self._take_answer(answer)
        if self._mount.finished:
            return False
        answer, self._answer = self._answer, None
        self._taken = self._send(answer)
        self.go_on()
        self._asked, self._asked_at = self._counted, time.monotonic()
        return True

    @property
    def finished(self) -> bool:
        """Whether the run is over, in lock-step with its last sample answered."""
        return self._mount.finished and self._asked is None

    def _send(self, received: ReceivedSetpoint | None) -> tuple[float | None, int]:
        """Send the next sample; return what `received` lets the plant take over from it on."""
        mount, number = self._mount, self._mount.sample
        reading = mount.measure()
        microseconds = self._count(number)
        taken = self._valid(received)
        frames = [
            self._can_end.measurement_frame(
                self._counted, microseconds, reading, enabled=mount.driver_on, unheard=not mount.enabled
            )
        ]
        if (law := self._can_end.law) is not None:
            (current, late), own = taken, []
            if received is not None and current is not None and received.setpoint.enable:
                own += law.take_answer(self._counted - 1 - late)
                current = min(current, quantised_setpoint_current(law.current))  # NaN lowers nothing
            elif current is not None or not mount.enabled:
                law.stop()
            displacement = quantised_displacement(reading.displacement)
            own.append(law.take_sample(self._counted, microseconds * _NS, displacement))
            taken, frames = (current, late), [*frames, *map(self._can_end.own_frame, own)]
        if number % self._status_every == 0:
            frames.append(self._can_end.status_frame(mount.faults.through('status', self._status())))
        if self._speed is not None and number % self._speed_every == 0:
            frames.append(copy.deepcopy(self._speed))
        if mount.faults.present:
            frames = mount.faults.through('frames', frames)
        self._sent_at[self._counted % _REMEMBERED] = time.time()
        for frame in frames:
            self._can_end.send_frame(frame)
        return taken

    def _count(self, number: int) -> int:
        """Note sample `number` as the electronics count it; return their clock in us."""
        faults, microseconds = self._mount.faults, number * self._mount.sample_time // _NS
        self._counted = number
        if faults.present:
            self._counted, microseconds = faults.through('counters', (number, microseconds))
            if faults.restarts:
                self._can_end.restart()
                self._mount.forget()
        return microseconds

    def _valid(self, received: ReceivedSetpoint | None) -> tuple[float | None, int]:
        """Return the current (A) to take over, None if there is none, and how many samples late it is."""
        if received is None or self._mount.faults.deaf:
            return None, 0
        late = received.late(self._counted)
        if late >= self._mount.patience:
            return None, 0  # an answer to a sample of the past must not keep the coil on
        self._note(received)
        return received.setpoint.current if received.setpoint.enable else 0.0, late

    def _note(self, received: ReceivedSetpoint) -> None:
        if not received.setpoint.enable:
            return
        self.figures.answered += 1
        sent = self._sent_at[received.setpoint.answered_counter % _REMEMBERED]
        self.last_latency = received.arrival - sent
        if self.last_latency == self.last_latency:  # the bus tells when its frames arrive
            self.figures.latency.add(self.last_latency)

    def _take_answer(self, answer: ReceivedSetpoint) -> None:
        now = time.monotonic()
        if math.isnan(self._answered_first):
            self._answered_first = now
        self.figures.wall_time = now - self._answered_first
        self._asked, self._answer = None, answer
        if self._mount.finished:
            self._note(answer)

    def _check_patience(self, number: int, patience: float) -> None:
        first = math.isnan(self._answered_first)
        if not first and time.monotonic() - self._asked_at >= patience:
            at = number / self._mount.sample_rate
            raise NoAnswerError(f'sample {number} ({at:.3f} s) was not answered within {patience:g} s')

    def _status(self) -> Status:
        failed, self._failed_told = self._failed_told, self._can_end.failed_setpoints
        beyond, self._beyond_told = self._beyond_told, self._mount.beyond_range.samples
        return Status(
            displacement_sensor=self._beyond_told > beyond,
            supply_voltage=self._mount.electronics.supply_voltage,
            coil_temperature_celsius=self._mount.electronics.coil_temperature,
            setpoint_timeout=not self._mount.enabled,
            e2e_error=self._failed_told > failed,
        )


def until_ending(ending: threading.Event, discharged: Callable[[], bool]) -> Iterator[None]:
    """Yield for each sample until `ending` is set and the coils are `discharged`, or 0.1 s after `ending`.

    Electronics outlive the graph: its last setpoint is followed, and the truth shows that the current goes.
    """
    while not ending.is_set():
        yield
    limit = time.monotonic() + _DISCHARGE_LIMIT
    while not discharged() and time.monotonic() < limit:
        yield


class CarLoop:
    """Takes each sample of all mounts, one after the other, before it takes the next of the first."""

    def __init__(self, loops: Mapping[str, ElectronicsLoop], clock_drift: float, sample_rate: float):
        self._sample_rate = sample_rate
        self._loops, self._names = list(loops.values()), list(loops)
        self._clock_drift = clock_drift
        self._turn = 0  # lock-step: whose sample comes next

    def run_in_real_time(self, ending: threading.Event) -> None:
        """Sample by the electronics' clock until `ending` is set and the coils are discharged.

        So it goes on after the end of the run: electronics do not fall silent when a drive is over; if they
        did, the control would rightly report it.
        """
        period = 1.0 / self._sample_rate / (1.0 + self._clock_drift)
        # The simulator's own work on a sample waits until the graph has answered: electronics have a
        # processor of their own; with two of them the simulator would take one from the graph.
        longest, begin = period, time.monotonic()
        for number, _ in enumerate(until_ending(ending, self._discharged), 1):
            for loop in self._loops:
                loop.send_sample()
            for loop in self._loops:
                loop.wait_for_answer(begin + number * period - _RESERVE * longest)
            answered = time.monotonic()
            for loop in self._loops:
                loop.go_on()
            now = time.monotonic()
            longest = max(now - answered, (1.0 - _FORGOTTEN) * longest)
            remaining = begin + number * period - now
            for loop in self._loops:
                loop.figures.wall_time = now - begin
                loop.figures.overruns += remaining <= 0.0  # the next samples follow at once: none is skipped
            if remaining > 0.0:
                time.sleep(remaining)

    def _discharged(self) -> bool:
        return all(loop.discharged() for loop in self._loops)

    def step_in_lockstep(self, patience: float) -> bool:
        """Take the next sample of the mount whose turn it is; as `ElectronicsLoop.step_in_lockstep`.

        A mount alone has no name; of several the name of the mount leads an error.
        """
        name, loop = self._names[self._turn], self._loops[self._turn]
        try:
            taken = loop.step_in_lockstep(patience)
        except NoAnswerError as error:
            raise NoAnswerError(f'{name}: {error}' if name else str(error)) from None
        if taken or loop.finished:
            self._turn = (self._turn + 1) % len(self._loops)
        return taken or (loop.finished and not self.finished)

    @property
    def finished(self) -> bool:
        """Whether the run is over, in lock-step with all last samples answered."""
        return all(loop.finished for loop in self._loops)
