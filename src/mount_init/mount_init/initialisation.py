"""One initialisation of the actuator (Fig 5): ripple samples in, setpoints out, at the end gaps and table.

It knows neither clock nor middleware: the same samples give the same results to the bit.
"""

import math
from dataclasses import dataclass

import numpy as np

from mount_init.checks import (
    check_agreement,
    check_contact,
    check_peak_force,
    check_rate,
    check_readings,
    check_resistance,
    check_rest_current,
    check_single_crossing,
    check_steady_fall,
)
from mount_init.errors import CurrentNotFollowingError, InitialisationError
from mount_init.estimate import (
    CoilTemperature,
    ContactGap,
    RestGap,
    TemperatureReadings,
    coil_temperature,
    contact_gap,
    dwell_inductance,
    inductance_curve,
    rest_gap,
)
from mount_init.parameters import InitParameters
from mount_init.ramp import FloatArray, Ramp, Readings, approach, current_ramp
from mount_init.supply import (
    RampSupply,
    check_reach,
    inductance_at_supply_of_curves,
    inductance_crossing,
    saturated,
)
from mount_models.actuator import (
    ForceTableError,
    checked_current_for_force,
    checked_force,
    contact_force,
    current_force_table,
    offset_current,
)
from mount_models.arithmetic.sums import mean, standard_deviation
from mount_models.coil.crossing import CrossingError, find_crossing
from mount_models.quantity import OutsideLawError
from mount_models.specimen import Specimen

OFF = 0.0  # A: the safe state

_NOT_FOLLOWING = 'is the coil connected, and the supply at its voltage?'
_GONE = 'it did before: did the coil come loose, or did setpoints come too late?'
_OVERLOAD = (
    'this machine is overloaded: end what else runs on it, or give the nodes real-time priority (--priority)'
)
_AGAIN = 10  # samples, chosen: a current that follows for so many is back
_DISTURBED = 3  # samples, chosen: a deviation that lasts so long is repeated though it ends by itself
_MARGIN = 10  # samples, chosen: so many before the deviation are repeated too
_LONGEST_AWAY = 0.5  # s, chosen: so long a late machine may leave the coil at 0 A
_INTERRUPTIONS = 40  # chosen: each costs some 0.3 s; `total_timeout` ends them too


@dataclass(frozen=True)
class Evidence:
    """What a result rests on."""

    rest: RestGap
    contact: ContactGap
    temperature: CoilTemperature
    supply: RampSupply
    samples: int
    skipped: int


@dataclass(frozen=True)
class InitialisationResult:
    """Gaps and their standard deviations (m), contact force (N), offset current (A), table (2, N) in A and N.

    The standard deviations come from the scatter of the ripples; errors of the calibration are not in them.
    """

    rest_gap: float
    contact_gap: float
    rest_gap_std: float
    contact_gap_std: float
    contact_force: float
    offset_current: float
    table: FloatArray
    evidence: Evidence


class Initialisation:
    """Drives one current ramp, sample by sample, and estimates at its end.

    `temperatures` may go on taking readings meanwhile; the gaps are compensated for the one that held in the
    middle of the ramp. It is looked up at the end, when it must have come, however late.

    Where setpoints came so late that driver or electronics went to 0 A, the ramp waits at the rest current
    until the coil follows again, and repeats from there on what was disturbed.
    """

    def __init__(
        self,
        specimen: Specimen,
        parameters: InitParameters,
        temperatures: TemperatureReadings | None = None,
    ):
        if parameters.peak_current > specimen.current_limit:
            raise InitialisationError(
                f'peak_current ({parameters.peak_current:.3f} A) must not exceed current_limit '
                f'({specimen.current_limit:.3f} A) of the specimen; lower peak_current'
            )
        self.specimen = specimen
        self.parameters = parameters
        self.ramp: Ramp = current_ramp(parameters, specimen.rest_current)
        self.readings = Readings(self.ramp.setpoints.size)
        self.last_stamp: int | None = None
        self.interruptions = 0
        """Times that the coil current was away and came back."""
        self._first_stamp: int | None = None
        self._temperatures = temperatures or TemperatureReadings()
        self._middle_stamp: int | None = None
        self._setpoints: list[float] = self.ramp.setpoints.tolist()
        self._failure: InitialisationError | None = None
        self._taken = 0
        self._last = OFF  # A: the last setpoint
        self._approach: list[float] | None = None  # setpoints back to the ramp; empty while the coil is away
        self._leading = False  # whether these setpoints are being sent
        self._back = 0  # samples in a row in which it follows again
        self._deviating = 0
        self._followed = False
        self._invalid = 0

    @property
    def length(self) -> int:
        """Number of samples of the whole ramp."""
        return len(self._setpoints)

    @property
    def finished(self) -> bool:
        """Whether no further sample is wanted: the ramp is over, or given up."""
        return self._failure is not None or self.readings.received >= self.length

    @property
    def disturbed(self) -> bool:
        """Whether the coil did not follow for a while, or not at all: `note_late` tells why."""
        return self.interruptions > 0 or isinstance(self._failure, CurrentNotFollowingError)

    def step(self, stamp: int, current: float, current_rate: float, flux_rate: float) -> float:
        """Return the setpoint (A) for the sample of time `stamp` (ns), in A, A/s, T/s; 0 A when finished.

        A sample with NaN is counted and not used. If the current does not follow its setpoint, or the samples
        stay invalid, the ramp is given up at once and `result` tells why.
        """
        if self.finished:
            return OFF
        number = self.readings.received
        self.last_stamp = stamp
        self._taken += 1
        if self._first_stamp is None:
            self._first_stamp = stamp
        deviates = not abs(current - self._last) <= self.parameters.following_error
        if self._approach is not None:
            self._carry(deviates, current)
        else:
            if number == self.length // 2:
                self._middle_stamp = stamp
            if self.readings.add(current, current_rate, flux_rate):
                self._invalid = 0
            else:
                self._note_invalid()
            if self._failure is None and current == current:
                self._watch(deviates, current, flux_rate)
        if self._failure is not None:
            self._last = OFF
        elif self._approach is None:
            self._last = self._setpoints[number]
        else:
            self._last = self._approach.pop(0) if self._approach else self.specimen.rest_current
        return self._last

    def note_late(self, count: int) -> None:
        """Take how many setpoints came too late during the ramp by `mount_driver`; raise what follows of it.

        Raises `InitialisationError` where they are why the coil did not follow, and
        `CurrentNotFollowingError` where its current was away though none was late.
        """
        if isinstance(self._failure, CurrentNotFollowingError) and count:
            raise InitialisationError(
                f'{count} setpoints came too late or not at all for the 20 ms limit of mount_driver and the '
                f'electronics, which then keep the coil at 0 A (interrupted {self.interruptions} times, '
                f'limit {_INTERRUPTIONS}): {_OVERLOAD}'
            ) from self._failure
        if self._failure is None and self.interruptions and not count:
            raise CurrentNotFollowingError(
                f'coil current left its setpoint {self.interruptions} times (limit 0) and came back, though '
                'no setpoint came too late: check coil, cable and connectors'
            )

    def silence(self, duration: float) -> InitialisationError:
        """Return the refusal for samples that stopped to come for `duration` (s)."""
        return InitialisationError(
            f'air gap not estimated: {self.readings.valid} of {self.length} ripple samples, none in the last '
            f'{duration:.1f} s; is mount_driver active?'
        )

    def result(self) -> InitialisationResult:
        """Return gaps, force and table, or raise the `InitialisationError` that says why there are none."""
        if self._failure is not None:
            raise self._failure
        if not self.finished:
            raise InitialisationError(
                f'air gap not estimated: {self.readings.received} of {self.length} ripple samples '
                'received; is mount_driver active?'
            )
        assert self._first_stamp is not None
        assert self.last_stamp is not None
        check_rate(self.last_stamp - self._first_stamp, self._taken, self.parameters)
        check_reach(self.specimen, self.readings, self.ramp)
        check_readings(self.readings, self.ramp, self.parameters)
        temperature = coil_temperature(
            self._temperatures, self._middle_stamp, self.parameters.coil_temperature_celsius
        )
        try:
            return _estimate(self.specimen, self.parameters, self.ramp, self.readings, temperature)
        except CrossingError as error:
            raise InitialisationError(str(error)) from error

    def _carry(self, deviates: bool, current: float) -> None:
        """Go back to the ramp after an interruption: the coil must follow again, then it is led there."""
        self._deviating = self._deviating + 1 if deviates else 0
        self._back = 0 if deviates else self._back + 1
        if self._deviating > _LONGEST_AWAY * self.parameters.sample_rate:
            self._give_up(current, _GONE)
        elif self._approach:
            if self._deviating > self.parameters.following_duration * self.parameters.sample_rate:
                self._interrupt(current)
        elif self._leading:
            self._approach, self._leading = None, False
        elif self._back >= _AGAIN:
            self._approach = approach(self.parameters, self.ramp, self.readings.received)
            self._leading = True

    def _interrupt(self, current: float) -> None:
        """Begin to wait for the coil, for a piece of the ramp was disturbed."""
        self.interruptions += 1
        self._approach, self._leading, self._back = [], False, 0
        self._invalid = 0
        if self.interruptions > _INTERRUPTIONS:
            self._give_up(current, _GONE)

    def _give_up(self, current: float, why: str) -> None:
        self._failure = CurrentNotFollowingError(
            f'coil current ({current:.3f} A) must follow its setpoint ({self._last:.3f} A) within '
            f'{self.parameters.following_error:g} A; {why}'
        )

    def _note_invalid(self) -> None:
        self._invalid += 1
        if self._invalid > self.parameters.invalid_duration * self.parameters.sample_rate:
            self._failure = InitialisationError(
                f'air gap not estimated: {self._invalid} ripple samples in a row were invalid, more than '
                f'{self.parameters.invalid_duration:g} s; check the coil ripple measurement'
            )

    def _watch(self, deviates: bool, current: float, flux_rate: float) -> None:
        parameters = self.parameters
        deviated, self._deviating = self._deviating, self._deviating + 1 if deviates else 0
        self._followed |= not deviates and current > parameters.following_error
        gone = deviates and current <= parameters.following_error  # 0 A: as the safe state makes it
        back = not deviates and deviated >= _DISTURBED
        if self._followed and (gone or back):
            disturbed = deviated + _MARGIN
            self.readings.forget(max(0, self.readings.received - disturbed))
            self._interrupt(current)
        elif self._deviating > parameters.following_duration * parameters.sample_rate:
            self._give_up(current, saturated(self.specimen, current, flux_rate) or _NOT_FOLLOWING)


def load_compiled_laws(specimen: Specimen) -> None:
    """Run the compiled laws once, so that an activation need not wait for the compiler."""
    law = specimen.force_law
    middle = 0.5 * (law.gap_low + law.gap_high)
    checked_current_for_force(law, float(checked_force(law, specimen.rest_current, middle)), middle)
    falling = np.linspace(1.0, 0.0, 50)
    find_crossing(falling[::-1], falling, 0.5)
    mean(falling)
    standard_deviation(falling)


def _estimate(
    specimen: Specimen,
    parameters: InitParameters,
    ramp: Ramp,
    readings: Readings,
    temperature: CoilTemperature,
) -> InitialisationResult:
    current, celsius = readings.current, temperature.celsius
    inductance, supply = inductance_at_supply_of_curves(specimen, parameters, ramp, readings, celsius)

    dwells = [
        dwell_inductance(current[part], inductance[part], parameters)
        for part in (ramp.dwell_before, ramp.dwell_after)
    ]
    for dwell in dwells:
        check_rest_current(specimen, dwell, parameters)
    before, after = (rest_gap(specimen, each.inductance, each.inductance_std, celsius) for each in dwells)
    check_agreement(
        'rest gap before and after the ramp',
        before.gap,
        after.gap,
        parameters.rest_gap_tolerance,
        'do the pads stick to the rod, or does the coil heat up? Activate again at rest',
    )
    rest = rest_gap(specimen, *_mean([(each.inductance, each.inductance_std) for each in dwells]), celsius)
    check_resistance(specimen, supply, celsius, parameters)

    curve = inductance_curve(current, inductance, ramp.up, ramp.down, parameters.peak_current)
    check_single_crossing(curve, specimen)
    crossings = [
        inductance_crossing(specimen, parameters, current[part], inductance[part])
        for part in (ramp.up, ramp.down)
    ]
    up, down = (contact_gap(specimen, rest, each.current, each.current_std, celsius) for each in crossings)
    check_agreement(
        'gap at the crossing on the way up and down',
        up.at_crossing,
        down.at_crossing,
        parameters.crossing_gap_tolerance,
        'check the current sensor and the pads, and activate again',
    )
    crossing, crossing_std = _mean([(each.current, each.current_std) for each in crossings])
    contact = contact_gap(specimen, rest, crossing, crossing_std, celsius)

    check_steady_fall(curve, specimen, parameters)
    check_contact(specimen, rest, contact, crossing, parameters)
    law, spring = specimen.force_law, specimen.spring_stiffness
    try:
        table = current_force_table(
            law, spring, specimen.pad_stiffness, rest.gap, contact.gap, parameters.peak_current
        )
        offset = offset_current(law, spring, rest.gap, contact.gap, parameters.light_pressure)
    except (ForceTableError, OutsideLawError) as error:
        raise InitialisationError(f'current-force table: {error}') from error
    check_peak_force(table, parameters)
    return InitialisationResult(
        rest.gap,
        contact.gap,
        rest.std,
        contact.std,
        contact_force(spring, rest.gap, contact.gap),
        offset,
        table,
        Evidence(rest, contact, temperature, supply, readings.valid, readings.skipped),
    )


def _mean(estimates: list[tuple[float, float]]) -> tuple[float, float]:
    """Return the plain mean of equally good estimates and its standard deviation."""
    values, stds = np.array(estimates).T.copy()
    return mean(values), math.sqrt(mean(stds * stds) / stds.size)
