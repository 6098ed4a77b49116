"""Figs. 8 to 11: the friction contact alone on a saw tooth, faster after every second turning point."""

from pathlib import Path
from typing import Annotated, Any, NamedTuple

import numpy as np
from matplotlib.ticker import MaxNLocator

from engine_mount.experiments.harness.drawing import (
    BLUE,
    GREY,
    RED,
    family,
    legend_below,
    new_mosaic,
    new_panels,
)
from engine_mount.experiments.harness.experiment import (
    NOT_COMPARABLE,
    PARTLY,
    Experiment,
    ExperimentError,
    Findings,
    Order,
    Seed,
    Values,
    claim,
)
from engine_mount.experiments.harness.measures import rms
from engine_mount.experiments.harness.rack_recording import (
    SUBSTEPS,
    DisplacementNoise,
    ForceNoise,
    record_friction_rack,
)
from engine_mount.identification.friction.files import read_recording
from engine_mount.identification.friction.recording import FloatArray, FrictionRecording
from engine_mount.identification.friction.sawtooth import (
    StrokeLine,
    deflection_from_force,
    slip_regions,
    stroke_lines,
)
from mount_models.friction.coefficient import FrictionCoefficients, offset_coefficient, slope_coefficient
from mount_models.friction.contact import FrictionContact
from mount_models.friction.simplified import FADED_BELOW, simplified_response
from mount_models.quantity import Quantity, flattened
from mount_sim.plant.friction import full_response
from mount_sim.rack import move, sawtooth_corners, with_noise

NAME = 'sawtooth'


class SawtoothParameters(NamedTuple):
    """The saw tooth, the normal forces, the load cell and the pads on the rack."""

    amplitude: Annotated[float, Quantity('m', 'turning points on either side', 5e-4, 1e-2)] = 2.5e-3
    lowest_speed: Annotated[float, Quantity('m/s', 'speed of the first strokes', 5e-4, 0.1, 'Sec. 4')] = 1e-3
    highest_speed: Annotated[float, Quantity('m/s', 'speed of the last strokes', 5e-4, 0.1)] = 10e-3
    speed_step: Annotated[
        float, Quantity('m/s', 'faster by this after every second turning point', 1e-4, 0.1, 'Sec. 4')
    ] = 1e-3
    lowest_normal_force: Annotated[float, Quantity('N', 'first normal force', 10.0, 300.0, 'Sec. 4')] = 40.0
    highest_normal_force: Annotated[float, Quantity('N', 'last normal force', 10.0, 300.0, 'Sec. 4')] = 120.0
    normal_force_step: Annotated[float, Quantity('N', 'step between them', 1.0, 300.0)] = 20.0
    shown_normal_force: Annotated[float, Quantity('N', 'drawn in detail', 10.0, 300.0, 'Fig. 9')] = 100.0
    force_noise: ForceNoise = 0.5
    displacement_noise: DisplacementNoise = 20e-9
    seed: Seed = 1
    friction: FrictionCoefficients = FrictionCoefficients()
    contact: FrictionContact = FrictionContact()


class Rack(NamedTuple):
    """One recording at one normal force (N), its strokes, and both models driven by its displacement.

    The first stroke, which no turning point precedes, is not among `strokes`.
    """

    load: float
    recording: FrictionRecording
    deflection: FloatArray
    strokes: list[StrokeLine]
    full_force: FloatArray
    simplified_force: FloatArray

    def strokes_of(self, direction: float) -> list[StrokeLine]:
        """Return the strokes in one direction (1 or -1), in their order: the slowest first."""
        return [stroke for stroke in self.strokes if stroke.velocity * direction > 0.0]


def run(order: Order) -> Findings:
    """Move the rack at every normal force, record it, and evaluate the recordings."""
    own = order.parameters
    loads = _steps('normal_force', own, 'N')
    corners = sawtooth_corners(-own.amplitude, _steps('speed', own, 'm/s'))
    session = {'scenario': NAME, 'mode': 'rack', 'parameters': {NAME: flattened(own)}}
    recordings, racks = [], []
    for number, load in enumerate(loads.tolist()):
        order.progress(number / len(loads), f'saw tooth at {load:g} N')
        rack = move(own.contact, own.friction, *corners, load, substeps=SUBSTEPS)
        measured = with_noise(rack, own.force_noise, own.displacement_noise, own.seed + number)
        folder = order.out / f'sawtooth_{load:.0f}N'
        recordings.append(record_friction_rack(folder, measured, {**session, 'normal_force': load}))
        racks.append(evaluate(recordings[-1], own.contact, own.friction))
    shown = racks[int(np.argmin(np.abs(loads - own.shown_normal_force)))]
    pictures = {
        'sawtooth_force': draw_time(shown),
        'sawtooth_mu_over_u': draw_lines(shown),
        'sawtooth_a_b': draw_parameters(racks, own.friction),
        'sawtooth_models': draw_models(shown),
    }
    return Findings(figures_of(racks, shown, own), pictures, recordings)


def _steps(what: str, own: SawtoothParameters, unit: str) -> FloatArray:
    low, high, step = (getattr(own, name) for name in (f'lowest_{what}', f'highest_{what}', f'{what}_step'))
    if low > high:
        raise ExperimentError(
            f'lowest_{what} ({low:g} {unit}) must not lie above highest_{what} ({high:g} {unit})'
        )
    return np.arange(low, high + 0.5 * step, step)


def evaluate(path: Path, contact: FrictionContact, coefs: FrictionCoefficients) -> Rack:
    """Return what steps 1 and 2 of the identification make of the recording at `path`, and the models."""
    recording = read_recording(path)
    dt, x, load = recording.dt, recording.displacement, recording.normal_force[:, 0]
    xi = deflection_from_force(recording.force, dt, contact.tangential_stiffness, contact.tangential_damping)
    simplified, _ = simplified_response(contact, coefs, np.diff(x, prepend=x[0]) / dt, load, dt)
    samples = np.arange(x.size)
    fine = np.arange((x.size - 1) * SUBSTEPS + 1) / SUBSTEPS  # straight between samples
    between = (np.interp(fine, samples, values) for values in (x, load))
    full, *_ = full_response(contact, coefs, *between, dt / SUBSTEPS)
    strokes = [line for line in stroke_lines(recording, contact) if line.stroke.start > 0]
    return Rack(float(load[0]), recording, xi, strokes, np.asarray(full[::SUBSTEPS]), simplified)


def figures_of(racks: list[Rack], shown: Rack, own: SawtoothParameters) -> Values:
    """Return what the strokes show of mu, and how far both models lie from the shown recording."""
    strokes = [stroke for each in racks for stroke in each.strokes]
    curves = [(s, own.friction, s.velocity, s.normal_force) for s in strokes]
    directions = {'p': shown.strokes_of(1.0), 'n': shown.strokes_of(-1.0)}
    level = {way: [float(np.mean(s.mu[-20:])) for s in chosen] for way, chosen in directions.items()}
    straight = [s.residual * s.normal_force / own.force_noise for s in strokes if own.force_noise]
    micro, macro, faded = slip_regions(shown.recording, own.contact)
    measured = shown.recording.force

    def share(model: FloatArray, where: Any) -> float | None:
        """Return the rms difference to the measured force as a share of its rms, None for no samples."""
        return rms(model[where] - measured[where]) / rms(measured) if where.any() else None

    return {
        'strokes': len(strokes),
        'strokes_with_falling_coefficient': sum(s.b < 0.0 for s in strokes),
        'rising_up_to_n': max((s.normal_force for s in strokes if s.b >= 0.0), default=None),
        **{f'jump_{way}': [s.fall for s in chosen] for way, chosen in directions.items()},
        'largest_residual_of_line': max(s.residual for s in strokes),
        'largest_residual_over_noise': max(straight, default=None),
        'a_rms_error': rms([s.a - offset_coefficient(*curve) for s, *curve in curves]),
        'b_rms_error_per_mm': rms([s.b - slope_coefficient(*curve) for s, *curve in curves]) * 1e-3,
        **{f'level_{way}': values for way, values in level.items()},
        'level_rises_with_speed': bool(all((np.diff(values) > 0.0).all() for values in level.values())),
        'force_noise_share': own.force_noise / rms(measured),
        'full_error_macroslip': share(shown.full_force, macro | faded),
        'full_error_microslip': share(shown.full_force, micro),
        'simplified_error_macroslip': share(shown.simplified_force, macro),
        'simplified_error_slow_macroslip': share(shown.simplified_force, faded),
        'simplified_error_microslip': share(shown.simplified_force, micro),
    }


def _speed(stroke: StrokeLine) -> float:
    return abs(stroke.displacement_velocity)


@claim(
    'Sec. 4, Fig. 8',
    paper="""Behind a turning point the coefficient is higher and then decays while the pads are moved on
    at constant speed.""",
)
def _on_decay(figures):
    first, *_, last = figures['jump_p']
    told = f"""At the drawn normal force mu falls along each stroke, by {first:.3f} at the lowest and
        {last:.3f} at the highest speed (positive direction)."""
    return min(figures['jump_p'] + figures['jump_n']) > 0.0 or PARTLY, told


@claim(
    'Sec. 4, Eq (12)',
    paper='The larger the strain in the direction of sliding, the lower the friction force.',
)
def _on_strain(figures):
    falling, count = figures['strokes_with_falling_coefficient'], figures['strokes']
    told = f'b is negative on {falling} of {count} strokes'
    if falling == count:
        return True, f'{told}.'
    told += f"""; on the others (normal force up to {figures['rising_up_to_n']:g} N) it is positive. That is
        b_offset = +14 1/mm as Table 2 prints it, with a unit that cannot be right; with -14 b is negative
        everywhere."""
    return PARTLY, told


@claim('Fig. 9', paper='Over the deflection u the coefficient is a straight line at each constant speed.')
def _on_line(figures):
    straight = figures['largest_residual_over_noise']
    noise = '' if straight is None else f', {straight:.2f} times the noise of the load cell'
    told = f"""The lines leave at most {figures['largest_residual_of_line']:.4f} rms of mu{noise}, on all
        {figures['strokes']} strokes. The simulated pads obey Eq (12), so this tests the evaluation, not the
        pads."""
    return straight is None or straight < 1.2, told


@claim(
    'Fig. 10, Eqs (13), (14)',
    paper="""a and b of each stroke lie on the analytic curves over speed and normal force, a with
    a logarithm, both directions apart.""",
)
def _on_curves(figures):
    a, b = figures['a_rms_error'], figures['b_rms_error_per_mm']
    told = f"""a comes back with {a:.4f} rms, b with {b:.2f} 1/mm rms of the curves the simulated pads have,
        taken at the mean speed of the slider, a little slower than the pads because the creeping element
        takes its part."""
    return a < 5e-3 and b < 1.0, told


@claim(
    'Sec. 4',
    paper='Brake material without metal has no Stribeck effect: friction does not fall with speed.',
)
def _on_speed(figures):
    levels = [f'{figures[key][0]:.2f} to {figures[key][-1]:.2f}' for key in ('level_p', 'level_n')]
    told = f"""At the end of the strokes mu rises with speed from {levels[0]} (positive) and {levels[1]}
        (negative direction)."""
    return figures['level_rises_with_speed'], told


@claim(
    'Fig. 11',
    paper="""Both models meet the measurement in macroslip; in microslip the full one is precise and the
    simplified one far off.""",
)
def _on_models(figures):
    macro, micro = figures['simplified_error_macroslip'], figures['simplified_error_microslip']
    shares = {
        name: 'nothing' if share is None else f'{100 * share:.1f} %'
        for name, share in figures.items()
        if 'error_' in name or name == 'force_noise_share'
    }
    told = f"""Difference to the recorded force, as a share of its rms (the noise alone is
        {shares['force_noise_share']}): simplified {shares['simplified_error_macroslip']} in macroslip and
        {shares['simplified_error_microslip']} in microslip, full {shares['full_error_macroslip']} and
        {shares['full_error_microslip']}. Below {1e3 * FADED_BELOW:g} mm/s the simplified model is off by
        {shares['simplified_error_slow_macroslip']} in macroslip too: there it fades friction out, as in the
        paper. The rack is the full model, so its own agreement proves nothing about pads; that of the
        simplified model shows the cost of leaving out c_Re."""
    return NOT_COMPARABLE if macro is None else (macro < 0.03 and micro > 5.0 * macro) or PARTLY, told


def draw_time(rack: Rack) -> Any:
    """Draw force and deflection u over time, Fig. 8."""
    figure, (upper, lower) = new_panels(
        f'Saw tooth at {rack.load:g} N: force and deflection (Fig. 8)', 2, sharex=True
    )
    force, time = rack.recording.force, rack.recording.time
    upper.plot(time, force, color=BLUE, linewidth=0.6)
    upper.set_ylabel('friction force (N)')
    lower.plot(time, 1e6 * np.sign(force) * rack.deflection, color=RED, linewidth=0.8)
    lower.set(ylabel='deflection u (µm)', xlabel='time (s)')
    return figure


def draw_lines(rack: Rack) -> Any:
    """Draw mu over u for each stroke with its line, Fig. 9; one panel for each direction."""
    figure, panels = new_panels(
        f'Coefficient over deflection at {rack.load:g} N, one colour for each speed (Fig. 9)', 1, 2
    )
    for axes, name, direction in zip(panels, ('positive', 'negative'), (1.0, -1.0), strict=True):
        chosen = rack.strokes_of(direction)
        for stroke, colour in zip(chosen, family(len(chosen)), strict=True):
            step = max(stroke.u.size // 150, 1)
            axes.plot(1e6 * stroke.u[::step], stroke.mu[::step], '.', color=colour, markersize=2, alpha=0.6)
            ends = np.array([stroke.u.min(), stroke.u.max()])
            label = f'{1e3 * _speed(stroke):.3g} mm/s'
            axes.plot(1e6 * ends, stroke.a + stroke.b * ends, color=colour, linewidth=1.5, label=label)
        axes.set_title(f'{name} direction', fontsize='medium')
        axes.set(xlabel='deflection u (µm)', ylabel='coefficient of both pads, mu_dyn (1)')
    legend_below(figure, panels[0], 5, fontsize='small')
    return figure


def draw_parameters(racks: list[Rack], coefs: FrictionCoefficients) -> Any:
    """Draw a and b of each stroke as dots, Eqs (13), (14) as lines, Fig. 10."""
    figure, (left, right) = new_panels(
        'Parameters of Eq (12): found on each stroke (dots), Eqs (13), (14) (lines) (Fig. 10)', 1, 2
    )
    largest = max(abs(stroke.velocity) for rack in racks for stroke in rack.strokes)
    half = np.linspace(2e-4, largest, 100)
    velocity = np.concatenate([-half[::-1], half])
    for axes, name, unit, law, scale in (
        (left, 'b', '1/mm', slope_coefficient, 1e-3),
        (right, 'a', '1', offset_coefficient, 1.0),
    ):
        for rack, colour in zip(racks, family(len(racks)), strict=True):
            found = np.array([(1e3 * s.velocity, scale * getattr(s, name)) for s in rack.strokes])
            axes.plot(*found.T, 'o', color=colour, markersize=4)
            curve = np.array([scale * law(coefs, v, rack.load) for v in velocity])
            curve[half.size - 1] = np.nan  # no line through the jump at 0
            axes.plot(1e3 * velocity, curve, color=colour, linewidth=1.0, label=f'{rack.load:g} N')
        axes.set(xlabel='velocity (mm/s)', ylabel=f'{name} ({unit})')
        axes.xaxis.set_major_locator(MaxNLocator(5))
    left.axhline(0.0, color=GREY, linewidth=0.8)
    legend_below(figure, left, 6, fontsize='small')
    return figure


def draw_models(rack: Rack) -> Any:
    """Draw the recorded force with both models: all of it, and two turning points in detail, Fig. 11."""
    figure, rows = new_mosaic(
        f'Both friction models on the recorded displacement, {rack.load:g} N (Fig. 11)',
        [['whole', 'whole'], ['slow', 'fast']],
        6.5,
    )
    time = rack.recording.time
    windows = {'whole': (time[0], time[-1])}
    for name, stroke in (('slow', rack.strokes[1]), ('fast', rack.strokes[-1])):
        turn, speed = time[stroke.stroke.start], _speed(stroke)
        windows[name] = turn - 0.1e-3 / speed, turn + 0.4e-3 / speed  # 0.1 mm before, 0.4 mm behind
        rows[name].set_title(f'turning point at {1e3 * speed:.3g} mm/s', fontsize='medium')
    for name, axes in rows.items():
        begin, end = windows[name]
        shown = (time >= begin) & (time <= end)
        for force, label, style in (
            (rack.recording.force, 'recorded', {'color': GREY, 'linewidth': 1.6}),
            (rack.simplified_force, 'simplified model', {'color': RED, 'linewidth': 0.9}),
            (rack.full_force, 'full model', {'color': BLUE, 'linewidth': 0.9, 'linestyle': '--'}),
        ):
            axes.plot(time[shown], force[shown], label=label, **style)
        axes.set(ylabel='friction force (N)', xlabel='time (s)')
    legend_below(figure, rows['whole'], 3)
    return figure


EXPERIMENT = Experiment(
    NAME,
    """The simulated pads (full model) are moved between two turning points at constant speed and constant
    normal force; after every second turning point the speed grows by 1 mm/s. Displacement, friction
    force and normal force are recorded at 1 kHz with noisy instruments; everything below is computed
    from the recordings: u from the force through the linear part of the contact, a line of mu over u
    for each stroke, and both friction models driven by the recorded displacement.""",
    SawtoothParameters(),
    run,
)
