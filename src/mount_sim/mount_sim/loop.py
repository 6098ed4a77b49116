"""The simulated electronics at work on the bus: in real time, or in lock-step with the answers."""

import math
import threading
import time
from collections.abc import Callable
from dataclasses import dataclass, field

from mount_driver.codec import Status
from mount_ros.timing import LatencyHistogram
from mount_sim.can_end import CanEnd, ReceivedSetpoint
from mount_sim.electronics import ElectronicsParameters
from mount_sim.faults import Fault
from mount_sim.simulated_mount import SAMPLE_TIME, SimulatedMount

_STATUS_EVERY = 100  # samples: 10 Hz
_REMEMBERED = 1024  # samples whose sending time is kept
_MICROSECONDS = 1_000_000


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


class ElectronicsLoop:
    """Measures, sends, lets the plant go on, takes setpoints over; `publish` shows each sample's truth."""

    def __init__(
        self,
        mount: SimulatedMount,
        can_end: CanEnd,
        electronics: ElectronicsParameters,
        fault: Fault,
        publish: Callable[[int], None],
    ):
        self._mount = mount
        self._can_end = can_end
        self._electronics = electronics
        self._fault = fault
        self._publish = publish
        self._sent_at = [math.nan] * _REMEMBERED
        self.figures = LoopFigures()
        self.last_latency = math.nan

    def run_in_real_time(self, ending: threading.Event) -> None:
        """Sample at 1 kHz of the electronics' clock until the run is over or `ending` is set."""
        self._can_end.listen()
        period = SAMPLE_TIME / (1.0 + self._electronics.clock_drift)
        taken: ReceivedSetpoint | None = None
        begin = time.monotonic()
        while not self._mount.finished and not ending.is_set():
            latest = self._can_end.latest
            new = latest if latest is not taken else None
            taken = latest
            self._tick(new)
            self.figures.wall_time = time.monotonic() - begin
            remaining = begin + self._mount.sample * period - time.monotonic()
            if remaining > 0.0:
                time.sleep(remaining)
            else:
                self.figures.overruns += 1  # the next sample follows at once: none is skipped

    def run_in_lockstep(self, ending: threading.Event, patience: float) -> None:
        """Sample as fast as the answers come; raise `NoAnswerError` after `patience` s without one."""
        pending: ReceivedSetpoint | None = None
        begin: float | None = None
        while not self._mount.finished and not ending.is_set():
            number = self._mount.sample
            self._tick(pending)
            # The first sample waits for the activation of whoever answers it.
            pending = self._wait_for_answer(number, patience if begin is not None else math.inf, ending)
            begin = begin or time.monotonic()
            self.figures.wall_time = time.monotonic() - begin
        if pending is not None:
            self._note(pending)

    def _tick(self, received: ReceivedSetpoint | None) -> None:
        mount, number, now = self._mount, self._mount.sample, self._mount.time
        setpoint = self._setpoint_of(received, now)
        reading = self._fault.reading(now, mount.measure())
        frame = self._can_end.measurement_frame(
            number, number * round(SAMPLE_TIME * _MICROSECONDS), reading, mount.enabled
        )
        arriving = self._fault.frame(now, number, frame)
        self._sent_at[number % _REMEMBERED] = time.monotonic()
        if arriving is not None:
            self._can_end.send_frame(arriving)
        if number % _STATUS_EVERY == 0:
            self._can_end.send_status(self._status())
        self._publish(number)
        mount.advance(setpoint)
        self.figures.samples += 1

    def _setpoint_of(self, received: ReceivedSetpoint | None, now: float) -> float | None:
        if received is None or self._fault.deaf(now):
            return None
        self._note(received)
        return received.setpoint.current if received.setpoint.enable else 0.0

    def _note(self, received: ReceivedSetpoint) -> None:
        if not received.setpoint.enable:
            return
        self.figures.answered += 1
        sent = self._sent_at[received.setpoint.answered_counter % _REMEMBERED]
        self.last_latency = received.arrival - sent
        self.figures.latency.add(self.last_latency)

    def _wait_for_answer(
        self, number: int, patience: float, ending: threading.Event
    ) -> ReceivedSetpoint | None:
        waited = 0.0
        while not ending.is_set():
            received = self._can_end.wait_for_answer(number, 0.5)
            if received is not None:
                return received
            waited += 0.5
            if waited >= patience:
                raise NoAnswerError(
                    f'sample {number} ({number * SAMPLE_TIME:.3f} s) was not answered within {patience:g} s'
                )
        return None

    def _status(self) -> Status:
        return Status(
            supply_voltage=self._electronics.supply_voltage,
            coil_temperature_celsius=self._electronics.coil_temperature,
            setpoint_timeout=not self._mount.enabled,
        )
