"""All watches of the link in one place: what they say of a sample, a status, a frame of another sender.

No bus here. Each judgement returns the `Fault` that takes the coil to 0 A, or None.
"""

from typing import NamedTuple

from mount_driver.clock import Clock
from mount_driver.codec import MountCodec, Setpoint, Status
from mount_driver.layout import MessageLayout
from mount_driver.link import Link, Stamped
from mount_driver.parameters import DriverParameters
from mount_driver.watches.coil_watch import CoilWatch
from mount_driver.watches.heat_watch import HeatWatch
from mount_driver.watches.rate_watch import RateWatch
from mount_driver.watches.ripple_law import RippleLaw
from mount_driver.watches.ripple_watch import RippleWatch
from mount_driver.watches.sender_watch import SenderWatch
from mount_driver.watches.status_watch import StatusWatch
from mount_models.sampling import sample_time_ns

_ALONE = 'take every node but the electronics that sends it off the bus'


class Fault(NamedTuple):
    """Why the coil is to be off until the driver is activated again."""

    sentence: str
    needs_initialisation: bool = False
    """Nothing else is needed: a graph may do it by itself."""
    foreign_writer: bool = False
    """Another node publishes setpoints: the graph goes on at 0 A, and records, until a user has ended it."""


class Guard:
    """Judges what comes and remembers what was sent; lives as long as an activation."""

    def __init__(
        self,
        parameters: DriverParameters,
        codec: MountCodec,
        clock: Clock,
        link: Link,
        heat: HeatWatch,
        law: RippleLaw,
    ):
        self.foreign_setpoints = 0
        """Sound setpoint frames of another sender."""
        self.writer_doubt = ''
        """Why another node may publish setpoints, so that answers are 0 A; empty where none may."""
        self.heat = heat
        self.ripple = RippleWatch(parameters.ripple, law, parameters.heating)
        self._link, self._clock = link, clock
        self._coil = CoilWatch(parameters.coil, sample_time_ns(parameters.sample_rate))
        self._rate = RateWatch(parameters.sample_rate)
        self._health = StatusWatch(parameters.status)
        self._samples = SenderWatch(parameters.senders, codec.measurement.name, _ALONE)
        self._statuses = SenderWatch(parameters.senders, codec.status.name, _ALONE)
        self._setpoints: MessageLayout = codec.setpoint
        self._foreign_at: int | None = None
        self._sent = 0.0
        self._breaks = 0
        heat.begin()

    @property
    def other_senders(self) -> int:
        """Return how many frames came that our electronics and we did not send."""
        link = self._link
        return self.foreign_setpoints + _strangers(link) + link.statuses.strangers

    @property
    def other_sender_at(self) -> int | None:
        """Return when the last of them came (ns), None where none has."""
        times = (self._foreign_at, self._samples.last, self._statuses.last)
        return max((time for time in times if time is not None), default=None)

    def note_sent(self, setpoint: Setpoint) -> None:
        """Take a setpoint that leaves; one thread at a time."""
        self._sent = setpoint.current
        self._coil.note_sent(setpoint)

    def judge_sample(self, stamped: Stamped, received: int) -> Fault | None:
        """Take a new sample and lower the link's limits as the watches say."""
        (stamp, sample), link, heat = stamped, self._link, self.heat
        now = self._clock.now(received)
        link.held = self._health.hold(now) or self.writer_doubt
        heat.take(stamp, sample.coil_current, self._sent)
        link.current_limit = heat.current_limit
        if link.jumps + self._clock.restarts != self._breaks:
            self._breaks = link.jumps + self._clock.restarts
            return Fault(self._restarted(), needs_initialisation=True)
        sentence = self._rate.judge(sample) or self._coil.judge(sample)
        sentence = sentence or self.ripple.judge(
            sample.coil_current, sample.current_rate, sample.flux_rate, sample.enabled, now
        )
        return Fault(sentence) if sentence else None

    def judge_frame(self, received: int) -> Fault | None:
        """Look at who sent a measurement frame that was not used, or a sample that came once more."""
        sentence = self._samples.judge(_strangers(self._link), self._clock.now(received))
        return Fault(sentence) if sentence else None

    def judge_status(self, status: Status | None, now: int) -> Fault | None:
        """Take a status, None where the frame was not used."""
        sentence = self._statuses.judge(self._link.statuses.strangers, now)
        if status is not None:
            self.heat.take_reported(status.coil_temperature_celsius)
            self.ripple.take_status(status.supply_voltage, status.coil_temperature_celsius)
            sentence = self._health.judge(status, now) or sentence
        return Fault(sentence) if sentence else None

    def judge_foreign(self, setpoint: Setpoint | None, now: int) -> Fault:
        """Take a sound setpoint frame that we have not sent; None where its current is beyond the limit."""
        self.foreign_setpoints += 1
        self._foreign_at = now
        wanted = 'a current beyond the limit' if setpoint is None else f'{setpoint.current:.3f} A'
        return Fault(
            f'another node sends {self._setpoints.name} ({wanted}; 1 frame, limit 0): '
            f'take it off the bus, only mount_driver may send it'
        )

    def _restarted(self) -> str:
        kind = 'contradict each other' if self._link.jumps else 'have jumped or begun anew, as at a restart'
        return f"the electronics' counters {kind} ({self._breaks} times, limit 0): check their supply"


def _strangers(link: Link) -> int:
    return link.samples.strangers + link.contradictions
