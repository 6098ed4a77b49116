"""The verdict on the link, from what was counted now and a second ago."""

import math
from collections import deque
from typing import NamedTuple

from mount_driver.codec import Status
from mount_driver.e2e_receiver import Outcome
from mount_driver.exchange import Exchange
from mount_driver.link import Arrival, Refusal
from mount_driver.parameters import DriverParameters
from mount_models.sampling import HIGHEST_CURRENT, SETPOINT_TIMEOUT
from mount_ros.nodes.diagnostics import Level, Verdict

_PERIOD = 1.0  # s: rates are taken over this long


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
    needs_initialisation: bool = False  # and nothing else
    other_senders: int = 0  # frames that neither our electronics nor we have sent
    other_sender_age: float = math.inf  # s, since the last of them
    celsius: float = math.nan  # degC, the coil by the thermal model
    current_limit: float = HIGHEST_CURRENT  # A, what it may carry
    derated: int = 0  # setpoints that were lowered to that
    held: str = ''  # keeps it at 0 A at present
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
        needs_initialisation=link.needs_initialisation,
        other_senders=guard.other_senders,
        other_sender_age=math.inf if seen is None else (link.clock.now(now_ns) - seen) * 1e-9,
        celsius=guard.heat.celsius,
        current_limit=guard.heat.current_limit,
        derated=link.derated,
        held=link.held,
        status=link.status,
        setpoint_errors=link.setpoint_errors,
    )


class LinkWatch:
    """Keeps the snapshots of the last second."""

    def __init__(self) -> None:
        self._past: deque[Snapshot] = deque()

    def earlier(self, now: Snapshot) -> Snapshot:
        """Note `now` and return the snapshot of about a second ago, or the oldest there is."""
        self._past.append(now)
        while len(self._past) > 1 and now.time - self._past[1].time >= _PERIOD:
            self._past.popleft()
        return self._past[0]


def judge(now: Snapshot, earlier: Snapshot, parameters: DriverParameters, *, lockstep: bool) -> Verdict:
    """Return the verdict: the gravest finding speaks, all figures follow."""
    where = f'{parameters.interface} {parameters.channel}'
    for level, sentence in (
        *_bus_findings(now, where, parameters),
        *_safety_findings(now),
        *(() if lockstep else _silence_findings(now, where, parameters)),
        *_fault_findings(now, earlier, parameters),
        *_heat_findings(now, parameters),
        *_quality_findings(now, earlier, parameters),
        *_setpoint_findings(now, earlier, parameters),
    ):
        return Verdict(level, sentence, _figures(now, parameters))
    return Verdict(Level.OK, 'link to the electronics is up', _figures(now, parameters))


Findings = list[tuple[Level, str]]


def _bus_findings(now: Snapshot, where: str, parameters: DriverParameters) -> Findings:
    if now.failure:
        return [(Level.ERROR, f'driver has stopped at 0 A: {now.failure}')]
    if now.trouble:
        wait = f'trying again for {parameters.recovery_time:g} s'
        return [(Level.ERROR, f'CAN bus lost: {now.trouble}; setpoints are dropped, {wait}')]
    if now.bus_off:
        remedy = 'check wiring, termination and bit rates; `ip link set <channel> type can restart-ms 100`'
        return [(Level.ERROR, f'{where} is bus off: setpoints are dropped; {remedy}')]
    return []


def _safety_findings(now: Snapshot) -> Findings:
    if now.fault:
        again = 'then activate mount_driver, mount_init and mount_control again'
        return [(Level.ERROR, f'coil switched off: {now.fault}, {again}{_other_sender(now)}')]
    return [(Level.ERROR, f'coil at 0 A while this lasts: {now.held}')] if now.held else []


def _other_sender(now: Snapshot) -> str:
    if not now.other_senders:
        return ''
    return '; it still sends' if now.other_sender_age <= _PERIOD else f'; silent for more than {_PERIOD:g} s'


def _silence_findings(now: Snapshot, where: str, parameters: DriverParameters) -> Findings:
    if now.frame_age <= parameters.frame_timeout:
        return []
    # Whole seconds, so that the sentence does not change with every look.
    age = int(now.frame_age)
    silent = f'{age} s' if age else f'more than {1e3 * parameters.frame_timeout:g} ms'
    remedy = f'are the electronics powered, is {where} up?'
    return [(Level.ERROR, f'no frames from the electronics for {silent}; {remedy}')]


def _fault_findings(now: Snapshot, earlier: Snapshot, parameters: DriverParameters) -> Findings:
    status = now.status
    if status is None:
        return []
    found: Findings = []
    if now.setpoint_errors > earlier.setpoint_errors:
        text = 'the electronics report setpoint frames that were damaged, repeated or of wrong sequence'
        found.append((Level.WARN, f'{text}; they do not use them: check the bus, does another node send?'))
    limit = parameters.temperature_warning_celsius
    if status.coil_temperature_celsius > limit:
        text = f'coil temperature ({status.coil_temperature_celsius:.1f} degC) is above {limit:g} degC'
        found.append((Level.WARN, f'{text}; lower the current or cool the mount'))
    return found


def _heat_findings(now: Snapshot, parameters: DriverParameters) -> Findings:
    heating = parameters.heating
    if not now.celsius > heating.derating_celsius:
        return []
    # Rounded, so that the sentence does not change with every look.
    text = f'coil at about {now.celsius:.0f} degC by the thermal model: current limited to'
    limits = f'lowered from {heating.derating_celsius:g} degC on, 0 A at {heating.limit_celsius:g} degC'
    return [(Level.WARN, f'{text} {now.current_limit:.1f} A ({limits}); damp less or cool the mount')]


def _quality_findings(now: Snapshot, earlier: Snapshot, parameters: DriverParameters) -> Findings:
    samples = now.samples - earlier.samples
    lost, corrupt = now.lost - earlier.lost, now.corrupt - earlier.corrupt
    invalid = now.invalid_displacements - earlier.invalid_displacements
    found: Findings = []
    share = (lost + corrupt) / max(samples + lost + corrupt, 1)
    if share > parameters.loss_warning:
        text = f'{lost} samples lost and {corrupt} frames corrupt in the last second'
        limit = f'{100 * share:.2f} %, limit {100 * parameters.loss_warning:g} %'
        found.append((Level.WARN, f'{text} ({limit}); check wiring, bus load and load of this machine'))
    if invalid:
        text = f'displacement not valid in {invalid} samples of the last second'
        found.append((Level.WARN, f'{text}; check the displacement sensor'))
    if now.gaps > earlier.gaps:
        text = 'the electronics sent no samples for more than 1 s'
        found.append((Level.WARN, f'{text}; check their supply and the bus, activate the graph again'))
    repeated, disordered = now.repeated - earlier.repeated, now.wrong_sequence - earlier.wrong_sequence
    if repeated or disordered:
        text = f'{repeated} frames repeated and {disordered} of wrong sequence in the last second, not used'
        found.append((Level.WARN, f'{text}; did the electronics restart, does another node send theirs?'))
    if now.unreadable > earlier.unreadable:
        text = f'{now.unreadable - earlier.unreadable} frames of the last second could not be read'
        reason = f'the last for {now.unreadable_reason:.100}'
        found.append((Level.WARN, f'{text} ({reason}), not used; does another program send on this bus?'))
    if now.unsent > earlier.unsent:
        text = f'{now.unsent - earlier.unsent} setpoint frames were not taken by the bus in the last second'
        found.append((Level.WARN, f'{text} ({now.unsent_reason}); does another node acknowledge?'))
    return found


def _setpoint_findings(now: Snapshot, earlier: Snapshot, parameters: DriverParameters) -> Findings:
    found: Findings = []
    refused = now.refused - earlier.refused
    if refused and now.last_refusal is not None:
        text = f'{refused} setpoints refused in the last second'
        found.append((Level.WARN, f'{text}, the last because {now.last_refusal.value}'))
    if now.setpoints and not now.driving:
        limit = f'{1e3 * parameters.setpoint_timeout:g} ms'
        found.append((Level.WARN, f'coil at 0 A: no setpoint for {limit}; is mount_control active?'))
    if now.driving and earlier.driving and now.unheard and earlier.unheard:
        limit = f'{1e3 * SETPOINT_TIMEOUT:g} ms'
        text = f'the electronics do not take the setpoints: none in time for {limit}, by their status'
        found.append((Level.WARN, f'{text}; check the bus'))
    if now.limited > earlier.limited:
        text = (
            f'{now.limited - earlier.limited} setpoints limited to {HIGHEST_CURRENT:g} A in the last second'
        )
        found.append((Level.WARN, text))
    return found


def _figures(now: Snapshot, parameters: DriverParameters) -> dict[str, object]:
    figures: dict[str, object] = {
        'last_stamp': now.latest_stamp,
        'sample_rate': parameters.sample_rate,
        'frame_age_s': round(now.frame_age, 4),
        'samples': now.samples,
        'lost': now.lost,
        'corrupt': now.corrupt,
        'late': now.late,
        'resent': now.resent,
        'repeated': now.repeated,
        'wrong_sequence': now.wrong_sequence,
        'invalid_displacements': now.invalid_displacements,
        'setpoints': now.setpoints,
        'limited': now.limited,
        'refused': now.refused,
        'setpoint_timeouts': now.timeouts,
        'unsent': now.unsent,
        'restarts': now.restarts,
        'jumps': now.jumps,
        'gaps': now.gaps,
        'recoveries': now.recoveries,
        'error_frames': now.error_frames,
        'unreadable': now.unreadable,
        'switched_off': bool(now.fault),
        'held': bool(now.held),
        # A supervisor ends the graph on the one, and initialises it anew on the other.
        'fatal': bool(now.fault) and not now.needs_initialisation,
        'needs_initialisation': bool(now.fault) and now.needs_initialisation,
        'other_senders': now.other_senders,
        'coil_model_celsius': round(now.celsius, 1),
        'current_limit': round(now.current_limit, 3),
        'derated': now.derated,
    }
    if now.status is not None:
        figures['supply_voltage'] = now.status.supply_voltage
        figures['coil_temperature_celsius'] = now.status.coil_temperature_celsius
    return figures
