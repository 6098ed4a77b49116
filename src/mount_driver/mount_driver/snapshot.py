"""What is known of the link at one time: counts and states, from which the verdict is made."""

import math
from typing import NamedTuple

from mount_driver.codec import Status
from mount_driver.e2e_receiver import Outcome
from mount_driver.exchange import Exchange
from mount_driver.link import Arrival, Refusal
from mount_driver.watches.ripple_watch import RippleFigures
from mount_models.sampling import HIGHEST_CURRENT


class Snapshot(NamedTuple):
    """What is known of the link at one time; counts are since the activation."""

    time: float = 0.0  # s, steady clock
    frame_age: float = 0.0  # s since the last sound sample, or since the activation
    samples: int = 0
    lost: int = 0
    corrupt: int = 0
    late: int = 0
    resent: int = 0
    repeated: int = 0
    wrong_sequence: int = 0
    invalid_displacements: int = 0
    setpoints: int = 0
    limited: int = 0
    refused: int = 0
    timeouts: int = 0
    late_setpoints: int = 0  # refused for their age, or the cause that a watch went to 0 A
    unsent: int = 0
    unsent_reason: str = ''
    restarts: int = 0
    jumps: int = 0
    gaps: int = 0
    recoveries: int = 0
    error_frames: int = 0
    unreadable: int = 0  # frames and datagrams that no frame could be made of
    unreadable_reason: str = ''
    latest_stamp: int = 0  # ns
    last_refusal: Refusal | None = None
    driving: bool = False
    unheard: bool = False  # the electronics report that no setpoint reaches them
    bus_off: bool = False
    trouble: str = ''
    failure: str = ''
    fault: str = ''  # keeps the coil off until the next activation
    nameless: bool = False  # it tells of two answers to a sample, but not who gives the other
    needs_initialisation: bool = False  # and nothing else
    foreign_writer: bool = False  # the fault is another node that publishes setpoints
    other_senders: int = 0  # frames that neither our electronics nor we have sent
    other_sender_age: float = math.inf  # s, since the last of them
    celsius: float = math.nan  # degC, the coil by the thermal model
    celsius_known: bool = True  # and not the worst that may be
    current_limit: float = HIGHEST_CURRENT  # A, what it may carry
    derated: int = 0  # setpoints that were lowered to that
    held: str = ''  # keeps it at 0 A at present
    ripple: RippleFigures | None = None
    ripple_warning: str = ''
    status: Status | None = None
    setpoint_errors: int = 0  # statuses that report setpoint frames with a failed check


def snapshot(exchange: Exchange, now_ns: int, started_ns: int) -> Snapshot:
    """Return what `exchange` has counted; `now_ns` and `started_ns` are on the steady clock."""
    link, latest, guard = exchange.link, exchange.link.latest, exchange.guard
    seen = guard.other_sender_at
    return Snapshot(
        time=now_ns * 1e-9,
        frame_age=(now_ns - (exchange.last_received or started_ns)) * 1e-9,
        samples=link.arrivals[Arrival.NEW],
        lost=link.lost,
        corrupt=link.arrivals[Arrival.CORRUPT] + link.statuses.corrupt,
        late=link.arrivals[Arrival.LATE],
        resent=link.arrivals[Arrival.RESENT],
        repeated=link.samples.counts[Outcome.REPEATED] + link.statuses.counts[Outcome.REPEATED],
        wrong_sequence=(
            link.samples.counts[Outcome.WRONG_SEQUENCE] + link.statuses.counts[Outcome.WRONG_SEQUENCE]
        ),
        invalid_displacements=link.invalid_displacements,
        setpoints=link.setpoints,
        limited=link.limited,
        refused=sum(link.refusals.values()),
        timeouts=link.timeouts,
        late_setpoints=link.late_setpoints,
        unsent=exchange.unsent,
        unsent_reason=exchange.unsent_reason,
        restarts=link.clock.restarts,
        jumps=link.jumps,
        gaps=link.clock.gaps,
        recoveries=exchange.recoveries,
        error_frames=exchange.error_frames,
        unreadable=exchange.reception.unreadable,
        unreadable_reason=exchange.reception.reason,
        latest_stamp=latest.stamp if latest is not None else 0,
        last_refusal=link.last_refusal,
        driving=link.driving,
        unheard=latest is not None and latest.sample.setpoint_timeout,
        bus_off=exchange.bus_off,
        trouble=exchange.trouble,
        failure=exchange.failure,
        fault=link.fault,
        nameless=link.nameless,
        needs_initialisation=link.needs_initialisation,
        foreign_writer=link.foreign_writer,
        other_senders=guard.other_senders,
        other_sender_age=math.inf if seen is None else (link.clock.now(now_ns) - seen) * 1e-9,
        celsius=guard.heat.celsius,
        celsius_known=guard.heat.known,
        current_limit=guard.heat.current_limit,
        derated=link.derated,
        held=link.held,
        ripple=guard.ripple.figures,
        ripple_warning=guard.ripple.warning,
        status=link.status,
        setpoint_errors=link.setpoint_errors,
    )
