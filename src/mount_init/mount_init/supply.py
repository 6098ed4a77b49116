"""The voltage of the bridge during the ramp, and the inductances carried from it to that of the gap curves.

Each ripple sample tells it by itself, with its own stamp: U = n A dB/dt + R i. So neither a supply that
changes during the ramp nor one that the status tells late or wrongly moves the gaps; that the ripple agrees
with the status is what `mount_driver` watches.
"""

import contextlib
import math
from typing import NamedTuple

import numpy as np

from mount_init.errors import InitialisationError
from mount_init.parameters import InitParameters
from mount_init.ramp import FloatArray, Ramp, Readings
from mount_models.coil.copper import (
    CoilResistance,
    DriftingResistance,
    measured_resistance,
    resistance_at,
    resistance_beside_drift,
)
from mount_models.coil.correction import (
    at_calibrated_duty,
    crossing_at_calibration,
    duty,
    gap_reluctance,
    inductance_at_calibration,
    skin_ratio,
)
from mount_models.coil.crossing import Crossing, find_crossing
from mount_models.coil.gap import ScaledPolynomial, evaluate
from mount_models.quantity import OutsideLawError
from mount_models.specimen import Specimen

_BLOCK = 0.02  # s, chosen: of so many readings the median is taken; 1 % of noise leaves 0.3 %
_STEADY = 0.015  # 1, chosen: five standard deviations of a block
_AS_CALIBRATED = 0.01  # 1, chosen: so much of R / U is 0.5 um of the contact gap
_UNCOMPENSATED = 0.08  # 1, chosen: 4 um of the contact gap
_UNEVEN = 0.01  # of the voltage, chosen: a change that no straight line follows
_FULL = 0.04  # of the voltage, chosen: what is left of it when the bridge can drive no more
_PEAK = 5  # samples of each ramp, chosen


class RampSupply(NamedTuple):
    """Lowest and highest voltage of the bridge in the ramp (V), and what that tells of the resistance.

    `whole` is that of a voltage which stays the same. Where it changed, `parts` holds those of the way up and
    down, none of a part in which it changed too unevenly to tell.
    """

    lowest: float
    highest: float
    steady: bool
    whole: CoilResistance
    parts: tuple[DriftingResistance, ...]


def inductance_at_supply_of_curves(
    specimen: Specimen, parameters: InitParameters, ramp: Ramp, readings: Readings, celsius: float
) -> tuple[FloatArray, RampSupply]:
    """Return L_i (H), shape (N,), as it would be at the voltage of the gap curves, and the supply.

    At that voltage, within 1 % of R / U, they are the readings themselves, to the bit. `celsius` may be NaN,
    if the temperature is unknown. Raises `InitialisationError`, and `CrossingError` without a crossing.
    """
    current, inductance = readings.current, readings.inductance(specimen.turns_area)
    volts = specimen.turns_area * readings.flux_rate
    moved = slice(ramp.up.start, ramp.down.stop)
    whole = measured_resistance(specimen.turns_area, current[moved], readings.flux_rate[moved])
    driven = slice(ramp.dwell_before.start, ramp.dwell_after.stop)
    nominal = specimen.coil_resistance or specimen.heating.resistance
    expected = None
    if specimen.coil_resistance is not None and not math.isnan(celsius):
        expected = resistance_at(specimen.coil_resistance, celsius)

    resistance = whole.ohm
    voltage = _smooth(volts + resistance * current, driven, parameters)
    steady = bool(np.ptp(voltage[driven]) <= 2.0 * _STEADY * abs(whole.link_voltage))
    if steady:
        voltage = np.full(current.size, whole.link_voltage)
    else:  # a straight line over the current tells no resistance then
        resistance = expected or nominal
        voltage = _smooth(volts + resistance * current, driven, parameters)
    lowest, highest = float(voltage[driven].min()), float(voltage[driven].max())
    parts = () if steady else _parts(specimen, ramp, readings, lowest)
    supply = RampSupply(lowest, highest, steady, whole, parts)
    bridge, name, compensation = specimen.bridge, specimen.name, specimen.temperature
    _check_range(
        supply,
        bridge.lowest_voltage,
        bridge.highest_voltage,
        f'where the gap curves of {name} hold; check battery, generator and the ripple measurement, and '
        'activate again',
    )
    if compensation is None:
        _check_range(
            supply,
            (1.0 - _UNCOMPENSATED) * bridge.link_voltage,
            (1.0 + _UNCOMPENSATED) * bridge.link_voltage,
            f'as {name} has no temperature compensation, which also tells what the supply does; calibrate at '
            'two temperatures',
        )
        return inductance, supply
    of_curves = expected or resistance
    relative = (resistance / whole.link_voltage) / (of_curves / bridge.link_voltage) - 1.0
    if steady and abs(relative) <= _AS_CALIBRATED:
        return inductance, supply
    ratio = skin_ratio(
        bridge, duty(resistance, current, voltage), duty(of_curves, current, bridge.link_voltage)
    )
    curves, result = specimen.gap_curves, inductance.copy()

    def carry(part: slice, gap: float) -> None:
        reluctance = gap_reluctance(bridge, curves, compensation, nominal, specimen.rest_current, gap)
        result[part] = at_calibrated_duty(inductance[part], reluctance, ratio[part])

    for dwell in (ramp.dwell_before, ramp.dwell_after):
        found = float(np.nanmedian(inductance[dwell]))
        with contextlib.suppress(OutsideLawError):  # `rest_gap` tells
            found = inductance_at_curves(specimen, found, celsius)
        carry(dwell, _within(curves.gap_of_inductance, found))
    carry(moved, curves.crossing_current_of_gap.centre)
    for _ in range(2):
        found = inductance_crossing(specimen, parameters, current[ramp.up], result[ramp.up]).current
        with contextlib.suppress(OutsideLawError):
            found = crossing_at_curves(specimen, found, celsius)
        carry(moved, _within(curves.gap_of_crossing_current, found))
    return result, supply


def inductance_crossing(
    specimen: Specimen, parameters: InitParameters, current: FloatArray, inductance: FloatArray
) -> Crossing:
    """Return where one ramp's inductance (H) falls through its crossing; raises `CrossingError`."""
    return find_crossing(current, inductance, specimen.crossing_inductance, parameters.crossing_half_width)


def inductance_at_curves(specimen: Specimen, inductance: float, celsius: float) -> float:
    """Return an inductance (H) at rest, carried from the coil temperature (degC) to that of the gap curves.

    It stays where the temperature is unknown (NaN). Raises `OutsideLawError`.
    """
    if specimen.temperature is None or math.isnan(celsius):
        return inductance
    return inductance_at_calibration(specimen.temperature, specimen.gap_curves, inductance, celsius)


def crossing_at_curves(specimen: Specimen, current: float, celsius: float) -> float:
    """Return a crossing current (A), carried to the temperature of the gap curves in the same way."""
    if specimen.temperature is None or math.isnan(celsius):
        return current
    return crossing_at_calibration(specimen.temperature, specimen.gap_curves, current, celsius)


def check_reach(specimen: Specimen, readings: Readings, ramp: Ramp) -> None:
    """Raise `InitialisationError` where the supply cannot drive the current as high as the ramp asks."""
    peak = slice(ramp.up.stop - _PEAK, ramp.down.start + _PEAK)
    current, flux_rate = readings.current[peak], readings.flux_rate[peak]
    if np.isfinite(flux_rate).any():
        doubt = saturated(specimen, float(np.nanmedian(current)), float(np.nanmedian(flux_rate)))
        if doubt:
            raise InitialisationError(doubt)


def saturated(specimen: Specimen, current: float, flux_rate: float) -> str:
    """Return why a current (A) cannot rise, by dB/dt (T/s): hardly any voltage is left; else empty."""
    left = specimen.turns_area * flux_rate
    held = left + (specimen.coil_resistance or specimen.heating.resistance) * current
    if current < 0.5 * specimen.current_limit or not 0.0 <= left < _FULL * held:
        return ''
    return (
        f'the supply drives no more than {current:.2f} A through the coil: {left:.2f} V are left to change '
        f'it, needed are {_FULL * held:.2f} V; charge the battery, let the coil cool down, or lower '
        'peak_current'
    )


def _smooth(values: FloatArray, driven: slice, parameters: InitParameters) -> FloatArray:
    """Return the medians of blocks of the driven samples, with straight lines between them."""
    size = max(5, round(_BLOCK * parameters.sample_rate))
    starts = range(driven.start, driven.stop - size + 1, size)
    medians = np.array([_median(values[start : start + size]) for start in starts])
    known = np.isfinite(medians)
    latest = np.maximum.accumulate(np.where(known, np.arange(medians.size), int(np.argmax(known))))
    medians = medians[latest]  # a block without readings has what was known last
    place = (np.arange(values.size) - starts[0] - 0.5 * (size - 1)) / size
    place = np.clip(place, 0.0, medians.size - 1.0)
    before = np.minimum(place.astype(int), max(0, medians.size - 2))
    after = np.minimum(before + 1, medians.size - 1)
    return np.asarray(medians[before] + (place - before) * (medians[after] - medians[before]))


def _median(values: FloatArray) -> float:
    finite = values[np.isfinite(values)]
    return float(np.median(finite)) if finite.size else math.nan


def _check_range(supply: RampSupply, low: float, high: float, reason: str) -> None:
    if supply.lowest < low or supply.highest > high:
        raise InitialisationError(
            f'voltage of the bridge by the coil ripple ({supply.lowest:.1f} .. {supply.highest:.1f} V) must '
            f'lie within {low:.3g} .. {high:.3g} V, {reason}'
        )


def _parts(
    specimen: Specimen, ramp: Ramp, readings: Readings, lowest: float
) -> tuple[DriftingResistance, ...]:
    found = (
        resistance_beside_drift(specimen.turns_area, readings.current[part], readings.flux_rate[part])
        for part in (ramp.up, ramp.down)
    )
    return tuple(each for each in found if each.misfit <= _UNEVEN * lowest)


def _within(curve: ScaledPolynomial, value: float) -> float:
    return float(evaluate(curve, min(max(value, curve.low), curve.high)))
