"""All watches of the link in one place: their verdicts on a sample, a status, a frame of another sender.

No bus here, and nothing is written to the link: each judgement is returned.
"""

from collections import deque

from mount_driver.can_messages import Setpoint, Status
from mount_driver.clock import Clock
from mount_driver.link import Fault, Limits, Link, Stamped
from mount_driver.parameters import DriverParameters
from mount_driver.protocol import MountCodec
from mount_driver.watches.coil_watch import CoilWatch
from mount_driver.watches.heat_watch import HeatWatch
from mount_driver.watches.message_watches import SenderWatch, StatusWatch
from mount_driver.watches.ripple_law import RippleLaw
from mount_driver.watches.ripple_watch import RippleWatch
from mount_models.sampling import sample_time_ns

_ALONE = 'take every node but the electronics that sends it off the bus'
_HEATING_STEP = 100_000_000  # ns, chosen: 10 times a second the model of the coil's temperature goes on
_NOTED = 256  # setpoints, chosen: between two samples there are a few; of more the oldest are forgotten
_new = tuple.__new__  # makes a named tuple without the call of a Python function


class Guard:
    """Judges what comes by what was sent; lives as long as an activation."""

    def __init__(
        self,
        parameters: DriverParameters,
        codec: MountCodec,
        clock: Clock,
        link: Link,
        heat: HeatWatch,
        law: RippleLaw,
    ):
        self.writer_doubt = ''
        """Why another node may publish setpoints, so that answers are 0 A; empty where none may."""
        self.limits = Limits()
        """What the watches allow since the last sample that they judged."""
        self.unjudged: tuple[Stamped, int] | None = None
        """The newest sample and when it came (ns), until it is judged."""
        self.sent: deque[Setpoint] = deque(maxlen=_NOTED)
        """The setpoints that have left since the last sample was judged."""
        self.heat = heat
        self.ripple = RippleWatch(parameters.ripple, law, parameters.heating)
        self._link, self._clock = link, clock
        self._coil = CoilWatch(parameters.coil, sample_time_ns(parameters.sample_rate))
        self._health = StatusWatch(parameters.status)
        self._samples = SenderWatch(codec.measurement.name, _ALONE)
        self._statuses = SenderWatch(codec.status.name, _ALONE)
        self._own_setpoints = SenderWatch(codec.own_setpoint.name, _ALONE)
        self._sent_last = 0.0  # A
        self._heating_since: int | None = None  # stamp from which the squares of the current are summed
        self._squares, self._summed = 0.0, 0
        self._breaks = 0
        heat.begin()

    def judge_sample(self) -> Fault | None:
        """Return what follows from the newest sample, which is then judged; `limits` change with it."""
        assert self.unjudged is not None
        ((stamp, sample), now), self.unjudged = self.unjudged, None
        heat, health, sent = self.heat, self._health, self.sent
        if sent:
            self._sent_last = sent[-1].current
        # The greater of measured and sent current heats, the sent one where the other is not valid (NaN).
        current, since = sample.coil_current, self._heating_since
        if not current > self._sent_last:
            current = self._sent_last
        self._squares += current * current
        self._summed += 1
        if since is None:
            self._heating_since = stamp
        elif stamp - since >= _HEATING_STEP:
            heat.warm(self._squares / self._summed, 1e-9 * (stamp - since))
            self._heating_since, self._squares, self._summed = stamp, 0.0, 0
        held = self.writer_doubt
        if health.valid_until is None or now > health.valid_until or health.sensor_fault:
            held = health.hold(now) or held
        self.limits = _new(Limits, (heat.current_limit, held))
        breaks = self._link.counts.jumps + self._clock.restarts
        if breaks != self._breaks:
            self._breaks = breaks
            jumped = self._link.counts.jumps
            kind = 'contradict each other' if jumped else 'have jumped or begun anew, as at a restart'
            return Fault(
                f"the electronics' counters {kind} ({breaks} times, limit 0): check their supply",
                needs_initialisation=True,
            )
        sentence = self._link.rate_objection or self._coil.judge(sample, sent)
        sent.clear()
        sentence = sentence or self.ripple.judge(
            sample.coil_current, sample.current_rate, sample.flux_rate, sample.enabled, now
        )
        return Fault(sentence) if sentence else None

    def judge_frame(self, received: int) -> Fault | None:
        """Return what follows from a measurement frame that was not used, or a sample that came once more."""
        link = self._link
        strangers = link.samples.strangers + link.contradictions
        sentence = self._samples.judge(strangers, self._clock.now(received))
        return Fault(sentence) if sentence else None

    def judge_own_setpoint(self, now: int) -> Fault | None:
        """Return what follows from a frame with a setpoint of the electronics' own law."""
        sentence = self._own_setpoints.judge(self._link.own_setpoints.strangers, now)
        return Fault(sentence) if sentence else None

    def judge_status(self, status: Status | None, now: int) -> Fault | None:
        """Return what follows from a status; None: the frame was not used."""
        sentence = self._statuses.judge(self._link.statuses.strangers, now)
        if status is not None:
            self.heat.take_reported(status.coil_temperature_celsius)
            self.ripple.take_status(status.supply_voltage, status.coil_temperature_celsius)
            sentence = self._health.judge(status, now) or sentence
        return Fault(sentence) if sentence else None

    def judge_foreign(self, setpoint: Setpoint | None) -> Fault:
        """Return what follows from a sound setpoint frame of another sender; None: it exceeds the limit."""
        wanted = 'a current beyond the limit' if setpoint is None else f'{setpoint.current:.3f} A'
        return Fault(
            f'another node sends MountSetpoint ({wanted}; 1 frame, limit 0): '
            f'take it off the bus, only mount_driver may send it'
        )
