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
_VERDICT_PATIENCE = 0.3  # s, chosen: the driver judges itself ten times a second


class CoilDialogue:
    """Answers ripple samples while a ramp runs; `publish(stamp, current)` sends a setpoint (ns, A)."""

    def __init__(self, publish: Callable[[int, float], None]):
        self._publish = publish
        self._lock = threading.RLock()
        self._over = threading.Event()
        self._ramp: Initialisation | None = None
        self._ramp_start: int | None = None  # stamp of the first sample of the ramp
        self._intruder = ''
        self._newest: tuple[int, float, float, float] | None = None  # as `take_ripple` takes them
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
            self._answer()

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
                self._intruder = sentence
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
        ending.wait(max(0.0, self._foreign_arrival + duration - time.monotonic()))
        if (silent := time.monotonic() - self._foreign_arrival) < duration:
            raise InitialisationError(
                f'another node sent a current_setpoint {silent * 1e3:.0f} ms ago, needed are '
                f'{duration * 1e3:.0f} ms without any; deactivate mount_control first'
            )

    def run(
        self, ramp: Initialisation, ending: threading.Event, check: Callable[[], None] = lambda: None
    ) -> None:
        """Answer samples until `ramp` is finished; an unanswered sample that is already here comes first.

        Raises `InitialisationError` after the timeouts of its parameters, if another node answers too, and
        if the process is ending; calls `check` meanwhile. Leaves 0 A behind in every case.
        """
        parameters, readings = ramp.parameters, ramp.readings
        try:
            self._begin(ramp)
            start = time.monotonic()
            while not self._over.wait(_CHECK_PERIOD):
                check()
                now, reason = time.monotonic(), ''
                if ending.is_set():
                    reason = 'the ramp was given up because the process is ending; start it again'
                elif now - max(start, self._newest_arrival) > parameters.silence_timeout:
                    reason = (
                        f'air gap not estimated: {readings.valid} of {ramp.length} ripple samples, none in '
                        f'the last {parameters.silence_timeout:.1f} s; is mount_driver active?'
                    )
                elif now - start > parameters.total_timeout:
                    reason = (
                        f'air gap not estimated: {readings.received} of {ramp.length} ripple samples in '
                        f'{parameters.total_timeout:.1f} s; is mount_driver overloaded, or the measurement '
                        'rate too low?'
                    )
                if reason:
                    raise InitialisationError(reason)
            if self._intruder:
                raise InitialisationError(self._intruder)
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
            self._intruder = ''
            self._own.clear()  # those that never came back
            self._ramp, self._ramp_start = ramp, None
            answers = self._answered, self._foreign_stamp
            if self._newest is not None and all(a is None or self._newest[0] > a for a in answers):
                self._answer()

    def _answer(self) -> None:
        """Answer the newest sample if a ramp runs."""
        if self._ramp is None or self._newest is None:
            return
        self._answered = stamp = self._newest[0]
        self._ramp_start = self._ramp_start or stamp
        self._send(stamp, self._ramp.step(*self._newest))
        if self._ramp.finished:
            self._end()

    def _send(self, stamp: int, setpoint: float) -> None:
        self._own.add((stamp, setpoint))
        self._last_setpoint = setpoint
        self._publish(stamp, setpoint)

    def _end(self) -> None:
        self._ramp = None
        self._over.set()


class DriverReport:
    """Why the driver lets no ramp through; for any thread. `peak_current` (A) is what the ramp needs."""

    def __init__(self, peak_current: float):
        self._peak, self._refusal = peak_current, ''
        self._arrival = -math.inf  # s, steady clock

    def take(self, refuses: bool, sentence: str, figures: Mapping[str, str]) -> None:
        """Take a report; `refuses`: the driver keeps the coil at 0 A."""
        allowed = float(figures.get('current_limit', self._peak))
        self._refusal = ''
        if refuses:
            self._refusal = f'mount_driver keeps the coil at 0 A: {sentence}'
        elif allowed < self._peak:
            self._refusal = (
                f'mount_driver lets the coil carry {allowed:.3f} A, the ramp needs {self._peak:.3f} A: '
                f'{sentence}'
            )
        self._arrival = time.monotonic()

    def refusal(self, ending: threading.Event) -> str:
        """Return its reason of the last 2 s as soon as there is one; empty where none comes."""
        begin = time.monotonic()
        while not self._refusal or time.monotonic() - self._arrival > _LONGEST_AGE:
            if time.monotonic() - begin > _VERDICT_PATIENCE or ending.wait(_CHECK_PERIOD):
                return ''
        return self._refusal
