"""The verdict on the link, from what was counted in all and lately.

No sentence holds a number that goes on changing while its finding stands; such numbers are figures.
"""

from dataclasses import asdict, astuple

from mount_driver.exchange import Exchange
from mount_driver.link import Counts, Link
from mount_driver.parameters import DriverParameters
from mount_driver.watches.guard import Guard
from mount_models.sampling import HIGHEST_CURRENT, SETPOINT_TIMEOUT
from mount_ros.nodes.diagnostics import Finding, Level, Verdict, verdict_on
from mount_ros.nodes.sliding_window import WINDOW, SlidingWindow

_SECOND = 1.0  # s, chosen: what comes at 10 Hz and more has come within it, or does no more
_NONE = f'limit: none in {WINDOW:g} s'

Findings = list[Finding]


class Health:
    """Judges an exchange again and again; lives as long as an activation, which began at `started` (ns)."""

    def __init__(self, exchange: Exchange, parameters: DriverParameters, started: int, *, lockstep: bool):
        self._exchange, self._parameters = exchange, parameters
        self._started, self._lockstep = started, lockstep
        self._counts = SlidingWindow(Counts())
        self._unheard = SlidingWindow(False, _SECOND)

    def judge(self, now: int, *, name_awaited: bool = False) -> Verdict:
        """Return the verdict at `now` (steady clock, ns): the gravest finding speaks, all figures follow.

        With `name_awaited`, discovery may soon name the other sender of a fault: nothing ends before.
        """
        exchange, parameters = self._exchange, self._parameters
        link, guard, counts, seconds = exchange.link, exchange.guard, exchange.counts(), 1e-9 * now
        recent = _difference(counts, self._counts.earlier(seconds, counts))
        frame_age = 1e-9 * (now - (exchange.last_received or self._started))
        latest = link.latest
        unheard = link.driving and latest is not None and latest.sample.setpoint_timeout
        long_unheard = self._unheard.earlier(seconds, unheard) and unheard
        found = (
            *_bus_findings(exchange, parameters),
            *_safety_findings(exchange, now),
            *([] if self._lockstep else _silence_findings(frame_age, parameters)),
            *_setpoint_findings(link, long_unheard, parameters),
            *_status_findings(link, recent, parameters),
            *_heat_findings(guard, parameters),
            *_ripple_findings(guard),
            *_sample_findings(recent, parameters),
            *_frame_findings(recent, exchange),
            *_refusal_findings(recent, link),
        )
        # At 0 A a graph in real time goes on beside another writer; in lock-step nobody answers any more.
        fatal = link.fault and not link.needs_initialisation and not name_awaited
        figures = _figures(exchange, counts, recent) | {
            'sample_rate': parameters.sample_rate,
            'frame_age_s': round(frame_age, 4),
            'fatal': bool(fatal and (self._lockstep or not link.foreign_writer)),
        }
        return verdict_on(found, 'link to the electronics is up', figures)


def _difference(counts: Counts, earlier: Counts) -> Counts:
    return Counts(*(now - before for now, before in zip(astuple(counts), astuple(earlier), strict=True)))


def _where(parameters: DriverParameters) -> str:
    return f'{parameters.interface} {parameters.channel}'


def _bus_findings(exchange: Exchange, parameters: DriverParameters) -> Findings:
    if exchange.failure:
        return [Finding(Level.ERROR, 'failure', f'driver has stopped at 0 A: {exchange.failure}')]
    if exchange.trouble:
        wait = f'trying again for {parameters.recovery_time:g} s'
        text = f'CAN bus lost: {exchange.trouble}; setpoints are dropped, {wait}'
        return [Finding(Level.ERROR, 'bus lost', text)]
    if exchange.bus_off:
        remedy = 'check wiring, termination and bit rates; `ip link set <channel> type can restart-ms 100`'
        text = f'{_where(parameters)} is bus off: setpoints are dropped; {remedy}'
        return [Finding(Level.ERROR, 'bus off', text)]
    return []


def _safety_findings(exchange: Exchange, now: int) -> Findings:
    fault, held = exchange.link.fault, exchange.judgement.held
    if fault:
        again = 'then activate mount_driver, mount_init and mount_control again'
        text = f'{fault}, {again}{_other_sender(exchange, now)}'
        return [Finding(Level.ERROR, text, f'coil switched off: {text}')]
    return [Finding(Level.ERROR, held, f'coil at 0 A while this lasts: {held}')] if held else []


def _other_sender(exchange: Exchange, now: int) -> str:
    seen = exchange.guard.other_sender_at
    if not exchange.guard.other_senders or seen is None:
        return ''
    age = 1e-9 * (exchange.link.clock.now(now) - seen)
    return '; it still sends' if age <= _SECOND else f'; silent for more than {_SECOND:g} s'


def _silence_findings(frame_age: float, parameters: DriverParameters) -> Findings:
    if frame_age <= parameters.frame_timeout:
        return []
    silent = f'more than {1e3 * parameters.frame_timeout:g} ms'
    remedy = f'are the electronics powered, is {_where(parameters)} up?'
    return [Finding(Level.ERROR, 'silence', f'no frames from the electronics for {silent}; {remedy}')]


def _setpoint_findings(link: Link, long_unheard: bool, parameters: DriverParameters) -> Findings:
    found: Findings = []
    if link.counts.setpoints and not link.driving:
        limit = f'{1e3 * parameters.setpoint_timeout:g} ms'
        text = f'coil at 0 A: no setpoint for {limit}; is mount_control active?'
        found.append(Finding(Level.WARN, 'no setpoint', text))
    if long_unheard:
        limit = f'{1e3 * SETPOINT_TIMEOUT:g} ms'
        text = f'the electronics do not take the setpoints: none in time for {limit}, by their status'
        found.append(Finding(Level.WARN, 'unheard', f'{text}; check the bus'))
    return found


def _status_findings(link: Link, recent: Counts, parameters: DriverParameters) -> Findings:
    found: Findings = []
    if recent.setpoint_errors:
        text = 'the electronics report setpoint frames that were damaged, repeated or of wrong sequence'
        remedy = 'they do not use them: check the bus, does another node send?'
        found.append(Finding(Level.WARN, 'setpoint errors', f'{text}; {remedy}'))
    limit = parameters.temperature_warning_celsius
    if link.status is not None and link.status.coil_temperature_celsius > limit:
        text = f'coil temperature ({link.status.coil_temperature_celsius:.1f} degC) is above {limit:g} degC'
        found.append(Finding(Level.WARN, 'temperature', f'{text}; lower the current or cool the mount'))
    return found


def _heat_findings(guard: Guard, parameters: DriverParameters) -> Findings:
    heating = parameters.heating
    if guard.heat.current_limit == HIGHEST_CURRENT:
        return []
    if not guard.heat.known:
        text = 'what the coil has carried before is not known, nor its temperature, so it counts as'
        limit = f'{heating.derating_celsius:g} degC or more and is let less current until it has cooled'
        return [Finding(Level.WARN, 'heat', f'{text} {limit}; report coil_temperature in MountStatus')]
    text = f'coil above {heating.derating_celsius:g} degC by the thermal model: the hotter, the less current'
    limit = f'it is let, 0 A at {heating.limit_celsius:g} degC'
    return [Finding(Level.WARN, 'heat', f'{text} {limit}; damp less or cool the mount')]


def _ripple_findings(guard: Guard) -> Findings:
    warning = guard.ripple.warning
    # Its first words say which it is, the value stands in the figures.
    return [Finding(Level.WARN, ' '.join(warning.split()[:2]), warning)] if warning else []


def _sample_findings(recent: Counts, parameters: DriverParameters) -> Findings:
    found: Findings = []
    missing = recent.lost + recent.corrupt
    share = missing / max(recent.samples + missing, 1)
    if share > parameters.loss_warning:
        text = f'{recent.lost} samples lost and {recent.corrupt} frames corrupt'
        limit = f'{100 * share:.2f} %, limit {100 * parameters.loss_warning:g} % of {WINDOW:g} s'
        remedy = 'check wiring, bus load and load of this machine'
        found.append(Finding(Level.WARN, 'loss', f'{text} ({limit}); {remedy}'))
    if recent.invalid_displacements:
        text = f'displacement not valid in {recent.invalid_displacements} samples ({_NONE})'
        found.append(Finding(Level.WARN, 'invalid', f'{text}; check the displacement sensor'))
    if recent.gaps:
        text = 'the electronics sent no samples for more than 1 s'
        remedy = 'check their supply and the bus, activate the graph again'
        found.append(Finding(Level.WARN, 'gap', f'{text}; {remedy}'))
    return found


def _frame_findings(recent: Counts, exchange: Exchange) -> Findings:
    """Return what is wrong with single frames; none is the limit."""
    found: Findings = []
    if recent.repeated or recent.wrong_sequence:
        text = f'{recent.repeated} frames repeated and {recent.wrong_sequence} of wrong sequence ({_NONE})'
        remedy = 'not used; did the electronics restart, does another node send theirs?'
        found.append(Finding(Level.WARN, 'sequence', f'{text}, {remedy}'))
    if recent.unreadable:
        reason = f'{_NONE}; the last for {exchange.reception.reason:.100}'
        text = f'{recent.unreadable} frames could not be read ({reason})'
        remedy = 'not used; does another program send on this bus?'
        found.append(Finding(Level.WARN, 'unreadable', f'{text}, {remedy}'))
    if recent.unsent:
        text = (
            f'{recent.unsent} setpoint frames were not taken by the bus ({_NONE}; {exchange.unsent_reason})'
        )
        found.append(Finding(Level.WARN, 'unsent', f'{text}; does another node acknowledge?'))
    return found


def _refusal_findings(recent: Counts, link: Link) -> Findings:
    found: Findings = []
    if recent.refused and link.last_refusal is not None:
        text = f'{recent.refused} setpoints refused ({_NONE}), the last because {link.last_refusal.value}'
        found.append(Finding(Level.WARN, 'refused', f'{text}; look at what publishes current_setpoint'))
    if recent.limited:
        text = f'{recent.limited} setpoints limited to {HIGHEST_CURRENT:g} A ({_NONE})'
        found.append(Finding(Level.WARN, 'limited', f'{text}; look at what publishes current_setpoint'))
    return found


_RECENT = (
    'samples', 'lost', 'corrupt', 'repeated', 'wrong_sequence', 'invalid_displacements', 'refused', 'limited',
    'unreadable', 'unsent',
)  # fmt: skip
"""Counts that are figures for the window, too."""


def _figures(exchange: Exchange, counts: Counts, recent: Counts) -> dict[str, object]:
    link, heat, ripple = exchange.link, exchange.guard.heat, exchange.guard.ripple.figures
    figures: dict[str, object] = {
        'last_stamp': 0 if link.latest is None else link.latest.stamp,
        **asdict(counts),
        'switched_off': bool(link.fault),
        'held': bool(exchange.judgement.held),
        # A supervisor ends the graph on `fatal`, and initialises it anew on this one.
        'needs_initialisation': bool(link.fault) and link.needs_initialisation,
        'other_senders': exchange.guard.other_senders,
        'coil_model_celsius': round(heat.celsius, 1),
        'coil_model_known': heat.known,
        'current_limit': round(heat.current_limit, 3),
        **{f'recent.{name}': getattr(recent, name) for name in _RECENT},
        'ripple_gap_um': round(1e6 * ripple.gap, 1),
        'ripple_gap_change_um': round(1e6 * ripple.gap_change, 1),
        'ripple_noise': round(ripple.noise, 4),
        'ripple_voltage': round(ripple.voltage, 2),
    }
    if link.status is not None:
        figures['supply_voltage'] = link.status.supply_voltage
        figures['coil_temperature_celsius'] = link.status.coil_temperature_celsius
    return figures
