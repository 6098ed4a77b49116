"""The state of the link to the electronics: what came, what was missing, which setpoint may leave.

No bus here: frames and times come in, decisions go out. Times are ns. Ages are judged by `Clock.now`: the
steady clock in real time, the stamps in lock-step.

The hold: a current stands on the bus only while the sample that it answers has arrived no longer ago than the
setpoint timeout. So nothing but a new sample and its own answer prolongs it, even if either is repeated.
"""

from collections import deque
from enum import Enum, IntEnum
from typing import NamedTuple

from mount_driver.clock import Clock
from mount_driver.codec import Measurement, MountCodec, Setpoint, Status
from mount_driver.e2e_receiver import E2EReceiver, Outcome
from mount_models.sampling import SAMPLE_TIME_NS

_REMEMBERED = 64  # chosen: samples that a setpoint may name; those older than 20 ms are refused anyway
_COUNTER_MASK = 0xFFFF
_MICROSECOND_MASK = 0xFFFF_FFFF
_DISAGREEMENT_US = 10_000  # chosen: from one sample to the next its two counters agree to this
_LATE_US = 1_000_000  # chosen: beyond it a step of the clock back is a restart, forward a pause
_DOUBLE_ANSWERS = 3  # chosen: a node that ends makes one, a ramp that gives way to another node two
_DOUBLE_PERIOD = 1_000_000_000  # ns, chosen: in it a node does not end three times
_MEASURED = 6  # fields of a measurement, without its status bits: when sent again these are the same
_SLACK = 2  # samples, chosen: more may have been taken in a time than fit in by the clock's steps


class Arrival(IntEnum):
    """What a measurement frame was."""

    NEW = 0
    RESENT = 1  # the sample that came last, once more
    LATE = 2  # older than the last one: not used
    CORRUPT = 3  # wrong CRC or length: not used
    DISORDERED = 4  # repeated or of wrong sequence by its alive counter, or soon after such: not used


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


_LATE = frozenset((Refusal.STALE, Refusal.UNKNOWN_SAMPLE))


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
        setpoint_timeout_ns: int,
        sample_time_ns: int = SAMPLE_TIME_NS,
    ):
        self.clock = clock
        self.samples = E2EReceiver(codec.decode_measurement, codec.measurement)
        self.statuses = E2EReceiver(codec.decode_status, codec.status)
        self.arrival = Arrival.NEW
        self.arrivals = [0] * len(Arrival)
        """Measurement frames by `Arrival`."""
        self.lost = 0
        """Samples missing by their SampleCounter."""
        self.jumps = 0
        """Samples at which SampleCounter and Microseconds contradict each other, within a second."""
        self.contradictions = 0
        """Samples that came once more with another content."""
        self.invalid_displacements = 0
        self.latest: Stamped | None = None
        """The newest sample."""
        self.status: Status | None = None
        self.setpoint_errors = 0
        """Statuses that report setpoint frames which failed their check."""

        self.fault = ''
        """Why the coil is off for as long as this link lasts; empty while it may be on."""
        self.needs_initialisation = False
        """Whether nothing but a new initialisation is needed to end the fault."""
        self.foreign_writer = False
        """Whether the fault is another node that publishes setpoints."""
        self.held = ''
        """Why every answer is lowered to 0 A at present; empty while none is."""
        self.double_answer = ''
        """Which sample was answered differently by two senders; empty while none was for certain."""
        self.current_limit = codec.current.high
        """What the coil may carry at present, A."""
        self.setpoints = 0
        """Setpoints that were let through."""
        self.limited = 0
        """Of these, limited to the greatest current."""
        self.derated = 0
        """Of these, limited further because the coil is warm."""
        self.refusals = dict.fromkeys(Refusal, 0)
        self.last_refusal: Refusal | None = None
        self.timeouts = 0
        """Times that the answered sample became older than the timeout before the next answer."""
        self.late_setpoints = 0
        """Setpoints refused for their age, and times that one of the two watches went to 0 A without any."""

        self._highest_current = codec.current.high
        self._timeout = setpoint_timeout_ns
        self._sample_time_us = sample_time_ns // 1000
        self._samples: dict[int, tuple[int, int]] = {}  # stamp -> SampleCounter and arrival, oldest first
        self._answered_stamp = -1
        self._answered_current = 0.0  # A, as it was asked for
        self._answered_twice: deque[int] = deque(maxlen=_DOUBLE_ANSWERS)  # stamps of such samples
        # No sample of the first minute bears this number: 0 A sent before any answer answers nothing.
        self._last_setpoint = Setpoint(0.0, _COUNTER_MASK, False)
        self._off_at: int | None = None  # time after which 0 A is due; the watch begins with its first look

    # From the electronics.

    def take(self, frame: bytes | bytearray, received: int) -> Stamped | None:
        """Return the sample of a frame with its stamp if it is a new one, else None: see `arrival`.

        `received` is the time of the frame on the steady clock.
        """
        sample = self.samples.receive(frame)
        arrival = self._arrival_of_none() if sample is None else self._order(sample)
        self.arrival = arrival
        self.arrivals[arrival] += 1
        if arrival is not Arrival.NEW or sample is None:
            return None
        if sample.displacement != sample.displacement:
            self.invalid_displacements += 1
        self._note_watch(sample)
        stamp = self.clock.stamp(sample.microseconds, received)
        if len(self._samples) == _REMEMBERED:
            del self._samples[next(iter(self._samples))]
        self._samples[stamp] = sample.sample_counter, self.clock.now(received)
        self.latest = Stamped(stamp, sample)
        return self.latest

    def take_status(self, data: bytes | bytearray) -> Status | None:
        """Keep the status of a frame if it is sound, and return it; else None."""
        status = self.statuses.receive(data)
        if status is not None:
            self.status = status
            self.setpoint_errors += status.e2e_error
        return status

    # To the electronics.

    def answer(self, stamp: int, current: float, now: int) -> Setpoint | None:
        """Return the setpoint that answers the sample of `stamp` (ns), or None: see `last_refusal`.

        `current` in A; above the limit of 3 A it is limited.
        """
        sample = self._samples.get(stamp)
        if sample is None:
            self.refuse(Refusal.UNKNOWN_SAMPLE)
            return None
        counter, arrival = sample
        if stamp == self._answered_stamp:
            self._compare(stamp, current)
        reason = self._objection(stamp, current, now - arrival)
        if reason is not None:
            self.refuse(reason)
            return None
        self._answered_stamp, self._answered_current = stamp, current
        if current > self._highest_current:
            self.limited += 1
            current = self._highest_current
        if current > self.current_limit:
            self.derated += 1
            current = self.current_limit
        if self.held:
            current = 0.0
        self.setpoints += 1
        self._off_at = arrival + self._timeout
        self._last_setpoint = Setpoint(current, counter, True)
        return self._last_setpoint

    def refuse(self, reason: Refusal) -> None:
        """Count a setpoint that is not sent."""
        self.refusals[reason] += 1
        self.late_setpoints += reason in _LATE
        self.last_refusal = reason

    @property
    def nameless(self) -> bool:
        """Whether the fault tells of two answers to a sample, but not who gives the other."""
        return bool(self.fault) and self.fault == self.double_answer

    def switch_off(
        self, fault: str, needs_initialisation: bool = False, foreign_writer: bool = False
    ) -> Setpoint:
        """Refuse all setpoints from now on; return the one that switches the coil off."""
        self.fault, self.needs_initialisation = fault, needs_initialisation
        self.foreign_writer = foreign_writer
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
            self.timeouts += 1
            self.late_setpoints += 1
        self._off_at = now + self._timeout
        return True

    @property
    def driving(self) -> bool:
        """Whether the last frame to the electronics was a setpoint and not 0 A from here."""
        return self._last_setpoint.enable

    def _objection(self, stamp: int, current: float, age: int) -> Refusal | None:
        if self.fault:
            return Refusal.SWITCHED_OFF
        if current != current:
            return Refusal.NOT_A_NUMBER
        if current < 0.0:
            return Refusal.NEGATIVE
        if age > self._timeout:
            return Refusal.STALE
        if stamp < self._answered_stamp:
            return Refusal.SUPERSEDED
        # 0 A may be repeated: a node that ends sends it for the sample that it has answered.
        if stamp == self._answered_stamp and current > 0.0 and current >= self._last_setpoint.current:
            return Refusal.NOT_LOWER
        return None

    def _note_watch(self, sample: Measurement) -> None:
        """Count it when the electronics' own watch has gone to 0 A although setpoints leave."""
        before = self.latest is not None and self.latest.sample.setpoint_timeout
        self.late_setpoints += self._last_setpoint.enable and sample.setpoint_timeout and not before

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

    def _arrival_of_none(self) -> Arrival:
        return Arrival.CORRUPT if self.samples.outcome >= Outcome.WRONG_CRC else Arrival.DISORDERED

    def _order(self, sample: Measurement) -> Arrival:
        if self.latest is None:
            return Arrival.NEW
        last = self.latest.sample
        step = (sample.sample_counter - last.sample_counter) & _COUNTER_MASK
        step_us = (sample.microseconds - last.microseconds) & _MICROSECOND_MASK
        if step == 1 and 0 < step_us < _DISAGREEMENT_US:
            return Arrival.NEW
        if step == 0 and step_us == 0:
            self.contradictions += sample[:_MEASURED] != last[:_MEASURED]
            return Arrival.RESENT
        back_us = _MICROSECOND_MASK + 1 - step_us
        if back_us < _LATE_US and _COUNTER_MASK + 1 - step <= _REMEMBERED:
            return Arrival.LATE
        # Behind a restart or a pause the counters say nothing: the clock counts it, once.
        if step_us < _LATE_US and not self._agree(step, step_us):
            self.jumps += 1
        # Nor were more samples taken than there was time for.
        if step > 1 and (step - _SLACK) * self._sample_time_us <= step_us < _LATE_US:
            self.lost += step - 1
        return Arrival.NEW

    def _agree(self, step: int, step_us: int) -> bool:
        """Whether so many samples fit into so many microseconds; neither counter may stand still alone."""
        return step > 0 and step_us > 0 and abs(step_us - step * self._sample_time_us) < _DISAGREEMENT_US
