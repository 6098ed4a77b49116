"""Fig. 3: how far the ripple's field enters the iron at different currents, in one and in two dimensions."""

from typing import Annotated, Any, NamedTuple

import numpy as np
import numpy.typing as npt

from engine_mount.experiments.harness.drawing import BLUE, RED, family, legend_below, new_panels
from engine_mount.experiments.harness.experiment import (
    NOT_COMPARABLE,
    Experiment,
    Findings,
    Order,
    Values,
    claim,
)
from engine_mount.experiments.plate_finite_elements import PlateField, plate_field
from engine_mount.reports.drive.signals import FloatArray
from mount_models.quantity import Quantity
from mount_sim.plant.reluctance import MU_0, ReluctanceActuator, core_field, differential_permeability
from mount_sim.plant.ripple import RippleCoil, diffusion_time, duty, penetration_depth

NAME = 'field_penetration'
_TERMS = 2000
"""Terms of the series: they fall with the square of their number, so the rest is below 1e-3 of the first."""
_POINTS = 1501  # over half a plate


class PenetrationParameters(NamedTuple):
    """Gap, mean currents, and the true actuator with its coil."""

    gap: Annotated[float, Quantity('m', 'gap between the core halves', 2e-4, 6e-4, 'section 3.2')] = 349e-6
    highest_current: Annotated[float, Quantity('A', 'last mean current', 0.1, 3.0, 'Fig. 3')] = 3.0
    current_step: Annotated[float, Quantity('A', 'step of the mean currents, from 0 A', 0.1, 3.0)] = 1.0
    actuator: ReluctanceActuator = ReluctanceActuator()
    coil: RippleCoil = RippleCoil()


class AtCurrent(NamedTuple):
    """Both computations at one mean current; `change` (T) over `depth` (m) is that of one dimension."""

    current: float
    depth: FloatArray
    change: FloatArray
    equivalent_depth: float
    characteristic_depth: float
    permeability: float
    field: PlateField


def run(order: Order) -> Findings:
    """Compute the field by the diffusion in a plate and by finite elements, and compare."""
    own, cases = order.parameters, []
    step = own.current_step
    currents = np.arange(0.0, own.highest_current + 0.5 * step, step).tolist()
    for number, current in enumerate(currents):
        order.progress(number / len(currents), f'finite elements at {current:g} A')
        cases.append(at_current(current, own))
    pictures = {NAME: draw_section(cases), 'field_near_gap': draw_maps(cases[-1], own)}
    return Findings(figures_of(cases), pictures)


def at_current(current: float, own: PenetrationParameters) -> AtCurrent:
    """Return both computations at a mean current (A)."""
    permeability = differential_permeability(own.actuator, core_field(own.actuator, current, own.gap))
    depth = np.linspace(0.0, own.coil.plate_half_thickness, _POINTS)
    delay = own.coil.sample_delay
    change = flux_density_change(own.coil, own.actuator, current, permeability, depth, delay)
    return AtCurrent(
        current,
        depth,
        change,
        equivalent_depth(depth, change),
        float(penetration_depth(own.coil, permeability)),
        float(permeability / MU_0),
        plate_field(own.coil, own.actuator, current, own.gap),
    )


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
    number = np.arange(1, _TERMS + 1)
    rates = (number * np.pi) ** 2 / diffusion_time(coil, permeability)
    swing = 2.0 * coil.link_voltage / (actuator.turns * actuator.gap_area)
    # c_k'(0+) = swing (1 - exp(-l (1-D) T)) / (1 - exp(-l T)): what all switchings of the past leave
    slope = swing * np.expm1(-rates * (1.0 - plus) * period) / np.expm1(-rates * period)
    change = slope * -np.expm1(-rates * time) / rates
    # (-1)^k cos(k pi (a - depth) / a) = cos(k pi depth / a)
    shape = np.cos(np.multiply.outer(np.asarray(depth, float) / coil.plate_half_thickness, number * np.pi))
    return np.asarray(swing * (1.0 - plus) * time + 2.0 * shape @ change, np.float64)


def equivalent_depth(depth: FloatArray, change: FloatArray) -> float:
    """Return the depth (m) that would take the whole change at its surface value.

    It is the integral of `change` over its first value; `depth` (m) rises from 0 at the surface to the
    middle of the plate; both of shape (n,).
    """
    return float(np.trapezoid(change, depth) / change[0])


def figures_of(cases: list[AtCurrent]) -> Values:
    """Return depths by both computations, and by how much they differ; lists over the currents."""
    return {
        'currents_a': [case.current for case in cases],
        'relative_permeability': [case.permeability for case in cases],
        'characteristic_depth_m': [case.characteristic_depth for case in cases],
        'equivalent_depth_m': [case.equivalent_depth for case in cases],
        'equivalent_depth_2d_m': [case.field.equivalent_depth for case in cases],
        'difference_in_middle': [case.field.equivalent_depth / case.equivalent_depth - 1.0 for case in cases],
    }


@claim(
    'Sec. 3.2',
    paper="""The ripples move the field only near the surface of the iron; it enters at a rate in the
    region of um per us.""",
)
def _on_rate(figures):
    depth = 1e6 * figures['characteristic_depth_m'][0]
    rate = depth / 18.0
    told = f"""At {figures['currents_a'][0]:g} A the field has come {depth:.0f} um in 18 us, {rate:.1f} um per
        us on average; conductivity and plates are chosen."""
    return 0.1 < rate < 10.0, told


@claim(
    'Fig. 3, below',
    paper="""The field enters much faster at a higher mean current, because saturation lowers the
    permeability.""",
)
def _on_saturation(figures):
    depth, other = (1e6 * np.array(figures[f'equivalent_depth{kind}_m']) for kind in ('', '_2d'))
    currents = figures['currents_a']
    told = f"""The depth that would hold the whole change at its surface value grows from {depth[0]:.0f} um
        at {currents[0]:g} A to {depth[-1]:.0f} um at {currents[-1]:g} A in one dimension, from
        {other[0]:.0f} to {other[-1]:.0f} um with finite elements."""
    return (np.diff([depth, other]) > 0.0).all() and depth[-1] > 3.0 * depth[0], told


@claim('Fig. 3', paper='The authors computed the field by finite elements.')
def _on_finite_elements(figures):
    middle = ', '.join(
        f'{100 * difference:+.1f} % at {current:g} A'
        for current, difference in zip(figures['currents_a'], figures['difference_in_middle'], strict=True)
    )
    told = f"""Here by finite elements in the plane of one plate with gap, air and winding, as a check of the
        one-dimensional diffusion that the simulated coil uses. Equivalent depth against one dimension, in
        the middle of the plate: {middle}. Geometry of core and winding are chosen, so the pictures cannot be
        laid over the authors'."""
    return NOT_COMPARABLE, told


def draw_section(cases: list[AtCurrent]) -> Any:
    """Draw the alternating field over the depth, and the equivalent depth over the current, Fig. 3 below."""
    figure, (left, middle, right) = new_panels(
        'Change of flux density from switching to the sample, 18 us later (Fig. 3, below)',
        1,
        3,
        width_ratios=(3, 3, 2.4),
    )
    for case, colour in zip(cases, family(len(cases)), strict=True):
        for axes, factor in ((left, 1.0 / case.change[0]), (middle, 1e3)):
            axes.plot(1e6 * case.depth, factor * case.change, color=colour, label=f'{case.current:g} A')
            axes.plot(1e6 * case.field.depth, factor * case.field.change, '.', color=colour, markersize=5)
    left.plot([], [], '.', color='black', label='finite elements')
    left.plot([], [], color='black', label='diffusion, one dimension')
    depth = 'depth from the surface (µm)'
    left.set(
        xlim=(0.0, 1e6 * cases[0].depth[-1]), xlabel=depth, ylabel='change over its value at the surface (1)'
    )
    middle.set(xlim=(0.0, 300.0), xlabel=depth, ylabel='change of flux density (mT)')
    left.set_title('half a plate', fontsize='medium')
    middle.set_title('near the surface', fontsize='medium')
    current = [case.current for case in cases]
    one = [1e6 * case.equivalent_depth for case in cases]
    right.plot(current, one, 'o-', color=BLUE, label='one dimension')
    two = [1e6 * case.field.equivalent_depth for case in cases]
    right.plot(current, two, 's', color=RED, label='finite elements')
    right.set(yscale='log', xlabel='mean current (A)', ylabel='equivalent depth (µm)')
    right.yaxis.set_major_formatter('{x:g}')
    right.yaxis.set_minor_formatter('{x:g}')
    right.legend(fontsize='small')
    legend_below(figure, left, 6, fontsize='small')
    return figure


def draw_maps(case: AtCurrent, own: PenetrationParameters) -> Any:
    """Draw total and alternating field near the gap, Fig. 3 above."""
    figure, panels = new_panels(
        f'Half a plate near its air gap at {case.current:g} A, finite elements (Fig. 3, above)', 1, 2
    )
    half = 1e3 * own.coil.plate_half_thickness
    edge = 0.5e3 * (own.gap + own.actuator.residual_gap)
    x, y = 1e3 * case.field.x, 1e3 * case.field.y
    for axes, title, density, unit in (
        (panels[0], 'total field', case.field.steady, 'T'),
        (panels[1], 'alternating part, from switching to the sample', 1e3 * case.field.alternating, 'mT'),
    ):
        shown = axes.pcolormesh(x, y, density, cmap='viridis', shading='gouraud')
        figure.colorbar(shown, ax=axes, label=f'flux density ({unit})')
        axes.plot([0.0, half, half], [edge, edge, 4.0], color='white', linewidth=1.2)
        axes.set_title(title, fontsize='medium')
        axes.set(
            xlim=(x[0], 3.0),
            ylim=(y[0], 3.0),
            xlabel='from the middle of the plate (mm)',
            ylabel='from the middle of the gap (mm)',
        )
    return figure


EXPERIMENT = Experiment(
    NAME,
    """Lines: diffusion into a plate in one dimension with the permeability of the mean current, in the
    periodic state of the switched bridge. Dots: the same from a finite-element computation in two
    dimensions (scikit-fem, mesh of this project): nonlinear steady field of one plate with its air
    gap, then the alternating field about it with eddy currents. Both are driven with the same mean flux in
    the middle of the plate. The check covers the diffusion into the plate, not the flux beside the plate,
    which at saturation is a large part of the winding's flux.""",
    PenetrationParameters(),
    run,
)
