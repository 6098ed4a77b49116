"""Fig. 3: how far the ripple's field enters the iron at different currents, in one and in two dimensions."""

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, NamedTuple

import numpy as np
import numpy.typing as npt

from engine_mount.experiments.harness.contract import (
    Experiment,
    Holds,
    Order,
    Outcome,
    Progress,
    Statement,
    Values,
    parameters_of,
)
from engine_mount.experiments.harness.drawing import BLUE, RED, family, finish, new_figure
from engine_mount.experiments.plate_finite_elements import PlateField, plate_field
from engine_mount.experiments.registry import NAMES
from engine_mount.reports.drive.signals import FloatArray
from mount_models.quantity import Quantity
from mount_sim.plant.reluctance import MU_0, ReluctanceActuator, core_field, differential_permeability
from mount_sim.plant.ripple import RippleCoil, diffusion_time, duty, penetration_depth

_TERMS = 2000
"""Terms of the series: they fall with the square of their number, so the rest is below 1e-3 of the first."""


def flux_density_change(
    coil: RippleCoil,
    actuator: ReluctanceActuator,
    current: float,
    permeability: float,
    depth: npt.ArrayLike,
    time: float,
) -> FloatArray:
    """Return by how much the flux density (T) at each `depth` (m) has changed `time` (s) after switching.

    Derived: in a plate of half thickness a, B obeys B_t = B_xx / (mu sigma) with the mean's rate e(t)
    imposed, so B = mean + 2 sum_k (-1)^k cos(k pi x / a) c_k, c_k' = -l_k c_k + e(t), l_k = (k pi)^2 / tau,
    in the periodic steady state; x is counted from the middle. `depth` is counted from the surface, any
    shape; `time` must lie within the positive phase. `permeability` is dB/dH (H/m) at the mean field.
    """
    plus, period = duty(coil, current), coil.pwm_period
    if not 0.0 <= time <= plus * period:
        raise ValueError(
            f'time after switching ({time * 1e6:.1f} us) must lie within the positive phase, 0.0 .. '
            f'{plus * period * 1e6:.1f} us at {current:.2f} A'
        )
    depths = np.asarray(depth, float)
    tau = diffusion_time(coil, permeability)
    number = np.arange(1, _TERMS + 1)
    rates = (number * np.pi) ** 2 / tau
    swing = 2.0 * coil.link_voltage / (actuator.turns * actuator.gap_area)
    # c_k'(0+) = swing (1 - exp(-l (1-D) T)) / (1 - exp(-l T)): what all switchings of the past leave
    slope = swing * np.expm1(-rates * (1.0 - plus) * period) / np.expm1(-rates * period)
    change = slope * -np.expm1(-rates * time) / rates
    # (-1)^k cos(k pi (a - depth) / a) = cos(k pi depth / a)
    shape = np.cos(np.multiply.outer(depths / coil.plate_half_thickness, number * np.pi))
    return np.asarray(swing * (1.0 - plus) * time + 2.0 * shape @ change, np.float64)


def equivalent_depth(depth: FloatArray, change: FloatArray) -> float:
    """Return the depth (m) that would take the whole change at its surface value.

    It is the integral of `change` over its first value; `depth` (m) rises from 0 at the surface to the
    middle of the plate; both of shape (n,).
    """
    return float(np.trapezoid(change, depth) / change[0])


NAME = 'field_penetration'

_POINTS = 1501  # over half a plate


class PenetrationParameters(NamedTuple):
    """Gap, mean currents, and the true actuator with its coil."""

    gap: Annotated[float, Quantity('m', 'gap between the core halves', 2e-4, 6e-4, 'section 3.2')] = 349e-6
    highest_current: Annotated[float, Quantity('A', 'last mean current', 0.1, 3.0, 'Fig. 3')] = 3.0
    current_step: Annotated[float, Quantity('A', 'step of the mean currents, from 0 A', 0.1, 3.0)] = 1.0
    actuator: ReluctanceActuator = ReluctanceActuator()
    coil: RippleCoil = RippleCoil()


@dataclass(frozen=True)
class AtCurrent:
    """Both computations at one mean current; `change` (T) over `depth` (m) is that of one dimension."""

    current: float
    depth: FloatArray
    change: FloatArray
    equivalent_depth: float
    characteristic_depth: float
    permeability: float
    field: 'PlateField'


def run(order: Order, progress: Progress) -> Outcome:
    """Compute the field by the diffusion in a plate and by finite elements, and compare."""
    parameters = parameters_of(order, NAME, PenetrationParameters())
    step = parameters.current_step
    currents = np.arange(0.0, parameters.highest_current + 0.5 * step, step)
    cases = []
    for number, current in enumerate(currents):
        progress(number / currents.size, f'finite elements at {current:g} A')
        cases.append(_at_current(float(current), parameters))
    progress(0.95, 'pictures')
    results = _figures(cases)
    pictures = [
        _draw_section(cases, order.out / 'field_penetration.png'),
        _draw_maps(cases[-1], parameters, order.out / 'field_near_gap.png'),
    ]
    return Outcome(results, pictures, [], _statements(results))


def _at_current(current: float, parameters: PenetrationParameters) -> AtCurrent:

    actuator, coil = parameters.actuator, parameters.coil
    permeability = differential_permeability(actuator, core_field(actuator, current, parameters.gap))
    depth = np.linspace(0.0, coil.plate_half_thickness, _POINTS)
    change = flux_density_change(coil, actuator, current, permeability, depth, coil.sample_delay)
    return AtCurrent(
        current=current,
        depth=depth,
        change=change,
        equivalent_depth=equivalent_depth(depth, change),
        characteristic_depth=float(penetration_depth(coil, permeability)),
        permeability=float(permeability / MU_0),
        field=plate_field(coil, actuator, current, parameters.gap),
    )


def _figures(cases: list[AtCurrent]) -> Values:
    return {
        'currents_a': [case.current for case in cases],
        'relative_permeability': [case.permeability for case in cases],
        'characteristic_depth_m': [case.characteristic_depth for case in cases],
        'equivalent_depth_m': [case.equivalent_depth for case in cases],
        'equivalent_depth_2d_m': [case.field.equivalent_depth for case in cases],
        'path_depth_2d_m': [case.field.path_depth for case in cases],
        'difference_in_middle': [case.field.equivalent_depth / case.equivalent_depth - 1.0 for case in cases],
        'difference_along_plate': [case.field.path_depth / case.equivalent_depth - 1.0 for case in cases],
        'profile_rms_difference': [_profile_difference(case) for case in cases],
        'drift_2d': [case.field.drift for case in cases],
    }


def _profile_difference(case: AtCurrent) -> float:
    """Return the rms difference of both profiles over the thickness, as a share of the surface value."""
    other = np.interp(case.depth, case.field.depth, case.field.change)
    return float(np.sqrt(np.mean((other - case.change) ** 2)) / case.change[0])


def _draw_section(cases: list[AtCurrent], file: Path) -> Path:
    figure = new_figure('Change of flux density from switching to the sample, 18 us later (Fig. 3, below)')
    left, middle, right = figure.subplots(1, 3, width_ratios=(3, 3, 2.4))
    for case, colour in zip(cases, family(len(cases)), strict=True):
        for axes, factor in ((left, 1.0 / case.change[0]), (middle, 1e3)):
            axes.plot(1e6 * case.depth, factor * case.change, color=colour, label=f'{case.current:g} A')
            axes.plot(1e6 * case.field.depth, factor * case.field.change, '.', color=colour, markersize=5)
    left.set_xlim(0.0, 1e6 * cases[0].depth[-1])
    middle.set_xlim(0.0, 300.0)
    left.plot([], [], '.', color='black', label='finite elements')
    left.plot([], [], color='black', label='diffusion, one dimension')
    for axes in (left, middle):
        axes.set_xlabel('depth from the surface (µm)')
    left.set_ylabel('change over its value at the surface (1)')
    middle.set_ylabel('change of flux density (mT)')
    left.set_title('half a plate', fontsize='medium')
    middle.set_title('near the surface', fontsize='medium')
    current = [case.current for case in cases]
    right.plot(
        current, [1e6 * case.equivalent_depth for case in cases], 'o-', color=BLUE, label='one dimension'
    )
    right.plot(
        current,
        [1e6 * case.field.equivalent_depth for case in cases],
        's',
        color=RED,
        label='finite elements',
    )
    right.set_yscale('log')
    right.yaxis.set_major_formatter('{x:g}')
    right.yaxis.set_minor_formatter('{x:g}')
    right.set_xlabel('mean current (A)')
    right.set_ylabel('equivalent depth (µm)')
    right.legend(fontsize='small')
    figure.legend(*left.get_legend_handles_labels(), loc='outside lower center', ncols=6, fontsize='small')
    return finish(figure, file)


def _draw_maps(case: AtCurrent, parameters: PenetrationParameters, file: Path) -> Path:
    figure = new_figure(
        f'Half a plate near its air gap at {case.current:g} A, finite elements (Fig. 3, above)'
    )
    half = 1e3 * parameters.coil.plate_half_thickness
    edge = 0.5e3 * (parameters.gap + parameters.actuator.residual_gap)
    panels = (
        ('total field', case.field.steady, 'flux density (T)', 1.0),
        ('alternating part, from switching to the sample', case.field.alternating, 'flux density (mT)', 1e3),
    )
    for axes, (title, density, label, factor) in zip(figure.subplots(1, 2), panels, strict=True):
        shown = axes.pcolormesh(
            1e3 * case.field.x, 1e3 * case.field.y, factor * density, cmap='viridis', shading='gouraud'
        )
        figure.colorbar(shown, ax=axes, label=label)
        axes.plot([0.0, half, half], [edge, edge, 4.0], color='white', linewidth=1.2)
        axes.set_xlim(1e3 * case.field.x[0], 3.0)
        axes.set_ylim(1e3 * case.field.y[0], 3.0)
        axes.set_title(title, fontsize='medium')
        axes.set_xlabel('from the middle of the plate (mm)')
        axes.set_ylabel('from the middle of the gap (mm)')
    return finish(figure, file)


def _statements(results: Values) -> list[Statement]:
    depth, other = results['equivalent_depth_m'], results['equivalent_depth_2d_m']
    middle, along = results['difference_in_middle'], results['difference_along_plate']
    currents = results['currents_a']
    rising = all((np.diff(values) > 0.0).all() for values in (depth, other))
    rate = results['characteristic_depth_m'][0] / 18e-6
    return [
        Statement(
            'Sec. 3.2',
            'The ripples move the field only near the surface of the iron; it enters at a rate in the '
            'region of um per us.',
            f'At {currents[0]:g} A the field has come {1e6 * results["characteristic_depth_m"][0]:.0f} um '
            f'in 18 us, {rate:.1f} um per us on average; conductivity and plates are chosen.',
            Holds.YES if 0.1 < rate < 10.0 else Holds.NO,
        ),
        Statement(
            'Fig. 3, below',
            'The field enters much faster at a higher mean current, because saturation lowers the '
            'permeability.',
            'The depth that would hold the whole change at its surface value grows from '
            f'{1e6 * depth[0]:.0f} um at {currents[0]:g} A to {1e6 * depth[-1]:.0f} um at {currents[-1]:g} '
            f'A in one dimension, from {1e6 * other[0]:.0f} to {1e6 * other[-1]:.0f} um with finite '
            'elements.',
            Holds.YES if rising and depth[-1] > 3.0 * depth[0] else Holds.NO,
        ),
        Statement(
            'Fig. 3',
            'The authors computed the field by finite elements.',
            'Here by finite elements in the plane of one plate with gap, air and winding, as a check of the '
            'one-dimensional diffusion that the simulated coil uses. Equivalent depth against one dimension, '
            f'in the middle of the plate: {_told(currents, middle)}; averaged along the plate: '
            f'{_told(currents, along)}. Geometry of core and winding are chosen, so the pictures cannot be '
            "laid over the authors'.",
            Holds.NOT_COMPARABLE,
        ),
    ]


def _told(currents: list[float], differences: list[float]) -> str:
    return ', '.join(
        f'{100 * difference:+.1f} % at {current:g} A'
        for current, difference in zip(currents, differences, strict=True)
    )


EXPERIMENT = Experiment(
    NAME,
    *NAMES[NAME],
    (
        'Lines: diffusion into a plate in one dimension with the permeability of the mean current, in the '
        'periodic state of the switched bridge. Dots: the same from a finite-element computation in two '
        'dimensions (scikit-fem, mesh of this project): nonlinear steady field of one plate with its air '
        'gap, then the alternating field about it with eddy currents. Both are driven with the same mean '
        'flux in the middle of the plate: what is checked is the diffusion into the plate, not the flux '
        'that passes by it, which at saturation is a large part of what the winding sees.'
    ),
    PenetrationParameters(),
    run,
)
