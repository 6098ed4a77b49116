"""What `mount_init` says of its result on `/diagnostics`; a pure function of figures."""

import math
from typing import NamedTuple

from mount_init.initialisation import InitialisationResult
from mount_init.parameters import InitParameters
from mount_models.specimen import Specimen
from mount_ros.nodes.diagnostics import WINDOW, Finding, Level, Verdict, verdict_on

_WEAR_RESERVE = 10e-6  # m, chosen: early enough to order pads
_SKIPPED_SHARE = 0.02  # chosen
_OF_LIMIT = 0.5  # chosen: a standard deviation this near to its limit is worth a look


class InitFigures(NamedTuple):
    """The latched result, the stamp (ns) of its last sample, and messages that could not be read."""

    result: InitialisationResult
    last_stamp: int
    malformed: int
    malformed_reason: str
    malformed_lately: int  # of them, within the window


def verdict(figures: InitFigures, specimen: Specimen, parameters: InitParameters) -> Verdict:
    """Return level, sentence and figures for an active node, which always has a result."""
    result = figures.result
    level, sentence = _judge(result, specimen, parameters)
    told = {
        'rest_gap_um': f'{result.rest_gap * 1e6:.2f}',
        'contact_gap_um': f'{result.contact_gap * 1e6:.2f}',
        'rest_gap_std_um': f'{result.rest_gap_std * 1e6:.2f}',
        'contact_gap_std_um': f'{result.contact_gap_std * 1e6:.2f}',
        'contact_force_N': f'{result.contact_force:.2f}',
        'offset_current_A': f'{result.offset_current:.4f}',
        'highest_normal_force_N': f'{result.table[1, -1]:.1f}',
        'coil_temperature_celsius': f'{result.evidence.temperature.celsius:.1f}',
        'coil_temperature_from': result.evidence.temperature.source.value,
        'resistance_ohm': f'{result.evidence.supply.whole.ohm:.3f}',
        'resistance_std_ohm': f'{result.evidence.supply.whole.std:.4f}',
        'link_voltage_V': f'{result.evidence.supply.whole.link_voltage:.2f}',
        'link_voltage_lowest_V': f'{result.evidence.supply.lowest:.2f}',
        'link_voltage_highest_V': f'{result.evidence.supply.highest:.2f}',
        'carried_to_voltage_of_curves': result.evidence.supply.carried,
        'wear_reserve_um': f'{wear_reserve(result, specimen) * 1e6:.1f}',
        'samples_used': result.evidence.samples,
        'samples_invalid': result.evidence.skipped,
        'messages_malformed': figures.malformed,
        'last_stamp': figures.last_stamp,
    }
    found = [Finding(level, 'result', sentence)] if level is not Level.OK else []
    if figures.malformed_lately:
        malformed = f'{figures.malformed_lately} messages could not be read (limit: none in {WINDOW:g} s)'
        found.append(Finding(Level.WARN, 'malformed', f'{malformed}; {figures.malformed_reason}'))
    return verdict_on(found, sentence, told)


def wear_reserve(result: InitialisationResult, specimen: Specimen) -> float:
    """Return how much (m) the pads may wear before the pressed gap leaves the range of the force law."""
    pressed_gap = result.contact_gap - result.table[1, -1] / specimen.pad_stiffness
    return float(pressed_gap - specimen.force_law.gap_low)


def _judge(result: InitialisationResult, specimen: Specimen, parameters: InitParameters) -> tuple[Level, str]:
    reserve = wear_reserve(result, specimen)
    if reserve < _WEAR_RESERVE:
        return Level.WARN, (
            f'pads are nearly worn: {reserve * 1e6:.1f} um until the gap leaves the calibrated range, less '
            f'than {_WEAR_RESERVE * 1e6:.0f} um; replace the pads'
        )
    for name, std, largest in (
        ('rest gap', result.rest_gap_std, parameters.largest_rest_gap_std),
        ('contact gap', result.contact_gap_std, parameters.largest_contact_gap_std),
    ):
        if std > _OF_LIMIT * largest:
            return Level.WARN, (
                f'standard deviation of the {name} ({std * 1e6:.2f} um) is more than half of its limit '
                f'{largest * 1e6:.2f} um; check the ripple sensors'
            )
    total = result.evidence.samples + result.evidence.skipped
    if result.evidence.skipped > _SKIPPED_SHARE * total:
        return Level.WARN, (
            f'{result.evidence.skipped} of {total} ripple samples were invalid, more than '
            f'{_SKIPPED_SHARE:.0%}; check the coil ripple measurement'
        )
    gaps = (
        f'rest gap {result.rest_gap * 1e6:.1f} um, contact gap {result.contact_gap * 1e6:.1f} um, '
        f'offset current {result.offset_current:.3f} A'
    )
    if specimen.temperature is not None and math.isnan(result.evidence.temperature.celsius):
        return Level.WARN, (
            f'{gaps}; not compensated for the coil temperature, which is unknown: right at '
            f'{specimen.temperature.calibration_celsius:.0f} degC only; do the electronics report it '
            '(topic coil_temperature)? Else set coil_temperature_celsius'
        )
    return Level.OK, gaps
