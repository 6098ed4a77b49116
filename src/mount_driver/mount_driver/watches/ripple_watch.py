"""Whether coil and gap are what they were in the initialisation, by the coil ripple of every sample.

No bus and no clock here: times are ns by the clock that judges ages (`Clock.now`).

Two questions. Does the voltage that drives the ripple, N A dB/dt + R(T) i, agree with the supply that the
status reports? Other turns, another scale of dB/dt or none show at any current. And is the incremental
inductance L_i = N A (dB/dt) / (di/dt), Eq (5), at this current the one of the ramp (`ripple_sweep`)? There
the gap of every current passed by once; the means of the deviation, one for each 0.1 A, show a gap that has
changed.

What the gap does to L_i at a given current, with the shipped actuator: at 0.5 A a blocked gap lowers it by
7 %, missing pads by 60 %; at 1.4 A a blocked gap raises it by 30 %, one that is 30 um smaller lowers it by
10 %. Blind for a larger gap are 0.6 .. 1.0 A, where L_i over the gap has its top; for worn pads what lies
below 0.7 A; above 1.8 A, where the core is full, only missing pads show.

Noise: readings of 1 % (sigma) leave 0.18 % on a mean of 16 and 0.3 % with that of the reference. The limit of
5 % lies 16 sigma away, and 8 behind an error of temperature and supply of 2.5 %: 6e-16 for each mean, and so
less than one false alarm in 1e5 years. The mean shows a missing pad after 5 readings within 0.1 A and a
blocked gap after 10 to 25, which takes a damped engine 0.1 s at most. Reported is what lasts for `_DURATION`:
three statuses, as supply and temperature are that late.

Worn pads show between 0.75 A and the crossing, where an engine that is damped once for 0.1 s may come by only
once, with a few readings in each zone. There a mean over all currents joins them; after 48 readings it is
reported also if none comes again.
"""

from math import nan
from typing import Annotated, NamedTuple

from mount_driver.watches.ripple_law import DUTY_STEP, RippleLaw, skin_table, warmth
from mount_driver.watches.ripple_sweep import NODE, Reference, Sweep, objection
from mount_models.coil.copper import REFERENCE_CELSIUS, CoilHeating
from mount_models.quantity import Quantity

_SHARE = 1.0 / 16.0  # of a new reading in the means of voltage, validity and inductance, chosen
_NOISE_SHARE = 1.0 / 64.0  # in that of the scatter, chosen
_FARTHEST = 4.0  # in tolerances, chosen: so that one reading moves a mean by a quarter of it at most
_ODD = 0.5  # 1, chosen: no difference of two readings counts as more
_TO_STD = 0.886  # sqrt(pi) / 2: from the mean difference of two readings to their standard deviation, normal
_UNKNOWN_CELSIUS = 0.1  # 1, chosen: what 100 K do
_UNKNOWN_RESISTANCE = 0.4  # 1, chosen: likewise
_BLIND = 0.75  # A, chosen: up to here worn pads change L_i by less than 1 % for each 10 um
_NEAR = 0.2  # A, chosen: so near to the crossing a deviation is reported as a gap
_DURATION = 300_000_000  # ns, chosen: what deviates, scatters or is missing for so long is a fault
_PAUSE = 50_000_000  # ns, chosen: of a longer time without samples nothing is known
_SURE = 24  # readings: so many sound ones bring a mean of `_FARTHEST` back below 1
_CERTAIN = 48  # readings over the zones, chosen: enough without a later one, as an engine may be damped once
_JOINT = _ZONES = 32
_JUMP = 0.03  # 1, chosen: another 35 K from one status to the next; a coil takes a minute for it


class RippleWatchParameters(NamedTuple):
    """How far the ripple may lie from what ramp, specimen and supply let expect, and how long."""

    inductance_limit: Annotated[
        float, Quantity('1', 'greatest relative deviation of the inductance', 0.03, 0.5)
    ] = 0.05
    gap_limit: Annotated[
        float, Quantity('m', 'greatest change of the closed gap, 12 % of the force', 1e-5, 2e-4)
    ] = 30e-6
    voltage_limit: Annotated[
        float, Quantity('1', 'greatest relative deviation of the voltage', 0.05, 0.5)
    ] = 0.15
    noise_limit: Annotated[
        float, Quantity('1', 'greatest standard deviation of the inductance', 0.02, 0.5)
    ] = 0.05


class RippleWatch:
    """Takes what was measured, sample by sample; lives as long as an activation."""

    def __init__(self, parameters: RippleWatchParameters, law: RippleLaw, heating: CoilHeating):
        self._parameters, self._law, self._heating = parameters, law, heating
        self._turns_area = law.turns_area
        self._link_voltage, self._skin = law.bridge.link_voltage, skin_table(law)
        self._sweep = Sweep()
        self._reference: Reference | None = None
        self._means = [0.0] * (_ZONES + 1)  # of the deviations in tolerances, each of 0.1 A, and over zones
        self.noise = nan
        """Standard deviation of one reading of the inductance, 1; NaN before the ramp was seen."""
        self._last = 0.0
        self._beyond = [0] * (_ZONES + 1)  # readings of a zone since its mean has been beyond its limit
        self._beyond_since = [0] * (_ZONES + 1)  # ns
        self._joint_at = 0.0, 0.0, 0.0  # A, H, 1: current, expected inductance and tolerance
        self._cold = 1.0  # factor to the temperature of the calibration
        self.voltage = nan
        """Of the bridge by the ripple, V; NaN before the first reading."""
        self._missing = 0.0  # share
        self._judged = 0  # ns: when a sample came last
        self._finding, self._begun = '', 0  # what is wrong with the readings, and since when
        self.take_status(nan, nan)

    def take_status(self, supply: float, celsius: float) -> None:
        """Take supply (V) and coil temperature (degC) as reported; NaN where not known."""
        self._supply, heating = supply, self._heating
        known = celsius == celsius
        warmer = celsius - REFERENCE_CELSIUS if known else 0.0
        self._resistance = heating.resistance * (1.0 + heating.copper * warmer)
        self._unknown_resistance = 0.0 if known else _UNKNOWN_RESISTANCE * heating.resistance
        self._wider = 0.0 if known else _UNKNOWN_CELSIUS
        before, self._cold = self._cold, 1.0 / warmth(self._law, celsius)
        if abs(self._cold - before) > _JUMP * before:  # readings of before were carried wrongly
            self._means = [0.0] * (_ZONES + 1)
            self._beyond = [0] * (_ZONES + 1)

    def judge(self, current: float, current_rate: float, flux_rate: float, enabled: bool, now: int) -> str:
        """Return why the ripple does not fit, empty while it does or while that is not certain.

        Current (A), di/dt (A/s) and dB/dt (T/s) arrived at `now`; a bridge that is not `enabled` has no
        ripple.
        """
        elapsed, self._judged = now - self._judged, now
        if not enabled or elapsed > _PAUSE:
            self._begun += elapsed  # what was found neither lasts meanwhile nor is gone
        if not enabled:
            return ''
        flux_volts = self._turns_area * flux_rate
        valid = current_rate > 0.0 and flux_volts > 0.0 and current >= 0.0  # not so for NaN
        self._missing += _SHARE * ((0.0 if valid else 1.0) - self._missing)
        if valid:
            volts = flux_volts + self._resistance * current
            mean = self.voltage
            self.voltage = mean + _SHARE * (volts - mean) if mean == mean else volts
        # What is wrong with the readings at present, empty where nothing is.
        p, supply = self._parameters, self._supply
        finding = 'noise' if self.noise > p.noise_limit else ''  # not so for NaN
        limit = p.voltage_limit * supply + self._unknown_resistance * current
        if self._missing > 0.5:
            finding = 'missing'
        elif self.voltage - supply > limit or supply - self.voltage > limit:  # not so for an unknown supply
            finding = 'voltage'
        if finding or self._finding:
            sentence = self._lasting(finding, now)
            if sentence:
                return sentence
        if not valid or finding in ('missing', 'voltage'):
            return ''
        return self._judge_inductance(current, flux_volts / current_rate, now)

    def _judge_inductance(self, current: float, inductance: float, now: int) -> str:
        # Carried to voltage and temperature of the gap curves, as `mount_models.coil.correction` does.
        held, volts, skin = self._resistance * current, self._link_voltage, []
        if 0.0 <= held < self.voltage and held < volts:
            for supply in (volts, self.voltage):
                place = 0.5 * (held / supply) / DUTY_STEP
                below = min(int(place), len(self._skin) - 2)
                skin.append(self._skin[below] + (place - below) * (self._skin[below + 1] - self._skin[below]))
            share = 1.0 - inductance * self._law.gap_reluctance
            inductance /= 1.0 + share * (skin[0] / skin[1] - 1.0)
        inductance *= self._cold
        reference = self._reference
        if reference is None:
            if not self._sweep.take(current, inductance):
                return ''
            p = self._parameters
            reference = self._reference = self._sweep.reference(self._law, p.inductance_limit, p.gap_limit)
            if reference is None:
                return ''
            self.noise = 0.0
            return objection(reference, self._law, self._wider)
        place = int(current / NODE + 0.5)
        if place >= len(reference.inductance):
            return ''
        expected = reference.inductance[place] + reference.slope[place] * (current - NODE * place)
        if not expected > 0.0:  # not known
            return ''
        deviation = inductance / expected - 1.0
        step = deviation - self._last
        self._last = deviation
        step = step if step >= 0.0 else -step
        self.noise += _NOISE_SHARE * (_TO_STD * (step if step < _ODD else _ODD) - self.noise)
        if self.noise > self._parameters.noise_limit:  # such readings show no gap
            return ''
        sentence, tolerance = '', reference.tolerance[place] + self._wider
        excess = deviation / tolerance
        excess = _FARTHEST if excess > _FARTHEST else -_FARTHEST if excess < -_FARTHEST else excess
        # A mean for each 0.1 A, and one over all currents at which worn pads show.
        joint = _BLIND < current < reference.crossing_current + _NEAR
        if joint:
            self._joint_at = current, expected, tolerance
        for zone in (place >> 1, _JOINT) if joint else (place >> 1,):
            self._means[zone] = mean = self._means[zone] + _SHARE * (excess - self._means[zone])
            if -1.0 <= mean <= 1.0:
                self._beyond[zone] = 0
                continue
            if self._beyond[zone] == 0:
                self._beyond_since[zone] = now
            self._beyond[zone] += 1
            lasted = now - self._beyond_since[zone] >= _DURATION
            if lasted and self._beyond[zone] >= _SURE and zone != _JOINT:
                sentence = self._gap_sentence(current, expected, tolerance, mean)
        certain = self._beyond[_JOINT] >= _CERTAIN and now - self._beyond_since[_JOINT] >= _DURATION
        if certain and not sentence:
            return self._gap_sentence(*self._joint_at, self._means[_JOINT])
        return sentence

    def _lasting(self, finding: str, now: int) -> str:
        """Return the sentence on what is found at present where it has been found for long enough."""
        if finding != self._finding:
            self._finding, self._begun = finding, now
        if not finding or now - self._begun < _DURATION:
            return ''
        lasted = f'for {1e-9 * _DURATION:g} s'
        if finding == 'missing':
            missing = f'coil ripple is not valid {lasted} (limit), gap and coil are not watched'
            return f'{missing}: check its measurement'
        if finding == 'noise':
            return (
                f'coil ripple scatters by {100.0 * self.noise:.0f} % {lasted}, limit '
                f'{100.0 * self._parameters.noise_limit:g} %: check its sensors and cables'
            )
        return (
            f'voltage of the coil by its ripple ({self.voltage:.1f} V) must lie within '
            f'{100.0 * self._parameters.voltage_limit:g} % of the supply ({self._supply:.1f} V); it has not '
            f'{lasted}: check the coil for shorted turns, and the ripple measurement'
        )

    def _gap_sentence(self, current: float, expected: float, tolerance: float, mean: float) -> str:
        inductance = 1e3 * expected * (1.0 + mean * tolerance)
        return (
            f'coil inductance by the ripple at {current:.2f} A ({inductance:.1f} mH) must lie within '
            f'{100.0 * tolerance:.0f} % of that in the ramp of the initialisation ({1e3 * expected:.1f} mH): '
            f'check pads and rod, what lies in the gap, and the ripple measurement'
        )
