"""Fig. 4: incremental inductance over current, at held gaps and on the assembled actuator; its sections."""

from typing import Annotated, Any, NamedTuple

import numpy as np

from engine_mount.drives.drive import drive
from engine_mount.experiments.harness.drawing import BLUE, RED, family, new_mosaic
from engine_mount.experiments.harness.experiment import (
    PARTLY,
    Experiment,
    Findings,
    Order,
    Seed,
    Values,
    claim,
)
from engine_mount.experiments.harness.rack_recording import (
    RIG_CURRENTS,
    RIG_GAPS,
    RigMeasurements,
    measure_actuator,
)
from engine_mount.recordings.recording import Recording, open_recording
from engine_mount.reports.drive.signals import FloatArray
from mount_models.coil.crossing import find_crossing
from mount_models.coil.gap import (
    crossing_current_from_gap,
    gap_from_crossing_current,
    inductance_from_gap,
    measured_inductance,
    rest_gap_from_inductance,
)
from mount_models.quantity import Quantity, flattened
from mount_models.specimen import Specimen, default_specimen
from mount_sim.plant.closing import ClosingMechanics, closed_state
from mount_sim.plant.reluctance import ReluctanceActuator
from mount_sim.plant.ripple import RippleCoil

NAME = 'inductance_map'
_GAPS_UM = (260.0, 300.0, 349.0, 400.0, 450.0, 492.0, 540.0)
_AVERAGED = 50  # ripples for each point of the rig, 10 ms
_BIN = 0.04  # A: width within which the ramp is averaged for the drawing
_DWELL = 0.005  # A: this near to 0.2 A counts as rest


class InductanceParameters(NamedTuple):
    """Noise of one ripple, and the true actuator with its coil, springs and pads."""

    ripple_noise: Annotated[
        float, Quantity('1', 'relative standard deviation of the slopes of one ripple', 0.0, 0.5)
    ] = 0.01
    seed: Seed = 1
    actuator: ReluctanceActuator = ReluctanceActuator()
    coil: RippleCoil = RippleCoil()
    mechanics: ClosingMechanics = ClosingMechanics()


class Ramp(NamedTuple):
    """The ripples of a current ramp, (n,) in A and H, and what the initialisation made of them."""

    current: FloatArray
    inductance: FloatArray
    result: dict[str, float]


def run(order: Order) -> Findings:
    """Measure held gaps on the rig, record the ramp of the assembled actuator, and compare."""
    own, specimen = order.parameters, default_specimen()
    noise = {'ratio_noise': own.ripple_noise / _AVERAGED**0.5, 'seed': own.seed}
    held = measure_actuator(own.actuator, own.coil, 1e-6 * np.array(_GAPS_UM), **noise)
    sim: Values = {
        'scenario': 'bench',
        'bench.amplitude': 0.0,
        'timeline.start': 3.0,
        'timeline.duration': 0.1,
        'seed': own.seed,
        'electronics.ripple_noise': own.ripple_noise,
        **{name: value for name, value in flattened(own).items() if '.' in name},
    }
    recording = drive(core=True, parameters={'mount_sim': sim}, out=order.out / NAME).recording
    ramp = read_ramp(open_recording(recording), specimen)
    figures = figures_of(held, ramp, specimen, own)
    picture = draw_map(held, ramp, specimen, figures)
    return Findings(figures, {NAME: picture}, [recording], judged={**own._asdict(), **figures})


def read_ramp(recording: Recording, specimen: Specimen) -> Ramp:
    """Return the ramp of a recorded initialisation: its samples lie before the stamp of `air_gap`."""
    ripple, result = recording['coil_ripple'], recording['air_gap']
    during = ripple.stamps <= result.stamps[-1]
    rates = (ripple.derivative(name)[during] for name in ('flux_density', 'coil_current'))
    inductance = measured_inductance(specimen.turns_area, *rates)
    found = {name: result[name][-1] for name in result.names}
    return Ramp(ripple['coil_current'][during], inductance, found)


def figures_of(held: RigMeasurements, ramp: Ramp, specimen: Specimen, own: InductanceParameters) -> Values:
    """Return the sections of the map, the gaps that they give, and where gaps can be told apart."""
    rest, level, curves = specimen.rest_current, specimen.crossing_inductance, specimen.gap_curves
    at_rest = [float(np.interp(rest, held.currents, row)) for row in held.inductance]
    crossings = [find_crossing(held.currents, row, level).current for row in held.inductance]
    resting = np.abs(ramp.current - rest) < _DWELL
    rest_inductance = float(np.nanmean(ramp.inductance[resting]))
    crossing = find_crossing(ramp.current, ramp.inductance, level).current
    # unique is what rises or falls throughout, over the gaps from 250 to 550 um, without noise
    steps = np.diff(measure_actuator(own.actuator, own.coil, RIG_GAPS).inductance, axis=0)
    unique = (steps > 0.0).all(axis=0) | (steps < 0.0).all(axis=0)
    true_gap = closed_state(own.mechanics, own.actuator, rest, own.mechanics.rest_gap)[0]
    gap_error = rest_gap_from_inductance(curves, at_rest) - held.gaps
    crossing_error = gap_from_crossing_current(curves, crossings) - held.gaps
    return {
        'gaps_m': held.gaps.tolist(),
        'inductance_at_rest_current_h': at_rest,
        'crossing_current_a': crossings,
        'largest_gap_error_at_rest_m': np.abs(gap_error).max(),
        'largest_gap_error_at_crossing_m': np.abs(crossing_error).max(),
        'unique_currents_a': _ranges(unique),
        'ambiguous_currents_a': _ranges(~unique),
        'ramp_inductance_at_rest_h': rest_inductance,
        'ramp_crossing_current_a': crossing,
        'ramp_gap_at_rest_m': float(rest_gap_from_inductance(curves, rest_inductance)),
        'ramp_gap_at_crossing_m': float(gap_from_crossing_current(curves, crossing)),
        'true_gap_at_rest_current_m': true_gap,
        'initialisation': ramp.result,
        'true_contact_gap_m': own.mechanics.contact_gap,
        'true_rest_gap_m': own.mechanics.rest_gap,
    }


def _ranges(inside: Any) -> list[list[float]]:
    """Return first and last current (A) of each stretch of the rig's currents."""
    edges = np.flatnonzero(np.diff(inside.astype(int), prepend=0, append=0)).reshape(-1, 2)
    return RIG_CURRENTS[edges - [0, 1]].tolist()


def _told(ranges: list[list[float]]) -> str:
    return ', '.join(f'{low:.2f} .. {high:.2f}' for low, high in ranges) or 'no current'


@claim(
    'Sec. 3.2',
    paper="""The gap cannot be read from the incremental inductance directly: the relation between
    inductance, current and gap is ambiguous.""",
)
def _on_ambiguity(found):
    told = f"""Over 250 .. 550 um the inductance distinguishes gaps at {_told(found['unique_currents_a'])} A,
        and not at {_told(found['ambiguous_currents_a'])} A."""
    return found['ambiguous_currents_a'], told


@claim(
    'Fig. 4, right',
    paper='At 0.2 A, and at constant 20 mH, the relation is unique; both sections are met by a polynomial.',
)
def _on_sections(found):
    rest, level = (found[f'largest_gap_error_at_{where}_m'] for where in ('rest', 'crossing'))
    told = f"""Both are monotone. With {_AVERAGED} ripples of {100 * found['ripple_noise']:g} % noise each,
        the specimen's polynomials give the held gaps
        within {1e6 * rest:.1f} um at 0.2 A and {1e6 * level:.2f} um
        at 20 mH. That a crossing at 20 mH exists is due to the chosen core plates and conductivity."""
    unique = any(low <= 0.2 <= high for low, high in found['unique_currents_a'])
    return (unique and max(rest, level) < 5e-6) or PARTLY, told


@claim(
    'Fig. 4, left',
    paper='On the assembled damper the ramp shows 492 um at low current and 349 um when the pads touch.',
)
def _on_ramp(found):
    at_rest, contact = found['ramp_gap_at_rest_m'], found['initialisation']['contact_gap']
    true_rest, true_contact = found['true_gap_at_rest_current_m'], found['true_contact_gap_m']
    told = f"""The recorded ramp gives {1e6 * at_rest:.1f} um at 0.2 A (true: {1e6 * true_rest:.1f}) and
        {1e6 * found['ramp_gap_at_crossing_m']:.1f} um at 20 mH. There the pads are already compressed;
        carried back to no load the initialisation finds {1e6 * contact:.1f} um (true:
        {1e6 * true_contact:.1f}). Both gaps were set in the simulated actuator; the claim is that the
        initialisation finds them."""
    return abs(at_rest - true_rest) < 4e-6 and abs(contact - true_contact) < 2e-6, told


@claim(
    'Sec. 3.2',
    paper="""From the difference of both gaps (printed: 153 um) follows an offset current that presses
    the pads lightly against the rod.""",
)
def _on_offset(found):
    result = found['initialisation']
    told = f"""492 - 349 is 143. Here the halves go {1e6 * (result['rest_gap'] - result['contact_gap']):.0f}
        um from 0 A to contact, which takes {result['contact_force']:.1f} N; the offset current is
        {result['offset_current']:.3f} A, for 2 N of light pressure."""
    return True, told


def draw_map(held: RigMeasurements, ramp: Ramp, specimen: Specimen, figures: Values) -> Any:
    """Draw the inductance over the current, Fig. 4 left, and the two sections, right."""
    figure, panels = new_mosaic(
        'Incremental inductance at held gaps and on the assembled actuator (Fig. 4)',
        [['map', 'crossing'], ['map', 'rest']],
        6.0,
        width_ratios=(3, 2),
    )
    axes = panels['map']
    for gap, row, colour in zip(held.gaps, held.inductance, family(held.gaps.size), strict=True):
        axes.plot(held.currents, 1e3 * row, color=colour, linewidth=0.9, label=f'{gap * 1e6:.0f} µm held')
    known = np.isfinite(ramp.current) & np.isfinite(ramp.inductance) & (ramp.current > 0.01)
    bins = np.round(ramp.current[known] / _BIN).astype(int)
    with np.errstate(invalid='ignore'):
        current, inductance = (
            np.bincount(bins, values[known]) / np.bincount(bins) for values in (ramp.current, ramp.inductance)
        )
    axes.plot(current, 1e3 * inductance, color=RED, linewidth=3.0, alpha=0.8, label='assembled, current ramp')
    dashed = {'color': 'black', 'linestyle': '--', 'linewidth': 0.8}
    axes.axhline(1e3 * specimen.crossing_inductance, **dashed)
    axes.axvline(specimen.rest_current, **dashed)
    axes.set(xlabel='coil current (A)', ylabel='incremental inductance (mH)')
    axes.legend(fontsize='small')
    fine = np.linspace(held.gaps[0], held.gaps[-1], 200)
    for name, scale, measured, law, on_ramp, label in (
        (
            'crossing',
            1.0,
            'crossing_current_a',
            crossing_current_from_gap,
            'ramp_crossing_current_a',
            'current at 20 mH, i_20 (A)',
        ),
        (
            'rest',
            1e3,
            'inductance_at_rest_current_h',
            inductance_from_gap,
            'ramp_inductance_at_rest_h',
            'inductance at 0.2 A, L_0.2 (mH)',
        ),
    ):
        panel, gap = panels[name], 1e6 * figures[f'ramp_gap_at_{name}_m']
        panel.plot(
            1e6 * fine, scale * law(specimen.gap_curves, fine), color=BLUE, linewidth=1.0, label='polynomial'
        )
        dots = scale * np.array(figures[measured])
        panel.plot(1e6 * held.gaps, dots, 'o', color=BLUE, markerfacecolor='none', label='held gaps')
        panel.plot(gap, scale * figures[on_ramp], 's', color=RED, label=f'ramp: {gap:.1f} µm')
        panel.set(xlabel='gap between the core halves (µm)', ylabel=label)
        panel.legend(fontsize='small')
    return figure


EXPERIMENT = Experiment(
    NAME,
    """Thin lines: the gap of the simulated actuator is held on the rig and the current stepped; each
    point averages 50 ripples. Thick line: the current ramp of the initialisation on the assembled
    actuator, from a recording of `coil_ripple` (1 kHz, one ripple each, averaged in bins of 40 mA).
    Right: the two sections with the specimen's polynomials, and where the ramp lies on them.""",
    InductanceParameters(),
    run,
)
