"""The dialogue with the electronics: which ripple sample is answered, and the end at 0 A in every case.

Samples and setpoints come in on the thread of the data path, the ramp is run by the thread of the
lifecycle transition. Each sample is answered at most once, so that electronics which wait for the answer
(lock-step) are served exactly. The wall clock only ends a ramp that went silent; it never alters a result.

A ramp that gets no current looks like a broken cable; the driver knows the reason.
"""

import math
import threading
import time
from collections.abc import Callable, Mapping

from mount_init.errors import InitialisationError
from mount_init.initialisation import OFF, Initialisation

_CHECK_PERIOD = 0.05  # s: how soon silence, a timeout or the end of the process is noticed
_LONGEST_AGE = 2.0  # s, chosen: every node publishes its verdict once a second
_VERDICT_PERIOD = 0.02  # s, chosen: how soon a verdict is noticed


_Sample = tuple[int, float, float, float]  # stamp (ns), current (A), slopes of current and flux density


class CoilDialogue:
    """Answers ripple samples while a ramp runs; `publish(stamp, current)` sends a setpoint (ns, A)."""

    def __init__(self, publish: Callable[[int, float], None]):
        self._publish = publish
        self._lock = threading.RLock()
        self._over = threading.Event()
        self._ramp: Initialisation | None = None
        self._ramp_start: int | None = None  # stamp of the first sample of the ramp
        self._intruder: InitialisationError | None = None
        self._newest: _Sample | None = None
        self._newest_arrival = -math.inf  # s, steady clock
        self._answered: int | None = None  # stamp of the newest sample that we answered
        self._last_setpoint = OFF
        self._own: set[tuple[int, float]] = set()  # setpoints that have not come back to us yet
        self._foreign_stamp: int | None = None
        self._foreign_arrival = -math.inf

    # What the data path brings.

    def take_ripple(self, stamp: int, current: float, current_rate: float, flux_rate: float) -> None:
        """Take a ripple sample of time `stamp` (ns); answer it if a ramp runs."""
        with self._lock:
            if self._newest is not None and stamp <= self._newest[0]:
                if self._ramp is not None:
                    return  # a sample that comes twice or late is not answered again
                if stamp < self._newest[0]:
                    self._answered = self._foreign_stamp = None  # the electronics' time has started anew
            self._newest = (stamp, current, current_rate, flux_rate)
            self._newest_arrival = time.monotonic()
            if self._ramp is not None:
                self._answer(self._ramp, self._newest)

    def take_setpoint(self, stamp: int, current: float) -> None:
        """Take a setpoint (A) seen on the topic, ours or another node's, in answer to sample `stamp`."""
        with self._lock:
            if (stamp, current) in self._own:
                self._own.discard((stamp, current))
                return
            self._foreign_stamp, self._foreign_arrival = stamp, time.monotonic()
            if self._ramp_start is not None and stamp >= self._ramp_start:
                self.give_way(
                    f'another node sent a current_setpoint of {current:.3f} A during the ramp; deactivate '
                    f'mount_control before mount_init is activated'
                )

    def give_way(self, sentence: str) -> None:
        """End the ramp, if one runs, because of what `sentence` says; `run` raises it."""
        with self._lock:
            if self._ramp is not None:
                self._intruder = InitialisationError(sentence)
                self._end()

    # What the transition does.

    def forget_streams(self) -> None:
        """Begin anew after a time without subscriptions: another node may have sent setpoints until now."""
        with self._lock:
            self._newest, self._newest_arrival = None, -math.inf
            self._foreign_arrival = time.monotonic()

    def await_quiet(self, duration: float, ending: threading.Event) -> None:
        """Return when no other node has sent a setpoint for `duration` (s), else raise `InitialisationError`.

        A node that has just been deactivated is given the time to fall silent.
        """
        if (remaining := self._foreign_arrival + duration - time.monotonic()) > 0.0:
            ending.wait(remaining)
        if (remaining := self._foreign_arrival + duration - time.monotonic()) > 0.0:
            raise InitialisationError(
                f'another node sent a current_setpoint {(duration - remaining) * 1e3:.0f} ms ago, needed '
                f'are {duration * 1e3:.0f} ms without any; deactivate mount_control first'
            )

    def run(
        self,
        ramp: Initialisation,
        silence_timeout: float,
        total_timeout: float,
        ending: threading.Event,
        objection: Callable[[], str] = str,
    ) -> None:
        """Answer samples until `ramp` is finished; an unanswered sample that is already here comes first.

        Raises `InitialisationError` after `silence_timeout` (s) without a sample, after `total_timeout` (s),
        if another node answers too, if there is an `objection`, and if the process is ending. Leaves 0 A
        behind in every case.
        """
        try:
            self._begin(ramp)
            start = time.monotonic()
            while not self._over.wait(_CHECK_PERIOD):
                now = time.monotonic()
                if ending.is_set():
                    raise InitialisationError(
                        'the ramp was given up because the process is ending; start it again'
                    )
                if now - max(start, self._newest_arrival) > silence_timeout:
                    raise ramp.silence(silence_timeout)
                if now - start > total_timeout:
                    raise InitialisationError(
                        f'air gap not estimated: {ramp.readings.received} of {ramp.length} ripple samples in '
                        f'{total_timeout:.1f} s; is mount_driver overloaded, or the measurement rate too low?'
                    )
                if reason := objection():
                    raise InitialisationError(reason)
            if self._intruder is not None:
                raise self._intruder
        finally:
            self.switch_off()

    def switch_off(self) -> None:
        """End the ramp, if one runs, and send 0 A unless that was our last setpoint."""
        with self._lock:
            self._end()
            if self._last_setpoint != OFF and self._answered is not None:
                self._send(self._answered, OFF)

    def _begin(self, ramp: Initialisation) -> None:
        with self._lock:
            self._over.clear()
            self._intruder = None
            self._own.clear()  # those that never came back
            self._ramp, self._ramp_start = ramp, None
            answers = self._answered, self._foreign_stamp
            if self._newest is not None and all(a is None or self._newest[0] > a for a in answers):
                self._answer(ramp, self._newest)

    def _answer(self, ramp: Initialisation, sample: _Sample) -> None:
        if self._ramp_start is None:
            self._ramp_start = sample[0]
        self._answered = sample[0]
        self._send(sample[0], ramp.step(*sample))
        if ramp.finished:
            self._end()

    def _send(self, stamp: int, setpoint: float) -> None:
        self._own.add((stamp, setpoint))
        self._last_setpoint = setpoint
        self._publish(stamp, setpoint)

    def _end(self) -> None:
        self._ramp = None
        self._over.set()


class DriverReport:
    """The newest verdict of the driver; for any thread. `peak_current` (A) is what the ramp needs."""

    def __init__(self, peak_current: float):
        self._peak = peak_current
        self._refusal = ''
        self.late_setpoints: int | None = None
        """How many setpoints came too late since its activation; None where it has not reported any count."""
        self._arrival = 0.0  # s, steady clock

    def take(self, refuses: bool, sentence: str, figures: Mapping[str, str]) -> None:
        """Take a verdict; `refuses`: it keeps the coil at 0 A."""
        allowed = float(figures.get('current_limit', self._peak))
        self._refusal = ''
        if refuses:
            self._refusal = f'mount_driver keeps the coil at 0 A: {sentence}'
        elif allowed < self._peak:
            needed = f'the ramp needs {self._peak:.3f} A'
            self._refusal = f'mount_driver lets the coil carry {allowed:.3f} A, {needed}: {sentence}'
        self.late_setpoints = int(figures['late_setpoints']) if 'late_setpoints' in figures else None
        self._arrival = time.monotonic()

    @property
    def refusal(self) -> str:
        """Why the driver lets no ramp through now; empty where it has not reported that within 2 s."""
        return self._refusal if time.monotonic() - self._arrival < _LONGEST_AGE else ''

    def wait_for_next(self, timeout: float, ending: threading.Event) -> None:
        """Return when another verdict has come, or after `timeout` s."""
        begin = time.monotonic()
        _wait_until(lambda: self._arrival > begin, timeout, ending)

    def settled(self, refusing: bool, timeout: float, ending: threading.Event) -> str:
        """Return `refusal` as soon as there is one, or none, as `refusing` says, or after `timeout` s."""
        _wait_until(lambda: bool(self.refusal) is refusing, timeout, ending)
        return self.refusal


def _wait_until(condition: Callable[[], bool], timeout: float, ending: threading.Event) -> None:
    end = time.monotonic() + timeout
    while not condition() and time.monotonic() < end and not ending.wait(_VERDICT_PERIOD):
        """Wait on."""
