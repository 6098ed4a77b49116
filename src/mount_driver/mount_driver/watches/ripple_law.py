"""What the driver knows of the coil ripple of this actuator: the few numbers of its specimen's gap curves.

The defaults are those of the shipped specimen: to read its file would cost every start a second.
"""

import math
from typing import TYPE_CHECKING, NamedTuple

from mount_models.coil.correction import Bridge, gap_reluctance, skin_shape
from mount_models.coil.gap import evaluate

if TYPE_CHECKING:  # to load it takes a second
    from mount_models.specimen import Specimen


DUTY_STEP = 1.0 / 256.0


class RippleLaw(NamedTuple):
    """Inductance at rest and crossing current at the calibrated gaps, and what the temperature does; SI.

    The crossing currents (A) are those at the lowest and the highest calibrated gap. The inductance rises
    by the share `warm_rise` from `calibration_celsius` to `reference_celsius`. The curves hold at
    `bridge.link_voltage`; `gap_reluctance` (1/H) is the share of the middle gap in 1 / L_i.
    """

    turns_area: float = 0.11808
    rest_current: float = 0.2
    crossing_inductance: float = 0.02
    rest_inductance_low: float = 0.04140410550354455
    rest_inductance_high: float = 0.05226015296166296
    gap_low: float = 0.00025000000000000006
    gap_high: float = 0.0005500000000000001
    crossing_low: float = 1.169341254762723
    crossing_high: float = 1.754917203805684
    calibration_celsius: float = 20.0
    reference_celsius: float = 80.0
    conductivity_coefficient: float = 0.0043
    warm_rise: float = 0.05580165379302793
    bridge: Bridge = Bridge()
    gap_reluctance: float = 10.635458133206077


def ripple_law(specimen: 'Specimen') -> RippleLaw:
    """Return the law of the ripple of a specimen; without a temperature compensation it holds at any."""
    curves, temperature = specimen.gap_curves, specimen.temperature
    calibrated = curves.crossing_current_of_gap
    low, high = calibrated.low, calibrated.high
    middle = 0.5 * (low + high)
    cold = float(evaluate(curves.inductance_of_gap, middle))
    law = RippleLaw(
        turns_area=specimen.turns_area,
        rest_current=specimen.rest_current,
        crossing_inductance=specimen.crossing_inductance,
        rest_inductance_low=curves.gap_of_inductance.low,
        rest_inductance_high=curves.gap_of_inductance.high,
        gap_low=low,
        gap_high=high,
        crossing_low=float(evaluate(calibrated, low)),
        crossing_high=float(evaluate(calibrated, high)),
        warm_rise=0.0,
        bridge=specimen.bridge,
        gap_reluctance=_HALF / cold,
    )
    if temperature is None:
        return law
    shift = float(evaluate(temperature.reluctance_shift, middle))
    return law._replace(
        calibration_celsius=temperature.calibration_celsius,
        reference_celsius=temperature.reference_celsius,
        conductivity_coefficient=temperature.conductivity_coefficient,
        warm_rise=1.0 / (1.0 + cold * shift) - 1.0,
        gap_reluctance=gap_reluctance(
            specimen.bridge, curves, temperature, specimen.heating.resistance, specimen.rest_current, middle
        ),
    )


def warmth(law: RippleLaw, celsius: float) -> float:
    """Return by which factor the inductance exceeds that at the calibration; 1 at an unknown temperature.

    One factor for all gaps and currents, with the depth of the skin as in `mount_models.coil.correction`: of
    the simulated coil up to 1.6 A it is right to 2 % from -40 to 122 degC.
    """
    if celsius != celsius:
        return 1.0
    shift = 1.0 / (1.0 + law.warm_rise) - 1.0
    return 1.0 / (1.0 + shift * _skin_change(law, celsius) / _skin_change(law, law.reference_celsius))


def skin_table(law: RippleLaw) -> list[float]:
    """Return `mount_models.coil.correction.skin_shape` from a duty of 0.5 on, in steps of `DUTY_STEP`."""
    return skin_shape(law.bridge, [0.5 + k * DUTY_STEP for k in range(_DUTIES)]).tolist()


def crossing_per_gap(law: RippleLaw) -> float:
    """Return how far the crossing current moves with the gap, A/m, on the mean over the calibrated gaps."""
    return (law.crossing_high - law.crossing_low) / (law.gap_high - law.gap_low)


_HALF = 0.5  # 1, chosen: of the reluctance at rest, without a second temperature; 0.49 of the shipped one
_DUTIES = 128  # from 0.5 on: the table ends before 1


def _skin_change(law: RippleLaw, celsius: float) -> float:
    warmer = max(law.conductivity_coefficient, 1e-6) * (celsius - law.calibration_celsius)
    return 1.0 / math.sqrt(max(1.0 + warmer, 0.1)) - 1.0
