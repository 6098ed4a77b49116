"""Whether the estimates fit the specimen, the laws and each other; every doubt is a refusal."""

import math
from collections.abc import Iterator

import numpy as np

from mount_init.errors import (
    AmbiguousCurveError,
    ContradictionError,
    CurrentNotFollowingError,
    ImpreciseError,
    NoContactError,
    SupplyError,
    WrongCoilError,
)
from mount_init.estimation import ContactGap, Dwell, FloatArray, InductanceCurve, RestGap
from mount_init.parameters import InitParameters
from mount_init.supply import RampSupply
from mount_models.actuator.law import checked_force
from mount_models.coil.resistance import resistance_at
from mount_models.specimen import Specimen

_WORKING_CELSIUS = -40.0, 180.0  # degC, chosen: ISO 16750-4, insulation class H


def check_rest_current(specimen: Specimen, dwell: Dwell, parameters: InitParameters) -> None:
    """Raise `CurrentNotFollowingError` unless the mean current of a dwell is the rest current."""
    offset = dwell.current - specimen.rest_current
    if abs(offset) > parameters.rest_current_tolerance:
        raise CurrentNotFollowingError(
            f'coil current at rest ({dwell.current:.4f} A) must lie within '
            f'{parameters.rest_current_tolerance * 1e3:.1f} mA of {specimen.rest_current:.3f} A, for which '
            'the gap curve is calibrated; check the current control of the electronics'
        )


def check_resistance(
    specimen: Specimen, supply: RampSupply, celsius: float, parameters: InitParameters
) -> None:
    """Raise `WrongCoilError` unless the resistance is that of the specimen at a temperature (degC).

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
        raise SupplyError(
            f'voltage of the bridge by the coil ripple changed between {supply.lowest:.1f} and '
            f'{supply.highest:.1f} V during the ramp, and no part of it shows a resistance within {limits} '
            f'({shown}); activate again while the supply is steady, else check the coil'
        )
    (ohm,) = found
    cause = 'are turns shorted?' if ohm < low else 'is a contact loose, or the coil hotter than told?'
    raise WrongCoilError(
        f'resistance of the coil ({ohm:.3f} ohm, link voltage {supply.whole.link_voltage:.1f} V) '
        f'must lie within {limits}; {cause} Check coil '
        'and cable, coil_temperature and the specimen'
    )


def check_single_crossing(curve: InductanceCurve, level: float, rest_current: float) -> None:
    """Raise `AmbiguousCurveError` unless L_i falls through `level` (H) exactly once above `rest_current` (A).

    Below the crossing L_i may rise and fall again while the halves close; it must only stay above the level.
    """
    for name, current, inductance in _known_parts(curve, rest_current):
        changes = _level_changes(inductance, level)
        if len(changes) != 1 or not inductance[0] > level:
            places = ', '.join(f'{0.5 * (current[k] + current[k + 1]):.2f} A' for k in changes) or 'nowhere'
            reach = f'{np.min(inductance) * 1e3:.1f} .. {np.max(inductance) * 1e3:.1f} mH'
            raise AmbiguousCurveError(
                f'inductance on the way {name} must fall through {level * 1e3:.1f} mH exactly once; it '
                f'crosses {places} (range {reach}): do the pads close and stay closed? Check the sensors'
            )


def check_steady_fall(
    curve: InductanceCurve, level: float, rest_current: float, parameters: InitParameters
) -> None:
    """Raise `AmbiguousCurveError` unless L_i falls from bin to bin around its crossing of `level` (H)."""
    for name, current, inductance in _known_parts(curve, rest_current):
        (place,) = _level_changes(inductance, level)
        centre = 0.5 * (current[place] + current[place + 1])
        near = np.flatnonzero(np.abs(current - centre) <= parameters.monotone_half_width)
        for k in near[:-1]:
            if inductance[k + 1] >= inductance[k]:
                raise AmbiguousCurveError(
                    f'inductance on the way {name} must fall steadily within '
                    f'{parameters.monotone_half_width:.2f} A of the crossing; from {current[k]:.2f} to '
                    f'{current[k + 1]:.2f} A it rises from {inductance[k] * 1e3:.2f} to '
                    f'{inductance[k + 1] * 1e3:.2f} mH: do the pads bounce? Check pads and ripple sensors'
                )


def check_same_rest_gap(before: RestGap, after: RestGap, parameters: InitParameters) -> None:
    """Raise `ContradictionError` unless both dwells show the same rest gap."""
    if abs(before.gap - after.gap) > parameters.rest_gap_tolerance:
        raise ContradictionError(
            f'rest gap before and after the ramp ({before.gap * 1e6:.1f} and {after.gap * 1e6:.1f} um) '
            f'must agree within {parameters.rest_gap_tolerance * 1e6:.1f} um; do the pads stick to the '
            'rod, or does the coil heat up? Activate again at rest'
        )


def check_same_crossing(gap_up: float, gap_down: float, parameters: InitParameters) -> None:
    """Raise `ContradictionError` unless both ramps show the same gap (m) at the crossing."""
    if abs(gap_up - gap_down) > parameters.crossing_gap_tolerance:
        raise ContradictionError(
            f'gap at the crossing on the way up and down ({gap_up * 1e6:.1f} and {gap_down * 1e6:.1f} um) '
            f'must agree within {parameters.crossing_gap_tolerance * 1e6:.1f} um; check the current sensor '
            'and the pads, and activate again'
        )


def check_contact(
    specimen: Specimen,
    rest: RestGap,
    contact: ContactGap,
    crossing_current: float,
    parameters: InitParameters,
) -> None:
    """Raise `NoContactError` or `ContradictionError` unless the pads were free and then pressed."""
    travel = rest.at_rest_current - contact.gap
    if travel < parameters.smallest_travel:
        raise NoContactError(
            f'contact gap ({contact.gap * 1e6:.1f} um) must lie at least '
            f'{parameters.smallest_travel * 1e6:.1f} um below the gap at {specimen.rest_current:.2f} A '
            f'({rest.at_rest_current * 1e6:.1f} um): either the halves are blocked and never close, or the '
            'pads already touch at rest; check rod, pads and springs'
        )
    if contact.normal_force_at_crossing <= 0.0:
        pull = float(checked_force(specimen.force_law, crossing_current, contact.at_crossing))
        raise ContradictionError(
            f'spring force at the crossing ({pull - contact.normal_force_at_crossing:.1f} N for a way of '
            f'{(rest.gap - contact.at_crossing) * 1e6:.1f} um) must stay below the pull of the magnet '
            f'({pull:.1f} N), else the pads are not in contact; check the springs and spring_stiffness of '
            'the specimen'
        )


def check_precision(rest: RestGap, contact: ContactGap, parameters: InitParameters) -> None:
    """Raise `ImpreciseError` unless the scatter leaves both gaps precise enough."""
    for name, std, largest in (
        ('rest gap', rest.std, parameters.largest_rest_gap_std),
        ('contact gap', contact.std, parameters.largest_contact_gap_std),
    ):
        if not std <= largest:
            raise ImpreciseError(
                f'standard deviation of the {name} ({std * 1e6:.2f} um) must not exceed '
                f'{largest * 1e6:.2f} um; the ripple is too noisy: check its sensors, or lengthen '
                'dwell_duration and ramp_duration'
            )


def check_peak_force(table: FloatArray, parameters: InitParameters) -> None:
    """Raise `ContradictionError` unless the table of shape (2, N) reaches a useful normal force."""
    if table[1, -1] < parameters.smallest_peak_force:
        raise ContradictionError(
            f'normal force at {table[0, -1]:.2f} A ({table[1, -1]:.1f} N) must reach '
            f'{parameters.smallest_peak_force:.1f} N; the gaps leave the magnet too weak: check pads and '
            'springs'
        )


def _known_parts(curve: InductanceCurve, rest_current: float) -> Iterator[tuple[str, FloatArray, FloatArray]]:
    """Yield name, currents (A) and inductances (H) of each ramp, without empty bins and those at rest."""
    for name, inductance in (('up', curve.up), ('down', curve.down)):
        known = np.isfinite(inductance) & (curve.current > rest_current)
        if known.sum() < 2:
            raise AmbiguousCurveError(
                f'inductance on the way {name} is known at {int(known.sum())} currents above '
                f'{rest_current:.2f} A, needed are 2; check the ripple sensors'
            )
        yield name, curve.current[known], inductance[known]


def _level_changes(inductance: FloatArray, level: float) -> list[int]:
    """Return the places before which and behind which the inductance lies on different sides of the level."""
    above = inductance > level
    return np.flatnonzero(above[1:] != above[:-1]).tolist()
