"""The far end of the CAN bus: sends what the electronics measure, receives and judges setpoints."""

import math
import select
import time
from collections.abc import Iterator
from contextlib import suppress
from typing import NamedTuple

from mount_driver.bus import Frame, Reception, may_have_frames
from mount_driver.can_library import can
from mount_driver.can_messages import Measurement, OwnSetpoint, Setpoint, Status
from mount_driver.protocol import AliveCounter, E2EReceiver, mount_codec
from mount_driver.watches.message_watches import SenderWatch
from mount_models.sampling import SAMPLE_RATE, sample_time_ns
from mount_sim.electronics.electronics import Reading
from mount_sim.electronics.own_law import OwnLaw

_COUNTER_MASK = 0xFFFF
_MICROSECOND_MASK = 0xFFFFFFFF
_QUIET = 1_000_000_000  # ns, chosen: so long no second host may be heard before a current flows again
_CREDIBLE_AGE = 10.0  # s, chosen: a frame's time stamp that is farther from now is of another clock


_OFF = Setpoint(0.0, _COUNTER_MASK, enable=False)


class ReceivedSetpoint(NamedTuple):
    """A setpoint with the time of its arrival by the system clock (s), NaN where the bus does not tell it."""

    setpoint: Setpoint
    arrival: float

    def late(self, number: int) -> int:
        """Return how many samples too late it is for sample `number`, which takes it over; it may be off.

        0 for the answer to the sample before. One to a sample that is not yet taken is later than all others.
        """
        return (number - 1 - self.setpoint.answered_counter) & _COUNTER_MASK if self.setpoint.enable else 0


class CanEnd:
    """Electronics' side of `mount.dbc` on an open bus; a `law` of their own gets its table from there."""

    def __init__(self, bus: can.BusABC, sample_rate: float = SAMPLE_RATE, law: OwnLaw | None = None):
        self.law = law
        self._sample_time = sample_time_ns(sample_rate)
        self._bus = bus
        self._reception = Reception()
        self._codec = mount_codec()
        self.restart()

    def restart(self) -> None:
        """Count frames from 0, those that come too, as electronics do that were without power."""
        self._measurement_alive = AliveCounter()
        self._status_alive = AliveCounter()
        self._own_alive, self._points = AliveCounter(), E2EReceiver(self._codec.table_point)
        if self.law is not None:
            self.law.forget()
        self._receiver: E2EReceiver[Setpoint] = E2EReceiver(self._codec.setpoint)
        self._hosts = SenderWatch(self._codec.setpoint.name, 'one host only may send it')
        self._now = 0  # ns, by the samples
        self._off_until = 0

    @property
    def failed_setpoints(self) -> int:
        """Setpoint frames that failed their check and were not used: damaged, repeated, of wrong sequence."""
        return self._receiver.failed

    @property
    def contested(self) -> bool:
        """Whether more than one host sends setpoints, or did within the last second: the coil is at 0 A."""
        return self._now < self._off_until

    def measurement_frame(
        self, number: int, microseconds: int, reading: Reading, *, enabled: bool, unheard: bool = False
    ) -> can.Message:
        """Return the frame of sample `number`, taken at `microseconds` of the electronics' clock.

        `enabled`: the power stage is on; `unheard`: it is off because setpoints stopped.
        What lies beyond the limits of its signal, and so of its sensor, is sent as not valid.
        """
        codec = self._codec
        self._now = number * self._sample_time
        measurement = Measurement(
            number & _COUNTER_MASK,
            microseconds & _MICROSECOND_MASK,
            codec.displacement.within(reading.displacement),
            codec.coil_current.within(reading.coil_current),
            codec.current_rate.within(reading.current_rate),
            codec.flux_rate.within(reading.flux_rate),
            enabled=enabled,
            setpoint_timeout=unheard,
        )
        data = self._codec.encode_measurement(measurement, self._measurement_alive.next())
        return Frame(self._codec.measurement.frame_id, data)

    def status_frame(self, status: Status) -> can.Message:
        """Return the frame of the slow health message."""
        data = self._codec.encode_status(status, self._status_alive.next())
        return Frame(self._codec.status.frame_id, data)

    def own_frame(self, setpoint: OwnSetpoint) -> can.Message:
        """Return the frame of a setpoint of the electronics' own law."""
        layout = self._codec.own_setpoint
        return Frame(layout.frame_id, layout.pack((0, self._own_alive.next(), *setpoint)))

    def send_frame(self, frame: can.Message) -> None:
        """Send a frame as it is."""
        self._bus.send(frame)

    def answer_to(self, number: int) -> ReceivedSetpoint | None:
        """Return the setpoint that answers sample `number`, None if it has not come.

        A frame that switches off answers none, whatever number it carries.
        """
        counter = number & _COUNTER_MASK
        for received in self._received():
            if received.setpoint.enable and received.setpoint.answered_counter == counter:
                return received
        return None

    def wait_for_frame(self, limit: float) -> None:
        """Return when there is a frame to take, or after `limit` s; at once on a bus without a socket."""
        with suppress(NotImplementedError):
            select.select([self._bus], (), (), limit)

    def newest(self) -> ReceivedSetpoint | None:
        """Take all frames that have come since the last call and return the last sound setpoint in them."""
        received = list(self._received())
        return received[-1] if received else None

    def _received(self) -> Iterator[ReceivedSetpoint]:
        while may_have_frames(self._bus) and (frame := self._reception.frame(self._bus, 0.0)) is not None:
            if (received := self._setpoint_in(frame)) is not None:
                yield received

    def close(self) -> None:
        """End the bus; safe to call twice."""
        self._bus.shutdown()

    def _setpoint_in(self, frame: can.Message) -> ReceivedSetpoint | None:
        if frame.arbitration_id == self._codec.table_point.frame_id and self.law is not None:
            point = self._points.receive(frame.data)
            if point is not None:
                self.send_frame(self.own_frame(self.law.take_point(point)))
        if frame.arbitration_id != self._codec.setpoint.frame_id:
            return None
        setpoint = self._receiver.receive(frame.data)
        if self._hosts.judge(self._receiver.strangers, self._now):
            self._off_until = self._now + _QUIET
        if self.contested:
            return ReceivedSetpoint(_OFF, math.nan)
        if setpoint is None:
            return None
        credible = abs(time.time() - frame.timestamp) < _CREDIBLE_AGE
        return ReceivedSetpoint(setpoint, frame.timestamp if credible else math.nan)
