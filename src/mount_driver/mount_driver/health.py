"""The verdict on the link, from what was counted in all and lately.

No sentence holds a number that goes on changing while its finding stands; such numbers are figures.
"""

from collections.abc import Iterator
from dataclasses import asdict, astuple

from mount_driver.engine_speed import EngineSpeedReader
from mount_driver.exchange import Exchange
from mount_driver.link import Counts
from mount_driver.parameters import DriverParameters
from mount_models.sampling import HIGHEST_CURRENT, SETPOINT_TIMEOUT
from mount_ros.nodes.diagnostics import WINDOW, Finding, Level, SlidingWindow, Verdict, verdict_on

_SECOND = 1.0  # s, chosen: what comes at 10 Hz and more has come within it, or does no more
_SILENCE = 0.1  # s, chosen: without a frame for so long the link counts as dead
_LOSS = 0.001  # 1, chosen: share of lost or corrupt samples in 10 s that is warned of
_WARM = 120.0  # degC, chosen: reported coil temperature that is warned of
_NONE = f'limit: none in {WINDOW:g} s'


class Health:
    """Judges an exchange again and again; lives as long as an activation, which began at `started` (ns)."""

    def __init__(
        self,
        exchange: Exchange,
        parameters: DriverParameters,
        started: int,
        *,
        lockstep: bool,
        speed: EngineSpeedReader | None = None,
    ):
        self._exchange, self._parameters = exchange, parameters
        self._started, self._lockstep, self._speed = started, lockstep, speed
        self._counts = SlidingWindow(Counts())
        self._unheard = SlidingWindow(False, _SECOND)

    def judge(self, now: int) -> Verdict:
        """Return the verdict at `now` (steady clock, ns): the gravest finding and all figures."""
        exchange, link, seconds = self._exchange, self._exchange.link, 1e-9 * now
        counts = exchange.counts()
        earlier = self._counts.earlier(seconds, counts)
        recent = Counts(*(a - b for a, b in zip(astuple(counts), astuple(earlier), strict=True)))
        frame_age = 1e-9 * (now - (exchange.last_received or self._started))
        unheard = link.driving and link.latest is not None and link.latest.sample.setpoint_timeout
        was_unheard = self._unheard.earlier(seconds, unheard)
        findings = [Finding(Level.ERROR, *found) for found in self._errors(frame_age)]
        findings += [Finding(Level.WARN, *found) for found in self._warnings(recent, unheard and was_unheard)]
        if self._speed is not None and (trouble := self._speed.trouble(now)):
            findings.append(Finding(Level.WARN, 'engine speed', trouble))
        guard, status = exchange.guard, link.status
        # At 0 A a graph in real time goes on beside another writer; in lock-step nobody answers any more.
        fatal = link.fault and not link.needs_initialisation and (self._lockstep or not link.foreign_writer)
        figures = {
            'last_stamp': 0 if link.latest is None else link.latest.stamp,
            'sample_rate': self._parameters.sample_rate,
            **asdict(counts),
            'switched_off': bool(link.fault),
            'held': bool(guard.limits.held),
            # A supervisor ends the graph on `fatal`, and initialises it anew on this one.
            'needs_initialisation': bool(link.fault) and link.needs_initialisation,
            'coil_model_celsius': round(guard.heat.celsius, 1),
            'coil_model_known': guard.heat.known,
            'current_limit': round(guard.heat.current_limit, 3),
            'ripple_noise': round(guard.ripple.noise, 4),
            'ripple_voltage': round(guard.ripple.voltage, 2),
            'frame_age_s': round(frame_age, 4),
            'fatal': bool(fatal),
        }
        if status is not None:
            figures['supply_voltage'] = status.supply_voltage
            figures['coil_temperature_celsius'] = status.coil_temperature_celsius
        return verdict_on(findings, 'link to the electronics is up', figures)

    def _errors(self, frame_age: float) -> Iterator[tuple[str, str]]:
        """Yield key and sentence of each error."""
        exchange, link, p = self._exchange, self._exchange.link, self._parameters
        where, held = f'{p.interface} {p.channel}', exchange.guard.limits.held
        if exchange.failure:
            yield 'failure', f'driver has stopped at 0 A: {exchange.failure}'
        elif exchange.bus_off:
            yield (
                'bus off',
                f'{where} is bus off: setpoints are dropped; check wiring, termination and bit rates; '
                '`ip link set <channel> type can restart-ms 100`',
            )
        if link.fault:
            text = f'{link.fault}, then activate mount_driver, mount_init and mount_control again'
            yield text, f'coil switched off: {text}'
        elif held:
            yield held, f'coil at 0 A while this lasts: {held}'
        if frame_age > _SILENCE and not self._lockstep:
            yield (
                'silence',
                f'no frames from the electronics for more than {1e3 * _SILENCE:g} ms; are the electronics '
                f'powered, is {where} up?',
            )

    def _warnings(self, recent: Counts, unheard: bool) -> Iterator[tuple[str, str]]:
        """Yield key and sentence of each warning."""
        exchange, link, heating = self._exchange, self._exchange.link, self._parameters.heating
        status, heat = link.status, exchange.guard.heat
        if link.counts.setpoints and not link.driving:
            limit = f'{1e3 * SETPOINT_TIMEOUT:g} ms'
            yield 'no setpoint', f'coil at 0 A: no setpoint for {limit}; is mount_control active?'
        if status is not None and status.coil_temperature_celsius > _WARM:
            yield (
                'temperature',
                f'coil temperature ({status.coil_temperature_celsius:.1f} degC) is above {_WARM:g} degC; '
                'lower the current or cool the mount',
            )
        if heat.current_limit < HIGHEST_CURRENT:
            yield (
                'heat',
                f'coil above {heating.derating_celsius:g} degC by the thermal model: the hotter, the less '
                f'current it is let, 0 A at {heating.limit_celsius:g} degC; damp less or cool the mount'
                if heat.known
                else 'what the coil has carried before is not known, nor its temperature, so it counts as '
                f'{heating.derating_celsius:g} degC or more and is let less current until it has cooled; '
                'report coil_temperature in MountStatus',
            )
        missing = recent.lost + recent.corrupt
        share = missing / max(recent.samples + missing, 1)
        if share > _LOSS:
            yield (
                'loss',
                f'{recent.lost} samples lost and {recent.corrupt} frames corrupt ({100 * share:.2f} %, limit '
                f'{100 * _LOSS:g} % of {WINDOW:g} s); check wiring, bus load and load of this machine',
            )
        for key, found, sentence in (
            (
                'unheard',
                unheard,
                f'the electronics do not take the setpoints: none in time for {1e3 * SETPOINT_TIMEOUT:g} ms, '
                'by their status; check the bus',
            ),
            (
                'setpoint errors',
                recent.setpoint_errors,
                'the electronics report setpoint frames that were damaged, repeated or of wrong sequence; '
                'they do not use them: check the bus, does another node send?',
            ),
            (
                'invalid',
                recent.invalid_displacements,
                f'displacement not valid in {recent.invalid_displacements} samples ({_NONE}); check the '
                'displacement sensor',
            ),
            (
                'gap',
                recent.gaps,
                'the electronics sent no samples for more than 1 s; check their supply and the bus, activate '
                'the graph again',
            ),
            (
                'sequence',
                recent.repeated + recent.wrong_sequence,
                f'{recent.repeated} frames repeated and {recent.wrong_sequence} of wrong sequence ({_NONE}), '
                'not used; did the electronics restart, does another node send theirs?',
            ),
            (
                'unreadable',
                recent.unreadable,
                f'{recent.unreadable} frames could not be read ({_NONE}; the last for '
                f'{exchange.reception.reason:.100}), not used; does another program send on this bus?',
            ),
            (
                'unsent',
                recent.unsent,
                f'{recent.unsent} setpoint frames were not taken by the bus ({_NONE}; '
                f'{exchange.unsent_reason}); does another node acknowledge?',
            ),
            (
                'refused',
                recent.refused,
                f'{recent.refused} setpoints refused ({_NONE}), the last because '
                f'{link.last_refusal and link.last_refusal.value}; look at what publishes current_setpoint',
            ),
        ):
            if found:
                yield key, sentence
