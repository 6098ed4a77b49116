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
    known_medians,
)
from mount_init.errors import InitialisationError
from mount_init.estimate import (
    CoilTemperature,
    ContactGap,
    RestGap,
    TemperatureReadings,
    coil_temperature,
    contact_gap,
    dwell_inductance,
    rest_gap,
)
from mount_init.parameters import InitParameters
from mount_init.ramp import FloatArray, Readings, current_ramp
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
        self.ramp = current_ramp(parameters, specimen.rest_current)
        self.readings = Readings(self.ramp.setpoints.size)
        self.stamps: list[int] = []
        self._temperatures = temperatures or TemperatureReadings()
        self._setpoints: list[float] = self.ramp.setpoints.tolist()
        self._failure: InitialisationError | None = None
        self._last = OFF  # A: the last setpoint
        self._deviating = self._invalid = 0  # samples in a row
        self._followed = False

    @property
    def length(self) -> int:
        """Number of samples of the whole ramp."""
        return len(self._setpoints)

    @property
    def finished(self) -> bool:
        """Whether no further sample is wanted: the ramp is over, or given up."""
        return self._failure is not None or len(self.stamps) >= self.length

    def step(self, stamp: int, current: float, current_rate: float, flux_rate: float) -> float:
        """Return the setpoint (A) for the sample of time `stamp` (ns), in A, A/s, T/s; 0 A when finished.

        A sample with NaN is counted and not used. If the current does not follow its setpoint, or the samples
        stay invalid, the ramp is given up at once and `result` tells why.
        """
        if self.finished:
            return OFF
        self.stamps.append(stamp)
        self._watch(self.readings.add(current, current_rate, flux_rate), current, flux_rate)
        self._last = OFF if self._failure else self._setpoints[len(self.stamps) - 1]
        return self._last

    def result(self) -> InitialisationResult:
        """Return gaps, force and table, or raise the `InitialisationError` that says why there are none."""
        if self._failure is not None:
            raise self._failure
        if not self.finished:
            raise InitialisationError(
                f'air gap not estimated: {self.readings.received} of {self.length} ripple samples '
                'received; is mount_driver active?'
            )
        check_rate(self.stamps, self.parameters)
        check_reach(self.specimen, self.readings, self.ramp)
        check_readings(self.readings, self.ramp, self.parameters)
        try:
            return self._estimate()
        except CrossingError as error:
            raise InitialisationError(str(error)) from error

    def _watch(self, valid: bool, current: float, flux_rate: float) -> None:
        """Give the ramp up where samples stay invalid or the current does not follow its setpoint."""
        parameters = self.parameters
        self._invalid = 0 if valid else self._invalid + 1
        if self._invalid > parameters.invalid_duration * parameters.sample_rate:
            self._failure = InitialisationError(
                f'air gap not estimated: {self._invalid} ripple samples in a row were invalid, more than '
                f'{parameters.invalid_duration:g} s; check the coil ripple measurement'
            )
        if math.isnan(current):
            return
        follows = abs(current - self._last) <= parameters.following_error
        self._deviating = 0 if follows else self._deviating + 1
        self._followed |= follows and current > parameters.following_error
        if self._deviating > parameters.following_duration * parameters.sample_rate:
            why = saturated(self.specimen, current, flux_rate) or (
                _GONE if self._followed else _NOT_FOLLOWING
            )
            self._failure = InitialisationError(
                f'coil current ({current:.3f} A) must follow its setpoint ({self._last:.3f} A) within '
                f'{parameters.following_error:g} A; {why}'
            )

    def _estimate(self) -> InitialisationResult:
        specimen, parameters, ramp, readings = self.specimen, self.parameters, self.ramp, self.readings
        temperature = coil_temperature(
            self._temperatures, self.stamps[self.length // 2], parameters.coil_temperature_celsius
        )
        current, celsius = readings.current, temperature.celsius
        inductance, supply = inductance_at_supply_of_curves(specimen, parameters, ramp, readings, celsius)

        dwells = [
            dwell_inductance(inductance[part], parameters) for part in (ramp.dwell_before, ramp.dwell_after)
        ]
        for part in (ramp.dwell_before, ramp.dwell_after):
            check_rest_current(specimen, current[part], parameters)
        before, after = (rest_gap(specimen, *dwell, celsius) for dwell in dwells)
        check_agreement(
            'rest gap before and after the ramp',
            before.gap,
            after.gap,
            parameters.rest_gap_tolerance,
            'do the pads stick to the rod, or does the coil heat up? Activate again at rest',
        )
        rest = rest_gap(specimen, *_mean(dwells), celsius)
        check_resistance(specimen, supply, celsius, parameters)

        ways = {'up': ramp.up, 'down': ramp.down}
        curves = {
            way: known_medians(way, current[part], inductance[part], specimen.rest_current)
            for way, part in ways.items()
        }
        for way, curve in curves.items():
            check_single_crossing(way, *curve, specimen.crossing_inductance)
        crossings = [
            inductance_crossing(specimen, parameters, current[part], inductance[part])
            for part in ways.values()
        ]
        up, down = (
            contact_gap(specimen, rest, each.current, each.current_std, celsius) for each in crossings
        )
        check_agreement(
            'gap at the crossing on the way up and down',
            up.at_crossing,
            down.at_crossing,
            parameters.crossing_gap_tolerance,
            'check the current sensor and the pads, and activate again',
        )
        crossing, crossing_std = _mean([(each.current, each.current_std) for each in crossings])
        contact = contact_gap(specimen, rest, crossing, crossing_std, celsius)
        for (way, curve), each in zip(curves.items(), crossings, strict=True):
            check_steady_fall(way, *curve, each.current, parameters.monotone_half_width)
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


def load_compiled_laws(specimen: Specimen) -> None:
    """Run the compiled laws once, so that an activation need not wait for the compiler."""
    law = specimen.force_law
    middle = 0.5 * (law.gap_low + law.gap_high)
    checked_current_for_force(law, float(checked_force(law, specimen.rest_current, middle)), middle)
    falling = np.linspace(1.0, 0.0, 50)
    find_crossing(falling[::-1], falling, 0.5)
    mean(falling)
    standard_deviation(falling)


def _mean(estimates: list[tuple[float, float]]) -> tuple[float, float]:
    """Return the plain mean of equally good estimates and its standard deviation."""
    values, stds = np.array(estimates).T.copy()
    return mean(values), math.sqrt(mean(stds * stds) / stds.size)
