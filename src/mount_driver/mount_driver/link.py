"""The state of the link to the electronics: what came, what was missing, which setpoint may leave.

No bus here: frames and times come in, decisions go out. Times are ns. Ages are judged by `Clock.now`: the
steady clock in real time, the stamps in lock-step.

The hold: a current stands on the bus only while the sample that it answers has arrived no longer ago than the
setpoint timeout. So nothing but a new sample and its own answer prolongs it, even if either is repeated.
"""

from collections import deque
from dataclasses import dataclass
from enum import Enum
from typing import NamedTuple

from mount_driver.can_messages import Measurement, OwnSetpoint, Setpoint, Status
from mount_driver.clock import Clock
from mount_driver.protocol import E2EReceiver, MountCodec, Outcome
from mount_models.sampling import HIGHEST_CURRENT, SAMPLE_TIME_NS, SETPOINT_TIMEOUT

_REMEMBERED = 64  # chosen: samples that a setpoint may name; those older than 20 ms are refused anyway
_COUNTER_MASK = 0xFFFF
_MICROSECOND_MASK = 0xFFFF_FFFF
_DISAGREEMENT_US = 10_000  # chosen: from one sample to the next its two counters agree to this
_LATE_US = 1_000_000  # chosen: beyond it a step of the clock back is a restart, forward a pause
_DOUBLE_ANSWERS = 3  # chosen: a node that ends makes one, a ramp that gives way to another node two
_DOUBLE_PERIOD = 1_000_000_000  # ns, chosen: in it a node does not end three times
_MEASURED = 6  # fields of a measurement, without its status bits: when sent again these are the same
_SLACK = 2  # samples, chosen: more may have been taken in a time than fit in by the clock's steps
_RATE_TOLERANCE = 0.2  # of the period, chosen: less than any other rate lies beside, more than samples jitter
_FARTHEST = 8  # samples, chosen: over more the counters may have begun anew
_OFF_RATE = 10  # samples in a row, chosen: 5 to 20 ms
_new = tuple.__new__  # makes a named tuple without the call of a Python function


class Refusal(Enum):
    """Why a setpoint was not sent."""

    NOT_A_NUMBER = 'it is NaN'
    NEGATIVE = 'it is below 0 A'
    UNKNOWN_SAMPLE = 'its stamp is that of none of the last 64 samples'
    STALE = 'it answers a sample that is older than the setpoint timeout'
    SUPERSEDED = 'a later sample is already answered'
    NOT_LOWER = 'its sample is already answered, and an answer may only be lowered'
    MALFORMED = 'the message lacks the coil current'
    BUS_LOST = 'the CAN bus is not there'
    SWITCHED_OFF = 'a fault keeps the coil at 0 A until mount_driver is activated again'


@dataclass
class Counts:
    """What has been counted since the activation, by the names of the figures in the diagnostics."""

    samples: int = 0
    lost: int = 0  # samples missing by their SampleCounter
    corrupt: int = 0  # frames with wrong CRC, length or content
    late: int = 0  # samples older than the one before
    resent: int = 0  # samples that came once more
    repeated: int = 0  # frames with the alive counter of the one before
    wrong_sequence: int = 0
    invalid_displacements: int = 0
    setpoints: int = 0  # let through
    limited: int = 0  # of these, limited to the greatest current
    derated: int = 0  # of these, limited further because the coil is warm
    refused: int = 0
    setpoint_timeouts: int = 0  # the answered sample became older than the timeout before the next answer
    late_setpoints: int = 0  # refused for their age, and times that a watch went to 0 A without any
    unsent: int = 0  # setpoint frames that the bus did not take
    restarts: int = 0  # of the electronics' counters, see `Clock`
    jumps: int = 0  # samples at which SampleCounter and Microseconds contradict each other, within a second
    gaps: int = 0  # pauses of more than a second, see `Clock`
    error_frames: int = 0
    unreadable: int = 0  # frames and datagrams that no frame could be made of
    setpoint_errors: int = 0  # statuses that report setpoint frames which failed their check


class Fault(NamedTuple):
    """Why the coil is to be off until the driver is activated again."""

    sentence: str
    needs_initialisation: bool = False
    """Nothing else is needed: a graph may do it by itself."""
    foreign_writer: bool = False
    """Another node publishes setpoints: the graph goes on at 0 A, and records, until a user has ended it."""


class Limits(NamedTuple):
    """What the watches allow an answer."""

    current: float = HIGHEST_CURRENT
    """What the coil may carry at present, A."""
    held: str = ''
    """Why every answer is lowered to 0 A at present; empty while none is."""


NO_LIMITS = Limits()


class Stamped(NamedTuple):
    """A sample with the ROS time (ns) at which it was taken; a setpoint names the sample by this stamp."""

    stamp: int
    sample: Measurement


class Link:
    """Judges and stamps every measurement, judges every setpoint, and counts."""

    def __init__(
        self,
        codec: MountCodec,
        clock: Clock,
        sample_time_ns: int = SAMPLE_TIME_NS,
    ):
        self.clock = clock
        self.samples, self.statuses = E2EReceiver(codec.measurement), E2EReceiver(codec.status)
        self.own_setpoints = E2EReceiver(codec.own_setpoint)
        self.counts = Counts()
        self.resent = False
        """Whether the last measurement frame was the sample that came before it, once more."""
        self.contradictions = 0
        """Samples that came once more with another content."""
        self.latest: Stamped | None = None
        """The newest sample."""
        self.status: Status | None = None
        self.last_refusal: Refusal | None = None
        self.rate_objection = ''
        """Why the electronics do not fit the graph by their counters; empty while that is not certain."""

        self.fault, self.needs_initialisation, self.foreign_writer = Fault('')
        """Why the coil is off for as long as this link lasts, see `Fault`; empty while it may be on."""
        self.double_answer = ''
        """Which sample was answered differently by two senders; empty while none was for certain."""

        self._lockstep = clock.lockstep
        self._highest_current = codec.current.high
        self._timeout = round(1e9 * SETPOINT_TIMEOUT)
        self._period = sample_time_ns // 1000  # us
        self._slack = round(_RATE_TOLERANCE * self._period)  # us
        self._shortest, self._longest = self._period - self._slack, self._period + self._slack
        self._off_rate = 0  # samples in a row that came at another rate
        self._samples: dict[int, tuple[int, int]] = {}  # stamp -> SampleCounter and arrival, oldest first
        self._answered_stamp = -1
        self._answered_current = 0.0  # A, before it was limited
        self._answered_twice: deque[int] = deque(maxlen=_DOUBLE_ANSWERS)  # stamps of such samples
        # No sample of the first minute bears this number: 0 A sent before any answer answers nothing.
        self._last_setpoint = Setpoint(0.0, _COUNTER_MASK, False)
        self._off_at: int | None = None  # time after which 0 A is due; the watch begins with its first call

    # From the electronics.

    def take(self, frame: bytes | bytearray, received: int) -> Stamped | None:
        """Return the sample of a frame with its stamp if it is a new one, else None.

        `received` is the time of the frame on the steady clock.
        """
        sample, before, counts = self.samples.receive(frame), self.latest, self.counts
        self.resent = False
        if sample is None:
            self._count_unused(self.samples.outcome)
            return None
        counter, microseconds = sample.sample_counter, sample.microseconds
        if before is not None:
            last = before.sample
            step = (counter - last.sample_counter) & _COUNTER_MASK
            step_us = (microseconds - last.microseconds) & _MICROSECOND_MASK
            if step == 1 and self._shortest <= step_us <= self._longest:
                self._off_rate = 0
            elif not self._is_new(sample, last, step, step_us):
                return None
        counts.samples += 1
        if sample.displacement != sample.displacement:
            counts.invalid_displacements += 1
        if sample.setpoint_timeout and self._last_setpoint.enable:
            # The electronics' own watch has gone to 0 A although setpoints leave.
            counts.late_setpoints += before is None or not before.sample.setpoint_timeout
        stamp = self.clock.stamp(microseconds, received)
        samples = self._samples
        if len(samples) == _REMEMBERED:
            del samples[next(iter(samples))]
        samples[stamp] = counter, stamp if self._lockstep else received
        self.latest = stamped = _new(Stamped, (stamp, sample))
        return stamped

    def take_status(self, data: bytes | bytearray) -> Status | None:
        """Keep the status of a frame if it is sound, and return it; else None."""
        status = self.statuses.receive(data)
        if status is None:
            self._count_unused(self.statuses.outcome)
        else:
            self.status = status
            self.counts.setpoint_errors += status.e2e_error
        return status

    def take_own(self, data: bytes | bytearray) -> tuple[int, OwnSetpoint] | None:
        """Return stamp (ns) of the sample and the electronics' own setpoint of a sound frame, else None."""
        own = self.own_setpoints.receive(data)
        if own is None:
            self._count_unused(self.own_setpoints.outcome)
            return None
        counter, samples = own.answered_counter, reversed(self._samples.items())
        return next(((stamp, own) for stamp, (known, _) in samples if known == counter), None)

    # To the electronics.

    def answer(self, stamp: int, current: float, now: int, limits: Limits = NO_LIMITS) -> Setpoint | None:
        """Return the setpoint that answers the sample of `stamp` (ns), or None: see `last_refusal`.

        `current` in A; above what it may be by the DBC and by the watches it is limited.
        """
        known, answered, counts = self._samples.get(stamp), self._answered_stamp, self.counts
        if known is None:
            self.refuse(Refusal.UNKNOWN_SAMPLE)
            return None
        counter, arrival = known
        if stamp == answered:
            self._compare(stamp, current)
        refusal = None
        if self.fault:
            refusal = Refusal.SWITCHED_OFF
        elif current != current:
            refusal = Refusal.NOT_A_NUMBER
        elif current < 0.0:
            refusal = Refusal.NEGATIVE
        elif now - arrival > self._timeout:
            refusal = Refusal.STALE
        elif stamp < answered:
            refusal = Refusal.SUPERSEDED
        # 0 A may be repeated: a node that ends sends it for the sample that it has answered.
        elif stamp == answered and current > 0.0 and current >= self._last_setpoint.current:
            refusal = Refusal.NOT_LOWER
        if refusal is not None:
            self.refuse(refusal)
            return None
        self._answered_stamp, self._answered_current = stamp, current
        current_limit, held = limits
        if current > self._highest_current:
            counts.limited += 1
            current = self._highest_current
        if current > current_limit:
            counts.derated += 1
            current = current_limit
        if held:
            current = 0.0
        counts.setpoints += 1
        self._off_at = arrival + self._timeout
        self._last_setpoint = setpoint = _new(Setpoint, (current, counter, True))
        return setpoint

    def refuse(self, reason: Refusal) -> None:
        """Count a setpoint that is not sent."""
        self.counts.refused += 1
        self.counts.late_setpoints += reason in (Refusal.STALE, Refusal.UNKNOWN_SAMPLE)
        self.last_refusal = reason

    @property
    def nameless(self) -> bool:
        """Whether the fault is two answers to a sample, of which it is not known who gives the other."""
        return bool(self.fault) and self.fault == self.double_answer

    def switch_off(self, fault: Fault) -> Setpoint:
        """Refuse all setpoints from now on; return the one that switches the coil off."""
        self.fault, self.needs_initialisation, self.foreign_writer = fault
        return self.off()

    def answer_again(self, sample_counter: int, now: int) -> Setpoint | None:
        """Return the last setpoint if it holds and answered this sample: the electronics did not get it."""
        last = self._last_setpoint
        holds = last.enable and self.time_until_off(now) >= 0
        return last if holds and last.answered_counter == sample_counter else None

    def off(self) -> Setpoint:
        """Return the setpoint that switches the coil off; it answers no new sample."""
        self._last_setpoint = Setpoint(0.0, self._last_setpoint.answered_counter, False)
        return self._last_setpoint

    def time_until_off(self, now: int) -> int:
        """Return how long until 0 A is due, ns; negative when it is."""
        if self._off_at is None:
            self._off_at = now + self._timeout
        return self._off_at - now

    def off_is_due(self, now: int) -> bool:
        """Whether the sample answered last is older than the timeout, so that 0 A must be sent.

        True once when that happens and then once per timeout, so that a lost frame does no harm.
        """
        if self.time_until_off(now) >= 0:
            return False
        if self._last_setpoint.enable:
            self.counts.setpoint_timeouts += 1
            self.counts.late_setpoints += 1
        self._off_at = now + self._timeout
        return True

    @property
    def driving(self) -> bool:
        """Whether the last frame to the electronics was a setpoint and not 0 A from here."""
        return self._last_setpoint.enable

    def _compare(self, stamp: int, current: float) -> None:
        """Note another answer to the sample of `stamp`; a node that ends adds one of 0 A, once."""
        first, found = self._answered_current, self._answered_twice
        if current == first or (found and found[-1] == stamp):
            return
        found.append(stamp)
        if len(found) == _DOUBLE_ANSWERS and stamp - found[0] <= _DOUBLE_PERIOD:
            self.double_answer = (
                f'{len(found)} samples within {1e-9 * _DOUBLE_PERIOD:g} s were answered twice, the '
                f'last with {first:.3f} A and {current:.3f} A (limit: one answer each): end one of the two '
                'nodes that publish current_setpoint'
            )

    def _count_unused(self, outcome: Outcome) -> None:
        """Count a frame that is not used, of any message."""
        self.counts.repeated += outcome is Outcome.REPEATED
        self.counts.wrong_sequence += outcome is Outcome.WRONG_SEQUENCE
        self.counts.corrupt += outcome is Outcome.CORRUPT

    def _is_new(self, sample: Measurement, last: Measurement, step: int, step_us: int) -> bool:
        """Judge and count a sample that came `step` samples and `step_us` behind the last one."""
        counts = self.counts
        if step == 0 and step_us == 0:
            counts.resent += 1
            self.resent = True
            self.contradictions += sample[:_MEASURED] != last[:_MEASURED]
            return False
        back_us = _MICROSECOND_MASK + 1 - step_us
        if back_us < _LATE_US and _COUNTER_MASK + 1 - step <= _REMEMBERED:
            counts.late += 1
            return False
        beside = abs(step_us - step * self._period)
        # Behind a restart or a pause the counters say nothing: the clock counts it, once.
        if step_us < _LATE_US and not (step > 0 and step_us > 0 and beside < _DISAGREEMENT_US):
            counts.jumps += 1
        # Nor were more samples taken than there was time for.
        if step > 1 and (step - _SLACK) * self._period <= step_us < _LATE_US:
            counts.lost += step - 1
        if beside <= step * self._slack:
            self._off_rate = 0
        elif 0 < step <= _FARTHEST:
            self._off_rate += 1
            if self._off_rate >= _OFF_RATE:
                # Both counters come in the same frame, so neither load nor lost frames alter what is seen.
                self.rate_objection = (
                    f'the electronics sample every {step_us / step:.0f} us, but sample_rate '
                    f'({1e6 / self._period:g} Hz) means {self._period} us (limit {self._slack} us beside '
                    'it): start the whole graph with the sample_rate of the electronics'
                )
        return True
