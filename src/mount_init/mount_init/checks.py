"""Are the readings those of a working coil, and do the estimates fit the specimen, the laws and each other?

Every doubt is a refusal.
"""

import math
from collections.abc import Sequence

import numpy as np

from mount_init.errors import InitialisationError
from mount_init.estimate import ContactGap, RestGap
from mount_init.parameters import InitParameters
from mount_init.ramp import FloatArray, Ramp, Readings
from mount_init.supply import RampSupply
from mount_models.actuator import checked_force
from mount_models.coil.copper import resistance_at
from mount_models.specimen import Specimen

WEAR_RESERVE = 10e-6  # m, chosen: early enough to order pads
_RATE_TOLERANCE = 0.2  # chosen: less than any other rate lies beside, more than losses in a ramp
_BIN = 0.05  # A, chosen: some ten samples each
_FEWEST_IN_BIN = 3
_WORKING_CELSIUS = -40.0, 180.0  # degC, chosen: ISO 16750-4, insulation class H


def check_rest_current(specimen: Specimen, current: FloatArray, parameters: InitParameters) -> None:
    """Raise `InitialisationError` unless the median of the currents (A) of a dwell is the rest current."""
    median = float(np.nanmedian(current))
    if abs(median - specimen.rest_current) > parameters.rest_current_tolerance:
        raise InitialisationError(
            f'coil current at rest ({median:.4f} A) must lie within '
            f'{parameters.rest_current_tolerance * 1e3:.1f} mA of {specimen.rest_current:.3f} A, for which '
            'the gap curve is calibrated; check the current control of the electronics'
        )


def check_agreement(what: str, first: float, second: float, limit: float, remedy: str) -> None:
    """Raise `InitialisationError` unless two gaps (m) agree within `limit` (m)."""
    if abs(first - second) > limit:
        raise InitialisationError(
            f'{what} ({first * 1e6:.1f} and {second * 1e6:.1f} um) must agree within {limit * 1e6:.1f} um; '
            f'{remedy}'
        )


def check_resistance(
    specimen: Specimen, supply: RampSupply, celsius: float, parameters: InitParameters
) -> None:
    """Raise `InitialisationError` unless the resistance is that of the specimen at a temperature (degC).

    Where that is unknown (NaN), any temperature of a working coil is granted. While the supply changes, one
    part of the ramp must show it.
    """
    if specimen.coil_resistance is None:
        return
    known = not math.isnan(celsius)
    coldest, hottest = (celsius, celsius) if known else _WORKING_CELSIUS
    low = (1.0 - parameters.resistance_tolerance) * resistance_at(specimen.coil_resistance, coldest)
    high = (1.0 + parameters.resistance_tolerance) * resistance_at(specimen.coil_resistance, hottest)
    found = [supply.whole.ohm] if supply.steady else [part.ohm for part in supply.parts]
    if any(low <= ohm <= high for ohm in found):
        return
    where = f'at {celsius:.0f} degC' if known else f'at {coldest:g} .. {hottest:g} degC, its own is unknown'
    limits = f'{low:.3f} .. {high:.3f} ohm, that of {specimen.name} {where}'
    if not supply.steady:
        shown = ' and '.join(f'{ohm:.3f}' for ohm in found) or 'none, so unevenly'
        raise InitialisationError(
            f'voltage of the bridge by the coil ripple changed between {supply.lowest:.1f} and '
            f'{supply.highest:.1f} V during the ramp, and no part of it shows a resistance within {limits} '
            f'({shown}); activate again while the supply is steady, else check the coil'
        )
    (ohm,) = found
    cause = 'are turns shorted?' if ohm < low else 'is a contact loose, or the coil hotter than told?'
    raise InitialisationError(
        f'resistance of the coil ({ohm:.3f} ohm, link voltage {supply.whole.link_voltage:.1f} V) '
        f'must lie within {limits}; {cause} Check coil '
        'and cable, coil_temperature and the specimen'
    )


def check_single_crossing(way: str, current: FloatArray, inductance: FloatArray, level: float) -> None:
    """Raise `InitialisationError` unless the medians of L_i (H) fall through their level exactly once.

    Below the crossing they may rise and fall again while the halves close; they must only stay above it.
    """
    above = inductance > level
    places = np.flatnonzero(above[1:] != above[:-1])
    if places.size != 1 or not above[0]:
        where = ', '.join(f'{0.5 * (current[k] + current[k + 1]):.2f} A' for k in places) or 'nowhere'
        raise InitialisationError(
            f'inductance on the way {way} must fall through {level * 1e3:.1f} mH exactly once; it crosses '
            f'{where} (range {np.min(inductance) * 1e3:.1f} .. {np.max(inductance) * 1e3:.1f} mH): do the '
            'pads close and stay closed? Check the sensors'
        )


def check_steady_fall(
    way: str, current: FloatArray, inductance: FloatArray, crossing: float, half_width: float
) -> None:
    """Raise `InitialisationError` unless the medians of L_i (H) fall steadily around the crossing (A)."""
    near = np.flatnonzero(np.abs(current - crossing) <= half_width)
    for k in near[:-1]:
        if inductance[k + 1] >= inductance[k]:
            raise InitialisationError(
                f'inductance on the way {way} must fall steadily within {half_width:.2f} A of the crossing; '
                f'from {current[k]:.2f} to {current[k + 1]:.2f} A it rises from {inductance[k] * 1e3:.2f} to '
                f'{inductance[k + 1] * 1e3:.2f} mH: do the pads bounce? Check pads and ripple sensors'
            )


def known_medians(
    way: str, current: FloatArray, inductance: FloatArray, lowest: float
) -> tuple[FloatArray, FloatArray]:
    """Return centres (A) and medians (H) of the bins above a `lowest` current (A) with enough readings."""
    finite = np.isfinite(current) & np.isfinite(inductance)
    bins, values = np.floor(current[finite] / _BIN).astype(int), inductance[finite]
    places, counts = np.unique(bins, return_counts=True)
    known = places[(counts >= _FEWEST_IN_BIN) & (_BIN * (places + 0.5) > lowest)]
    if known.size < 2:
        raise InitialisationError(
            f'inductance on the way {way} is known at {known.size} currents above {lowest:.2f} A, needed '
            'are 2; check the ripple sensors'
        )
    return _BIN * (known + 0.5), np.array([np.median(values[bins == place]) for place in known])


def check_contact(
    specimen: Specimen,
    rest: RestGap,
    contact: ContactGap,
    crossing_current: float,
    parameters: InitParameters,
) -> None:
    """Raise `InitialisationError` unless the pads were free and then pressed.

    Raises `InitialisationError` unless the scatter leaves both gaps precise enough.
    """
    travel = rest.at_rest_current - contact.gap
    if travel < parameters.smallest_travel:
        raise InitialisationError(
            f'contact gap ({contact.gap * 1e6:.1f} um) must lie at least '
            f'{parameters.smallest_travel * 1e6:.1f} um below the gap at {specimen.rest_current:.2f} A '
            f'({rest.at_rest_current * 1e6:.1f} um): either the halves are blocked and never close, or the '
            'pads already touch at rest; check rod, pads and springs'
        )
    if contact.normal_force_at_crossing <= 0.0:
        pull = float(checked_force(specimen.force_law, crossing_current, contact.at_crossing))
        raise InitialisationError(
            f'spring force at the crossing ({pull - contact.normal_force_at_crossing:.1f} N for a way of '
            f'{(rest.gap - contact.at_crossing) * 1e6:.1f} um) must stay below the pull of the magnet '
            f'({pull:.1f} N), else the pads are not in contact; check the springs and spring_stiffness of '
            'the specimen'
        )
    for name, std, largest in (
        ('rest gap', rest.std, parameters.largest_rest_gap_std),
        ('contact gap', contact.std, parameters.largest_contact_gap_std),
    ):
        if not std <= largest:
            raise InitialisationError(
                f'standard deviation of the {name} ({std * 1e6:.2f} um) must not exceed '
                f'{largest * 1e6:.2f} um; the ripple is too noisy: check its sensors, or lengthen '
                'dwell_duration and ramp_duration'
            )


def wear_reserve(contact_gap: float, highest_force: float, specimen: Specimen) -> float:
    """Return how much (m) the pads may wear before the pressed gap leaves the range of the force law.

    `contact_gap` in m; `highest_force` is the last normal force (N) of the current-force table.
    """
    return contact_gap - highest_force / specimen.pad_stiffness - specimen.force_law.gap_low


def check_peak_force(table: FloatArray, parameters: InitParameters) -> None:
    """Raise `InitialisationError` unless the table of shape (2, N) reaches a useful normal force."""
    if table[1, -1] < parameters.smallest_peak_force:
        raise InitialisationError(
            f'normal force at {table[0, -1]:.2f} A ({table[1, -1]:.1f} N) must reach '
            f'{parameters.smallest_peak_force:.1f} N; the gaps leave the magnet too weak: check pads and '
            'springs'
        )


def check_rate(stamps: Sequence[int], parameters: InitParameters) -> None:
    """Raise `InitialisationError` unless the samples of a ramp, at `stamps` (ns), took the right time."""
    rate = 1e9 * (len(stamps) - 1) / max(1, stamps[-1] - stamps[0])
    if abs(rate - parameters.sample_rate) > _RATE_TOLERANCE * parameters.sample_rate:
        raise InitialisationError(
            f'coil_ripple came at {rate:.0f} Hz, but sample_rate of mount_init is {parameters.sample_rate:g} '
            f'Hz (limit {100.0 * _RATE_TOLERANCE:g} %); start the whole graph with one sample_rate'
        )


def check_readings(readings: Readings, ramp: Ramp, parameters: InitParameters) -> None:
    """Raise `InitialisationError` unless the whole ramp has enough readings, of the right sign and alive."""
    for part in ('dwell_before', 'up', 'down', 'dwell_after'):
        inside = np.isfinite(readings.current[getattr(ramp, part)])
        needed, found = math.ceil(parameters.valid_share * inside.size), int(inside.sum())
        if found < needed:
            raise InitialisationError(
                f'air gap not estimated: {found} of {inside.size} ripple samples valid in the part '
                f'"{part.replace("_", " ")}", needed are {needed}; check the coil ripple measurement'
            )
    kinds = (
        ('slope of the coil current', 'A/s', readings.current_rate),
        ('slope of the flux density', 'T/s', readings.flux_rate),
        ('coil current', 'A', readings.current),
    )
    for name, unit, rate in kinds[:2]:
        rate = rate[np.isfinite(rate)]
        wrong = rate[rate <= 0.0]
        if wrong.size > parameters.rejected_share * rate.size:
            raise InitialisationError(
                f'{name} after switching to plus must be positive; {wrong.size} of {rate.size} samples are '
                f'not, such as {wrong[0]:g} {unit}: check the polarity of the coil and of its sensors'
            )
    longest = max(2, round(parameters.stuck_duration * parameters.sample_rate))
    for name, unit, values in kinds:
        for side in (ramp.up, ramp.down):
            length, value = _longest_constant_run(values[side])
            if length > longest:
                raise InitialisationError(
                    f'{name} stayed at {value:g} {unit} for {length} samples while the current was ramped, '
                    f'more than {longest}; the sensor is stuck: check it and its connection'
                )


def _longest_constant_run(values: FloatArray) -> tuple[int, float]:
    """Return length and value of the longest run of identical values; NaN is left out."""
    values = values[np.isfinite(values)]
    if not values.size:
        return 0, math.nan
    starts = np.flatnonzero(np.concatenate([[True], values[1:] != values[:-1]]))
    lengths = np.diff(np.append(starts, values.size))
    longest = int(np.argmax(lengths))
    return int(lengths[longest]), float(values[starts[longest]])
