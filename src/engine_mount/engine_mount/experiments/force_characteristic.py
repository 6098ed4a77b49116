"""Fig. 2: force of the true actuator over current at several gaps, beside the law that was fitted to it."""

from pathlib import Path
from typing import Annotated, Any, NamedTuple

import numpy as np

from engine_mount.experiments.harness.contract import (
    Experiment,
    Holds,
    Order,
    Outcome,
    Progress,
    Seed,
    Statement,
    Values,
    parameters_of,
)
from engine_mount.experiments.harness.drawing import GREY, family, finish, new_figure
from engine_mount.experiments.harness.fixed_gaps import RigMeasurements, RigNoise, measure_actuator
from engine_mount.experiments.registry import NAMES
from mount_models.actuator.law import TABLE_1, check_gap, checked_force
from mount_models.quantity import OutsideLawError, Quantity
from mount_models.sampling import HIGHEST_CURRENT
from mount_models.specimen import Specimen, default_specimen
from mount_sim.plant.reluctance import ReluctanceActuator, core_flux_density
from mount_sim.plant.ripple import RippleCoil

NAME = 'force_characteristic'

_GAPS_UM = (275.0, 300.0, 349.0, 400.0, 450.0, 492.0, 545.0)
_CURRENTS = np.linspace(0.0, HIGHEST_CURRENT, 61)
_WEIGHED = 20.0  # N: relative errors count from here, as for the fit of the specimen


class ForceParameters(NamedTuple):
    """The load cell of the rig and the true actuator on it."""

    force_noise: Annotated[float, Quantity('N', 'standard deviation of the load cell', 0.0, 20.0)] = 0.5
    seed: Seed = 1
    actuator: ReluctanceActuator = ReluctanceActuator()


def run(order: Order, progress: Progress) -> Outcome:
    """Measure the force at held gaps and compare it with the specimen's law and with Table 1."""
    parameters = parameters_of(order, NAME, ForceParameters())
    progress(0.1, 'measuring the actuator')
    gaps = 1e-6 * np.array(_GAPS_UM)
    noise = RigNoise(force=parameters.force_noise, seed=parameters.seed)
    measured = measure_actuator(parameters.actuator, RippleCoil(), gaps, _CURRENTS, noise)
    progress(0.6, 'comparing with the laws')
    specimen = default_specimen()
    results = _figures(measured, specimen, parameters)
    picture = _draw(measured, specimen, order.out / 'force_characteristic.png')
    return Outcome(results, [picture], [], _statements(results))


def _figures(measured: RigMeasurements, specimen: Specimen, parameters: ForceParameters) -> Values:
    true = measure_actuator(parameters.actuator, RippleCoil(), measured.gaps, measured.currents)
    counted = measured.currents >= 0.1 - 1e-9
    law = checked_force(specimen.force_law, measured.currents, measured.gaps[:, np.newaxis])
    error = (law - true.force)[:, counted]
    strong = true.force[:, counted] > _WEIGHED
    relative = error[strong] / true.force[:, counted][strong]
    inside = [k for k, gap in enumerate(measured.gaps) if _within_table_1(gap)]
    printed = checked_force(TABLE_1, measured.currents, measured.gaps[inside, np.newaxis])
    table_error = (printed - true.force[inside])[:, counted]
    middle = int(np.argmin(np.abs(measured.gaps - 349e-6)))
    exponent = _slope_of_logarithms(measured.currents, true.force[middle], 0.2, 0.8)
    knee = _knee_current(measured.currents, true.force[middle])
    high = measured.currents >= 2.25
    line = np.polyfit(measured.currents[high], true.force[middle, high], 1)
    bend = true.force[middle, high] - np.polyval(line, measured.currents[high])
    current = int(np.argmin(np.abs(measured.currents - 1.0)))
    return {
        'gaps_m': measured.gaps.tolist(),
        'law_rms_error_n': _rms(error),
        'law_largest_error_n': float(np.abs(error).max()),
        'law_relative_rms': _rms(relative),
        'law_relative_worst': float(np.abs(relative).max()),
        'table_1_rms_error_n': _rms(table_error),
        'table_1_largest_error_n': float(np.abs(table_error).max()),
        'exponent_at_low_current': exponent,
        'steepest_current_a': knee,
        'flux_density_there_t': float(core_flux_density(parameters.actuator, knee, measured.gaps[middle])),
        'bend_of_upper_part': float(np.abs(bend).max() / true.force[middle, -1]),
        'force_at_1_a_n': {
            f'{gap * 1e6:.0f} um': float(force)
            for gap, force in zip(true.gaps, true.force[:, current], strict=True)
        },
    }


def _draw(measured: RigMeasurements, specimen: Specimen, file: Path) -> Path:
    figure = new_figure(
        'Force over current at held gaps: measured on the true actuator, and laws (Fig. 2)', 6.0
    )
    axes = figure.subplots()
    fine = np.linspace(0.0, HIGHEST_CURRENT, 301)
    for gap, force, colour in zip(measured.gaps, measured.force, family(measured.gaps.size), strict=True):
        axes.plot(measured.currents, force, '.', color=colour, markersize=5)
        axes.plot(
            fine, checked_force(specimen.force_law, fine, gap), color=colour, linewidth=1.2,
            label=f'{gap * 1e6:.0f} µm',
        )  # fmt: skip
        if _within_table_1(gap):
            axes.plot(fine, checked_force(TABLE_1, fine, gap), color=colour, linewidth=0.8, linestyle='--')
    axes.plot([], [], '.', color=GREY, label='measured')
    axes.plot([], [], color=GREY, linewidth=1.2, label='Eqs (3), (4), fitted to this actuator')
    axes.plot([], [], color=GREY, linewidth=0.8, linestyle='--', label="Table 1, the authors' actuator")
    axes.set_xlabel('coil current (A)')
    axes.set_ylabel('magnetic force (N)')
    axes.legend(fontsize='small', title='gap between the core halves', ncols=2)
    return finish(figure, file)


def _statements(results: Values) -> list[Statement]:
    forces = list(results['force_at_1_a_n'].items())
    exponent, bend = results['exponent_at_low_current'], results['bend_of_upper_part']
    return [
        Statement(
            'Sec. 3',
            'At low flux density the force is a quadratic function of the current.',
            f'Between 0.2 and 0.8 A, 349 um, the force grows with the power {exponent:.2f} of the current.',
            Holds.YES if abs(exponent - 2.0) < 0.05 else Holds.PARTLY,
        ),
        Statement(
            'Sec. 3',
            'The iron saturates at about 1.4 T; towards higher currents the curve becomes a straight line.',
            f'The curve at 349 um is steepest at {results["steepest_current_a"]:.2f} A, where the core has '
            f'{results["flux_density_there_t"]:.2f} T; above 2.25 A it leaves a straight line by at most '
            f'{100 * bend:.1f} % of its end. The core was fitted to Table 1, so this is built in.',
            Holds.YES if bend < 0.03 else Holds.PARTLY,
        ),
        Statement(
            'Fig. 2',
            'The influence of the gap cannot be neglected.',
            f'At 1 A the force is {forces[0][1]:.0f} N at {forces[0][0]} and {forces[-1][1]:.0f} N '
            f'at {forces[-1][0]}.',
            Holds.YES if forces[0][1] > 1.5 * forces[-1][1] else Holds.NO,
        ),
        Statement(
            'Sec. 3.1, Eqs (3), (4)',
            'One nonlinear function with 18 parameters replaces the large lookup table.',
            'Fitted to other gaps than most of these, it meets the true force within '
            f'{100 * results["law_relative_rms"]:.2f} % rms and {100 * results["law_relative_worst"]:.1f} % '
            f'at worst above {_WEIGHED:g} N ({results["law_rms_error_n"]:.2f} N rms, '
            f'{results["law_largest_error_n"]:.1f} N at worst, from 0.1 A on).',
            Holds.YES if results['law_relative_rms'] < 0.01 else Holds.NO,
        ),
        Statement(
            'Table 1',
            'Its 18 numbers describe the force of the prototype.',
            'The simulated actuator was fitted to Table 1 and differs from it by '
            f'{results["table_1_rms_error_n"]:.1f} N rms and {results["table_1_largest_error_n"]:.0f} N at '
            'worst (300 .. 492 um): no single magnetisation curve bends as sharply. So the controller uses '
            'the law fitted to the actuator it drives.',
            Holds.NOT_COMPARABLE,
        ),
    ]


def _within_table_1(gap: float) -> bool:
    """Return whether Table 1 holds at `gap` (m), and the specimen's fit was far from its ends."""
    try:
        check_gap(TABLE_1, gap)
    except OutsideLawError:
        return False
    return gap >= 300e-6 - 1e-12


def _slope_of_logarithms(current: Any, force: Any, low: float, high: float) -> float:
    chosen = (current >= low) & (current <= high)
    return float(np.polyfit(np.log(current[chosen]), np.log(force[chosen]), 1)[0])


def _knee_current(current: Any, force: Any) -> float:
    """Return the current (A) at which the force rises fastest: there the parabola ends."""
    return float(current[int(np.argmax(np.gradient(force, current)))])


def _rms(values: Any) -> float:
    return float(np.sqrt(np.mean(np.square(values))))


EXPERIMENT = Experiment(
    NAME,
    *NAMES[NAME],
    (
        'The gap of the simulated actuator is held, the current stepped, the force measured with a noisy '
        'load cell (dots). Solid lines are the law of the shipped specimen, Eqs (3), (4) fitted to a '
        'calibration at 10 um steps without noise; dashed ones are Table 1. Errors are taken against the '
        'force without noise.'
    ),
    ForceParameters(),
    run,
)
