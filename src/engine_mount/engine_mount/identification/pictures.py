"""Pictures of identification and calibration: panels of measured and fitted values."""

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from matplotlib.figure import Figure

from engine_mount.identification.force_points import gap_groups
from engine_mount.identification.friction.ladder import Rung, best_rung, predicted_force
from engine_mount.identification.friction.recording import FrictionRecording
from engine_mount.identification.gap_curves import CurveFit
from mount_models.actuator import checked_force
from mount_models.coil.gap import evaluate
from mount_models.friction.coefficient import FrictionCoefficients, offset_coefficient, slope_coefficient

_DRAWN_GAPS = 7
_LONGEST = 4000  # samples of a curve in the picture


class Curve(NamedTuple):
    """Values over others, drawn by a format of matplotlib (colour and marker or line), maybe with errors."""

    x: Any
    y: Any
    form: str
    label: str = ''
    errors: Any = None


class Panel(NamedTuple):
    """One set of axes: its title, the names of x and y with units, and what stands in it."""

    title: str
    x: str
    y: str
    curves: Sequence[Curve]


def draw_force_law(fit: Any, file: Path) -> None:
    """Write the picture of points and law to `file` (PNG): force over current, and its error."""
    law, points = fit.law, fit.points
    current, groups, curves = np.linspace(0.0, law.current_high, 200), gap_groups(points.gap), []
    for place, group in enumerate(groups[:: max(1, len(groups) // _DRAWN_GAPS)]):
        gap = points.gap[group].mean()
        curves += [
            Curve(points.current[group], points.force[group], f'C{place % 10}.'),
            Curve(current, checked_force(law, current, gap), f'C{place % 10}-', f'{1e6 * gap:.0f} µm'),
        ]
    errors = [Curve(points.current, fit.error, 'k.'), Curve([0.0, law.current_high], [0.0, 0.0], 'r-')]
    title, x = 'Force law, Eqs (3) and (4): lines; measured: points', 'coil current (A)'
    panels = [Panel(title, x, 'magnetic force (N)', curves), Panel('', x, 'law minus point (N)', errors)]
    _draw(file, panels, 1, height_ratios=(3, 1))


def draw_gap_curves(result: Any, file: Path) -> None:
    """Write the picture of curves and what temperature leaves to `file` (PNG): Fig. 4."""
    points, rows = result.calibration.points, result.temperature_errors

    def curve(fit: CurveFit, values: Sequence[float], factor: float, name: str) -> Panel:
        gaps = np.linspace(fit.polynomial.low, fit.polynomial.high, 200)
        title = f'degree {len(fit.covariance) - 1}, rms {1e6 * fit.gap_rms:.2f} µm'
        return Panel(title, 'air gap (µm)', name, [
            Curve(1e6 * gaps, factor * evaluate(fit.polynomial, gaps), 'b-', 'curve'),
            Curve([1e6 * point.gap for point in points], factor * np.array(values), 'r.', 'measured'),
        ])  # fmt: skip

    left = [
        Curve([row['celsius'] for row in rows], [row[f'{name}_um'] for row in rows], form, label)
        for name, form, label in (
            ('rest_uncompensated', 'bo:', 'at rest, uncompensated'),
            ('rest', 'bo-', 'at rest'),
            ('contact_uncompensated', 'ro:', 'at contact, uncompensated'),
            ('contact', 'ro-', 'at contact'),
        )
    ]
    at_rest, crossing = [each.inductance for each in points], [each.crossing_current for each in points]
    panels = [
        curve(result.calibration.inductance, at_rest, 1e3, 'L at rest (mH)'),
        curve(result.calibration.crossing, crossing, 1.0, 'crossing current (A)'),
        Panel('what temperature leaves', 'coil temperature (degC)', 'largest gap error (µm)', left),
    ]
    _draw(file, panels, 2)


def draw_friction(result: Any, file: Path) -> None:
    """Write the picture of each step, and of the ladder's best law on what was held out, to `file` (PNG)."""
    panels: list[Panel] = []
    for ramp in result.ramps[:1]:
        measured = ramp.recording
        x, fitted = 1e6 * measured.displacement, 1e6 * ramp.displacement
        over_time = [
            Curve(measured.time, x, 'k-', 'measured'),
            Curve(measured.time, fitted, 'r-', 'fit, Eq (10) put right'),
        ]
        forces = [Curve(x, measured.force, 'k-', 'measured'), Curve(fitted, ramp.force, 'r-', 'fit')]
        panels += [
            Panel(f'step 1: {measured.name}', 'time (s)', 'displacement (µm)', over_time),
            Panel('step 1', 'displacement (µm)', 'friction force (N)', forces),
        ]
    if result.fit:
        coefs = result.fit.coefficients
        panels += [
            _stroke_lines(result),
            _over_speed(result, coefs, 'a', offset_coefficient, 1.0, 'a'),
            _over_speed(result, coefs, 'b', slope_coefficient, 1e-3, 'b (1/mm)'),
        ]
    for models in result.validations[:1]:
        measured = models.recording
        last = slice(-round(3.0 / measured.dt), None)  # 3 s, in which strokes are short enough to be seen
        curves = [
            Curve(measured.time[last], values[last], form, label)
            for values, form, label in (
                (measured.force, 'k-', 'measured'),
                (models.full, 'r-', 'full model'),
                (models.simplified, 'b-', 'simplified model'),
            )
        ]
        panels.append(Panel(f'held out: {measured.name}', 'time (s)', 'friction force (N)', curves))
    if result.rungs and result.held_out:
        panels.append(_prediction(result.held_out[0], best_rung(result.rungs)))
    _draw(file, panels, min(2, len(panels)))


def draw_pads(history: Any, file: Path) -> None:
    """Write the picture of gap and friction over the starts, and of all pulses, to `file` (PNG)."""
    starts = history.starts
    number = np.arange(len(starts)) + 1
    gap, gap_std, reserve = 1e6 * np.array([each[2:5] for each in starts]).T
    friction, friction_std = np.array([each.friction or (np.nan, np.nan) for each in starts]).T
    pulses = [
        Curve(probe.normal_force, probe.pressed / probe.free, '.-')
        for probe in (each.probe for each in starts)
        if probe
    ]
    gaps = [Curve(number, gap, 'ko', errors=gap_std), Curve(number, gap - reserve, 'r--', 'worn out')]
    frictions = [Curve(number, friction, 'ko', errors=friction_std)]
    panels = [
        Panel('', 'start', 'contact gap (µm)', gaps),
        Panel('', 'start', 'friction over that in the first probe', frictions),
        Panel('', 'normal force (N)', "engine's line over that in the pause", pulses),
    ]
    _draw(file, panels, len(panels))


def _stroke_lines(result: Any) -> Panel:
    name, curves = result.lines[0].recording, []
    for line in (each for each in result.lines if each.recording == name):
        part = slice(None, None, max(1, line.u.size // 400))
        ends = np.array([line.u.min(), line.u.max()])
        form = 'b,' if line.velocity > 0.0 else 'r,'
        curves += [
            Curve(1e6 * line.u[part], line.mu[part], form),
            Curve(1e6 * ends, line.a + line.b * ends, 'k-'),
        ]
    return Panel(f'step 2: {name} (blue: to the positive side)', 'deflection u (µm)', 'mu', curves)


def _over_speed(
    result: Any,
    coefs: FrictionCoefficients,
    name: str,
    form: Callable[[FrictionCoefficients, float, float], float],
    factor: float,
    label: str,
) -> Panel:
    curves = []
    for place, recording in enumerate(dict.fromkeys(line.recording for line in result.lines)):
        lines = [line for line in result.lines if line.recording == recording]
        load = float(np.mean([line.normal_force for line in lines]))
        values, halves = (
            [factor * getattr(line, each) for line in lines] for each in (name, f'{name}_interval')
        )
        colour = f'C{place % 10}'
        curves.append(
            Curve([1e3 * line.velocity for line in lines], values, f'{colour}o', f'{load:.0f} N', halves)
        )
        speeds = np.linspace(0.05, 1.0, 60) * max(abs(line.velocity) for line in lines)
        for sided in (-speeds, speeds):
            fitted = [factor * form(coefs, speed, load) for speed in sided]
            curves.append(Curve(1e3 * sided, fitted, f'{colour}-'))
    return Panel(f'step 3: {name}, lines by Eqs (13), (14)', 'velocity (mm/s)', label, curves)


def _prediction(measured: FrictionRecording, rung: Rung) -> Panel:
    part = slice(None, None, max(1, measured.force.size // _LONGEST))
    x = 1e3 * measured.displacement[part]
    curves = [
        Curve(x, measured.force[part], 'k-', 'measured'),
        Curve(x, predicted_force(rung.law, rung.values, measured)[part], 'r-', rung.law.name),
    ]
    return Panel(f'held out: {measured.name}', 'displacement (mm)', 'friction force (N)', curves)


def _draw(file: Path, panels: Sequence[Panel], columns: int, **arrangement: Any) -> None:
    rows = -(-len(panels) // columns)
    picture = Figure(figsize=(6.5 * columns, 4.0 * rows), layout='constrained')
    places = picture.subplots(rows, columns, squeeze=False, **arrangement).ravel()
    for axes in places[len(panels) :]:
        axes.set_visible(False)
    for axes, panel in zip(places, panels, strict=False):
        for x, y, form, label, errors in panel.curves:
            axes.errorbar(x, y, errors, fmt=form, label=label or None, markersize=4, linewidth=1.0)
        axes.set(xlabel=panel.x, ylabel=panel.y)
        axes.set_title(panel.title, fontsize='medium')
        axes.grid(alpha=0.25)
        if axes.get_legend_handles_labels()[0]:
            axes.legend(fontsize='small')
    picture.savefig(file, dpi=100)
