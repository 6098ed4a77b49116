"""The verdict on the link, from what was counted in all and lately.

No sentence holds a number that goes on changing while its finding stands; such numbers are figures.
"""

from collections.abc import Iterator
from dataclasses import asdict, astuple

from mount_driver.exchange import Exchange
from mount_driver.link import Counts
from mount_driver.parameters import DriverParameters
from mount_models.sampling import HIGHEST_CURRENT, SETPOINT_TIMEOUT
from mount_ros.nodes.diagnostics import WINDOW, Finding, Level, SlidingWindow, Verdict, verdict_on

_SECOND = 1.0  # s, chosen: what comes at 10 Hz and more has come within it, or does no more
_NONE = f'limit: none in {WINDOW:g} s'
_RECENT = (
    'samples', 'lost', 'corrupt', 'repeated', 'wrong_sequence', 'invalid_displacements', 'refused', 'limited',
    'unreadable', 'unsent',
)  # fmt: skip
"""Counts that are figures for the window, too."""


class Health:
    """Judges an exchange again and again; lives as long as an activation, which began at `started` (ns)."""

    def __init__(self, exchange: Exchange, parameters: DriverParameters, started: int, *, lockstep: bool):
        self._exchange, self._parameters = exchange, parameters
        self._started, self._lockstep = started, lockstep
        self._counts = SlidingWindow(Counts())
        self._unheard = SlidingWindow(False, _SECOND)

    def judge(self, now: int, *, name_awaited: bool = False) -> Verdict:
        """Return the verdict at `now` (steady clock, ns): the gravest finding and all figures.

        With `name_awaited`, discovery may soon name the other sender of a fault: nothing ends before.
        """
        exchange, link, seconds = self._exchange, self._exchange.link, 1e-9 * now
        counts = exchange.counts()
        earlier = self._counts.earlier(seconds, counts)
        recent = Counts(*(a - b for a, b in zip(astuple(counts), astuple(earlier), strict=True)))
        frame_age = 1e-9 * (now - (exchange.last_received or self._started))
        unheard = link.driving and link.latest is not None and link.latest.sample.setpoint_timeout
        was_unheard = self._unheard.earlier(seconds, unheard)
        errors = [Finding(Level.ERROR, *found) for found in self._errors(now, frame_age)]
        warnings = [Finding(Level.WARN, *found) for found in self._warnings(recent, unheard and was_unheard)]
        # At 0 A a graph in real time goes on beside another writer; in lock-step nobody answers any more.
        fatal = link.fault and not link.needs_initialisation and not name_awaited
        figures = self._figures(counts, recent) | {
            'frame_age_s': round(frame_age, 4),
            'fatal': bool(fatal and (self._lockstep or not link.foreign_writer)),
        }
        return verdict_on(errors + warnings, 'link to the electronics is up', figures)

    def _errors(self, now: int, frame_age: float) -> Iterator[tuple[str, str]]:
        """Yield key and sentence of each error."""
        exchange, link, p = self._exchange, self._exchange.link, self._parameters
        where, held = f'{p.interface} {p.channel}', exchange.guard.limits.held
        if exchange.failure:
            yield 'failure', f'driver has stopped at 0 A: {exchange.failure}'
        elif exchange.trouble:
            wait = f'trying again for {p.recovery_time:g} s'
            yield 'bus lost', f'CAN bus lost: {exchange.trouble}; setpoints are dropped, {wait}'
        elif exchange.bus_off:
            remedy = (
                'check wiring, termination and bit rates; `ip link set <channel> type can restart-ms 100`'
            )
            yield 'bus off', f'{where} is bus off: setpoints are dropped; {remedy}'
        if link.fault:
            again = 'then activate mount_driver, mount_init and mount_control again'
            text = f'{link.fault}, {again}{self._other_sender(now)}'
            yield text, f'coil switched off: {text}'
        elif held:
            yield held, f'coil at 0 A while this lasts: {held}'
        if frame_age > p.frame_timeout and not self._lockstep:
            limit = f'more than {1e3 * p.frame_timeout:g} ms'
            remedy = f'are the electronics powered, is {where} up?'
            yield 'silence', f'no frames from the electronics for {limit}; {remedy}'

    def _other_sender(self, now: int) -> str:
        seen = self._exchange.guard.other_sender_at
        if seen is None:
            return ''
        still = 1e-9 * (self._exchange.link.clock.now(now) - seen) <= _SECOND
        return '; it still sends' if still else f'; silent for more than {_SECOND:g} s'

    def _warnings(self, recent: Counts, unheard: bool) -> Iterator[tuple[str, str]]:
        """Yield key and sentence of each warning."""
        exchange, link, p = self._exchange, self._exchange.link, self._parameters
        status, heating, heat = link.status, p.heating, exchange.guard.heat
        if link.counts.setpoints and not link.driving:
            limit = f'{1e3 * p.setpoint_timeout:g} ms'
            yield 'no setpoint', f'coil at 0 A: no setpoint for {limit}; is mount_control active?'
        if unheard:
            limit = f'{1e3 * SETPOINT_TIMEOUT:g} ms, by their status; check the bus'
            yield 'unheard', f'the electronics do not take the setpoints: none in time for {limit}'
        if recent.setpoint_errors:
            text = 'the electronics report setpoint frames that were damaged, repeated or of wrong sequence'
            remedy = 'they do not use them: check the bus, does another node send?'
            yield 'setpoint errors', f'{text}; {remedy}'
        if status is not None and status.coil_temperature_celsius > p.temperature_warning_celsius:
            limit = f'{p.temperature_warning_celsius:g} degC; lower the current or cool the mount'
            yield (
                'temperature',
                f'coil temperature ({status.coil_temperature_celsius:.1f} degC) is above {limit}',
            )
        if heat.current_limit < HIGHEST_CURRENT and not heat.known:
            text = 'what the coil has carried before is not known, nor its temperature, so it counts as'
            limit = f'{heating.derating_celsius:g} degC or more and is let less current until it has cooled'
            yield 'heat', f'{text} {limit}; report coil_temperature in MountStatus'
        elif heat.current_limit < HIGHEST_CURRENT:
            text = f'coil above {heating.derating_celsius:g} degC by the thermal model'
            limit = f'the hotter, the less current it is let, 0 A at {heating.limit_celsius:g} degC'
            yield 'heat', f'{text}: {limit}; damp less or cool the mount'
        if warning := exchange.guard.ripple.warning:
            # Its first words are its key, the value stands in the figures.
            yield ' '.join(warning.split()[:2]), warning
        missing = recent.lost + recent.corrupt
        share = missing / max(recent.samples + missing, 1)
        if share > p.loss_warning:
            text = f'{recent.lost} samples lost and {recent.corrupt} frames corrupt'
            limit = f'{100 * share:.2f} %, limit {100 * p.loss_warning:g} % of {WINDOW:g} s'
            yield 'loss', f'{text} ({limit}); check wiring, bus load and load of this machine'
        if recent.invalid_displacements:
            text = f'displacement not valid in {recent.invalid_displacements} samples'
            yield 'invalid', f'{text} ({_NONE}); check the displacement sensor'
        if recent.gaps:
            remedy = 'check their supply and the bus, activate the graph again'
            yield 'gap', f'the electronics sent no samples for more than 1 s; {remedy}'
        if recent.repeated or recent.wrong_sequence:
            text = f'{recent.repeated} frames repeated and {recent.wrong_sequence} of wrong sequence'
            remedy = 'not used; did the electronics restart, does another node send theirs?'
            yield 'sequence', f'{text} ({_NONE}), {remedy}'
        if recent.unreadable:
            reason = f'the last for {exchange.reception.reason:.100}'
            text = f'{recent.unreadable} frames could not be read ({_NONE}; {reason})'
            yield 'unreadable', f'{text}, not used; does another program send on this bus?'
        if recent.unsent:
            text = f'{recent.unsent} setpoint frames were not taken by the bus'
            yield 'unsent', f'{text} ({_NONE}; {exchange.unsent_reason}); does another node acknowledge?'
        remedy = 'look at what publishes current_setpoint'
        if recent.refused and link.last_refusal is not None:
            text = f'{recent.refused} setpoints refused ({_NONE})'
            yield 'refused', f'{text}, the last because {link.last_refusal.value}; {remedy}'
        if recent.limited:
            text = f'{recent.limited} setpoints limited to {HIGHEST_CURRENT:g} A'
            yield 'limited', f'{text} ({_NONE}); {remedy}'

    def _figures(self, counts: Counts, recent: Counts) -> dict[str, object]:
        exchange, link = self._exchange, self._exchange.link
        heat, ripple = exchange.guard.heat, exchange.guard.ripple.figures
        figures: dict[str, object] = {
            'last_stamp': 0 if link.latest is None else link.latest.stamp,
            'sample_rate': self._parameters.sample_rate,
            **asdict(counts),
            'switched_off': bool(link.fault),
            'held': bool(exchange.guard.limits.held),
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
