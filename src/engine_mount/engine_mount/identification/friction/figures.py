"""All that an identification found, as plain numbers and texts."""

import math
from collections.abc import Sequence
from dataclasses import asdict
from typing import Any

from engine_mount.identification.friction.found import Identification, mean_ladder
from engine_mount.identification.friction.ladder import Rung, best_rung
from engine_mount.identification.friction.looks.cases import explained, ladder_case
from engine_mount.identification.friction.steps.ramp_hold import RampHoldFit


def figures(found: Identification) -> dict[str, Any]:
    """Return everything as plain numbers and texts, for JSON."""
    result: dict[str, Any] = {'recordings': found.recordings, 'notes': found.notes}
    if found.looks:
        result['looks'] = {name: asdict(look) for name, look in found.looks.items()}
    if found.ramps:
        result['step_1'] = [_ramp_figures(fit) for _, fit in found.ramps]
    if found.contact is not None:
        result['contact'] = found.contact._asdict()
    if found.lines:
        result['lines'] = [
            {
                'recording': line.recording, 'velocity': line.velocity, 'normal_force': line.normal_force,
                'a': line.a, 'a_interval': line.a_interval, 'b_per_mm': 1e-3 * line.b,
                'b_interval_per_mm': 1e-3 * line.b_interval,
            }
            for line in found.lines
        ]  # fmt: skip
    if found.coefficients is not None:
        result['coefficients'] = found.coefficients._asdict()
        result['variants'] = {
            fit.variant: {'held_out_error': _known(error), 'a_rms': fit.a_rms, 'b_rms_per_mm': fit.b_rms_mm}
            for fit, error in found.fits
        }
    if found.validations:
        result['validation'] = [
            {
                'recording': each.name,
                'full_error': each.full_error,
                'simplified_error': each.simplified_error,
                'full_macroslip_error': each.full_macroslip,
                'simplified_macroslip_error': each.simplified_macroslip,
            }
            for _, each in found.validations
        ]
    if found.rungs:
        result['ladder'] = _ladder(found.rungs)
        result['best'] = best_rung(found.rungs).law.name
    if found.pairs:
        result['pairs'] = [
            {'train': pair.train, 'held_out': pair.held_out, 'ladder': _ladder(pair.rungs)}
            for pair in found.pairs
        ]
        result['ladder'] = mean_ladder(found.pairs)
        result['best'] = min(result['ladder'], key=lambda name: result['ladder'][name]['held_out_error'])
    cases = [*found.cases, *([case] if (case := ladder_case(result.get('ladder', {}))) else [])]
    result['cases'] = [asdict(case) for case in cases]
    return result


def _ladder(rungs: Sequence[Rung]) -> dict[str, dict[str, Any]]:
    return {
        each.law.name: {
            'train_error': each.train_error,
            'held_out_error': _known(each.held_out_error),
            'explained': explained(
                each.train_error if math.isnan(each.held_out_error) else each.held_out_error
            ),
            'parameters': each.named_values,
            'units': {entry.name: entry.quantity.unit for entry in each.law.parameters},
            'seconds': each.seconds,
            'out_of_time': each.out_of_time,
        }
        for each in rungs
    }


def _ramp_figures(fit: RampHoldFit) -> dict[str, Any]:
    printed = fit.printed
    c_r, d_r, c_re = fit.contact
    return {
        'recording': fit.name,
        'contact': fit.contact._asdict(),
        'deviation': fit.deviation._asdict(),
        'machine_stiffness': fit.machine_stiffness,
        'time_constant': fit.time_constant,
        'kappa': fit.kappa,
        'ramp_start': fit.ramp_start,
        'ramp_time': fit.ramp_time,
        'force_misfit': fit.force_misfit,
        'displacement_misfit': fit.displacement_misfit,
        'printed': {
            'contact_stiffness': _beside(printed.contact_stiffness, c_re),
            'tangential_stiffness_c_xi_with_p': _beside(printed.tangential_stiffness_with_p, c_r),
            'tangential_stiffness_c_xi_without_p': _beside(printed.tangential_stiffness_without_p, c_r),
            'tangential_damping': _beside(printed.tangential_damping, d_r),
        },
    }


def _beside(printed: float, right: float) -> dict[str, float]:
    return {'value': printed, 'error': printed / right - 1.0}


def _known(value: float) -> float | None:
    return None if math.isnan(value) else value
