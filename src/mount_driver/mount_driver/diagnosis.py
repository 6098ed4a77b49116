"""The verdict on the link, from what was counted now and some seconds ago.

No sentence holds a number that goes on changing while what it tells of stands; such numbers are figures.
"""

from typing import NamedTuple

from mount_driver.parameters import DriverParameters
from mount_driver.snapshot import Snapshot
from mount_driver.watches.ripple_watch import RippleFigures
from mount_models.sampling import HIGHEST_CURRENT, SETPOINT_TIMEOUT
from mount_ros.nodes.diagnostics import WINDOW, Finding, Level, SlidingWindow, Verdict, verdict_on

_SECOND = 1.0  # s, chosen: what comes at 10 Hz and more has come within it, or does no more


class Past(NamedTuple):
    """What was known of the link a window ago, and a second ago."""

    window: Snapshot
    second: Snapshot


class LinkWatch:
    """Keeps the snapshots of the last seconds."""

    def __init__(self) -> None:
        self._window, self._second = SlidingWindow(Snapshot()), SlidingWindow(Snapshot(), _SECOND)

    def past(self, now: Snapshot) -> Past:
        """Note `now` and return what was known earlier, in the beginning nothing."""
        return Past(self._window.earlier(now.time, now), self._second.earlier(now.time, now))


def judge(
    now: Snapshot, past: Past, parameters: DriverParameters, *, lockstep: bool, name_awaited: bool = False
) -> Verdict:
    """Return the verdict: the gravest finding speaks, all figures follow.

    With `name_awaited`, discovery may soon name the other sender that a fault tells of: nothing ends before.
    """
    where, earlier = f'{parameters.interface} {parameters.channel}', past.window
    found = (
        *_bus_findings(now, where, parameters),
        *_safety_findings(now),
        *(() if lockstep else _silence_findings(now, where, parameters)),
        *_setpoint_findings(now, past.second, parameters),
        *_status_findings(now, earlier, parameters),
        *_heat_findings(now, parameters),
        *_ripple_findings(now),
        *_sample_findings(now, earlier, parameters),
        *_frame_findings(now, earlier),
        *_refusal_findings(now, earlier),
    )
    figures = _figures(now, earlier, parameters)
    # At 0 A a graph in real time goes on beside another writer; in lock-step nobody answers any more.
    figures['fatal'] = figures['fatal'] and not name_awaited and (lockstep or not now.foreign_writer)
    return verdict_on(found, 'link to the electronics is up', figures)


Findings = list[Finding]


def _bus_findings(now: Snapshot, where: str, parameters: DriverParameters) -> Findings:
    if now.failure:
        return [Finding(Level.ERROR, 'failure', f'driver has stopped at 0 A: {now.failure}')]
    if now.trouble:
        wait = f'trying again for {parameters.recovery_time:g} s'
        text = f'CAN bus lost: {now.trouble}; setpoints are dropped, {wait}'
        return [Finding(Level.ERROR, 'bus lost', text)]
    if now.bus_off:
        remedy = 'check wiring, termination and bit rates; `ip link set <channel> type can restart-ms 100`'
        return [Finding(Level.ERROR, 'bus off', f'{where} is bus off: setpoints are dropped; {remedy}')]
    return []


def _safety_findings(now: Snapshot) -> Findings:
    if now.fault:
        again = 'then activate mount_driver, mount_init and mount_control again'
        text = f'{now.fault}, {again}{_other_sender(now)}'
        return [Finding(Level.ERROR, text, f'coil switched off: {text}')]
    text = f'coil at 0 A while this lasts: {now.held}'
    return [Finding(Level.ERROR, now.held, text)] if now.held else []


def _other_sender(now: Snapshot) -> str:
    if not now.other_senders:
        return ''
    return '; it still sends' if now.other_sender_age <= _SECOND else f'; silent for more than {_SECOND:g} s'


def _silence_findings(now: Snapshot, where: str, parameters: DriverParameters) -> Findings:
    if now.frame_age <= parameters.frame_timeout:
        return []
    silent = f'more than {1e3 * parameters.frame_timeout:g} ms'
    remedy = f'are the electronics powered, is {where} up?'
    return [Finding(Level.ERROR, 'silence', f'no frames from the electronics for {silent}; {remedy}')]


def _setpoint_findings(now: Snapshot, before: Snapshot, parameters: DriverParameters) -> Findings:
    found: Findings = []
    if now.setpoints and not now.driving:
        limit = f'{1e3 * parameters.setpoint_timeout:g} ms'
        text = f'coil at 0 A: no setpoint for {limit}; is mount_control active?'
        found.append(Finding(Level.WARN, 'no setpoint', text))
    if now.driving and before.driving and now.unheard and before.unheard:
        limit = f'{1e3 * SETPOINT_TIMEOUT:g} ms'
        text = f'the electronics do not take the setpoints: none in time for {limit}, by their status'
        found.append(Finding(Level.WARN, 'unheard', f'{text}; check the bus'))
    return found


def _status_findings(now: Snapshot, earlier: Snapshot, parameters: DriverParameters) -> Findings:
    status = now.status
    if status is None:
        return []
    found: Findings = []
    if now.setpoint_errors > earlier.setpoint_errors:
        text = 'the electronics report setpoint frames that were damaged, repeated or of wrong sequence'
        remedy = 'they do not use them: check the bus, does another node send?'
        found.append(Finding(Level.WARN, 'setpoint errors', f'{text}; {remedy}'))
    limit = parameters.temperature_warning_celsius
    if status.coil_temperature_celsius > limit:
        text = f'coil temperature ({status.coil_temperature_celsius:.1f} degC) is above {limit:g} degC'
        found.append(Finding(Level.WARN, 'temperature', f'{text}; lower the current or cool the mount'))
    return found


def _heat_findings(now: Snapshot, parameters: DriverParameters) -> Findings:
    heating = parameters.heating
    if now.current_limit == HIGHEST_CURRENT:
        return []
    if not now.celsius_known:
        text = 'what the coil has carried before is not known, nor its temperature, so it counts as'
        limit = f'{heating.derating_celsius:g} degC or more and is let less current until it has cooled'
        return [Finding(Level.WARN, 'heat', f'{text} {limit}; report coil_temperature in MountStatus')]
    text = f'coil above {heating.derating_celsius:g} degC by the thermal model: the hotter, the less current'
    limit = f'it is let, 0 A at {heating.limit_celsius:g} degC'
    return [Finding(Level.WARN, 'heat', f'{text} {limit}; damp less or cool the mount')]


def _ripple_findings(now: Snapshot) -> Findings:
    warning = now.ripple_warning
    # Its first words say which it is, the value stands in the figures.
    return [Finding(Level.WARN, ' '.join(warning.split()[:2]), warning)] if warning else []


def _sample_findings(now: Snapshot, earlier: Snapshot, parameters: DriverParameters) -> Findings:
    samples = now.samples - earlier.samples
    lost, corrupt = now.lost - earlier.lost, now.corrupt - earlier.corrupt
    invalid = now.invalid_displacements - earlier.invalid_displacements
    found: Findings = []
    share = (lost + corrupt) / max(samples + lost + corrupt, 1)
    if share > parameters.loss_warning:
        text = f'{lost} samples lost and {corrupt} frames corrupt'
        limit = f'{100 * share:.2f} %, limit {100 * parameters.loss_warning:g} % of {WINDOW:g} s'
        remedy = 'check wiring, bus load and load of this machine'
        found.append(Finding(Level.WARN, 'loss', f'{text} ({limit}); {remedy}'))
    if invalid:
        text = f'displacement not valid in {invalid} samples (limit: none in {WINDOW:g} s)'
        found.append(Finding(Level.WARN, 'invalid', f'{text}; check the displacement sensor'))
    if now.gaps > earlier.gaps:
        text = 'the electronics sent no samples for more than 1 s'
        remedy = 'check their supply and the bus, activate the graph again'
        found.append(Finding(Level.WARN, 'gap', f'{text}; {remedy}'))
    return found


def _frame_findings(now: Snapshot, earlier: Snapshot) -> Findings:
    """Return what is wrong with single frames; none is the limit."""
    found: Findings = []
    limit = f'limit: none in {WINDOW:g} s'
    repeated, disordered = now.repeated - earlier.repeated, now.wrong_sequence - earlier.wrong_sequence
    if repeated or disordered:
        text = f'{repeated} frames repeated and {disordered} of wrong sequence ({limit}), not used'
        remedy = 'did the electronics restart, does another node send theirs?'
        found.append(Finding(Level.WARN, 'sequence', f'{text}; {remedy}'))
    unreadable = now.unreadable - earlier.unreadable
    if unreadable:
        text = f'{unreadable} frames could not be read ({limit}; the last for {now.unreadable_reason:.100})'
        remedy = 'not used; does another program send on this bus?'
        found.append(Finding(Level.WARN, 'unreadable', f'{text}, {remedy}'))
    unsent = now.unsent - earlier.unsent
    if unsent:
        text = f'{unsent} setpoint frames were not taken by the bus ({limit}; {now.unsent_reason})'
        found.append(Finding(Level.WARN, 'unsent', f'{text}; does another node acknowledge?'))
    return found


def _refusal_findings(now: Snapshot, earlier: Snapshot) -> Findings:
    found: Findings = []
    limit = f'limit: none in {WINDOW:g} s'
    refused, limited = now.refused - earlier.refused, now.limited - earlier.limited
    if refused and now.last_refusal is not None:
        text = f'{refused} setpoints refused ({limit}), the last because {now.last_refusal.value}'
        found.append(Finding(Level.WARN, 'refused', f'{text}; look at what publishes current_setpoint'))
    if limited:
        text = f'{limited} setpoints limited to {HIGHEST_CURRENT:g} A ({limit})'
        found.append(Finding(Level.WARN, 'limited', f'{text}; look at what publishes current_setpoint'))
    return found


_RECENT = (
    'samples', 'lost', 'corrupt', 'repeated', 'wrong_sequence', 'invalid_displacements', 'refused', 'limited',
    'unreadable', 'unsent',
)  # fmt: skip
"""What is told of the window, too."""


def _figures(now: Snapshot, earlier: Snapshot, parameters: DriverParameters) -> dict[str, object]:
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
        'late_setpoints': now.late_setpoints,
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
        'coil_model_known': now.celsius_known,
        'current_limit': round(now.current_limit, 3),
        'derated': now.derated,
        **{f'recent.{name}': getattr(now, name) - getattr(earlier, name) for name in _RECENT},
    }
    if now.ripple is not None:
        figures |= _ripple_figures(now.ripple)
    if now.status is not None:
        figures['supply_voltage'] = now.status.supply_voltage
        figures['coil_temperature_celsius'] = now.status.coil_temperature_celsius
    return figures


def _ripple_figures(ripple: RippleFigures) -> dict[str, object]:
    return {
        'ripple_gap_um': round(1e6 * ripple.gap, 1),
        'ripple_gap_change_um': round(1e6 * ripple.gap_change, 1),
        'ripple_noise': round(ripple.noise, 4),
        'ripple_voltage': round(ripple.voltage, 2),
    }
