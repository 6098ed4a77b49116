"""Pictures of identification and calibration, one panel for each step."""

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import matplotlib

matplotlib.use('Agg')

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from mount_models.actuator import checked_force
from mount_models.coil.gap import evaluate
from mount_models.friction.coefficient import offset_coefficient, slope_coefficient

_BLUE, _RED, _GREY = '#1f5fa8', '#b03030', '#666666'
_COLOURS = (_BLUE, '#2a8a57', '#b07a1e', _RED, '#6a3d9a')
_DRAWN_GAPS = 7
_LONGEST = 4000  # samples of a curve in the picture

Panel = Callable[[Axes], Any]


def draw_force_law(fit: Any, file: Path) -> None:
    """Write the picture of points and law to `file` (PNG): force over current, and its error."""
    law, points = fit.law, fit.points
    current = np.linspace(0.0, law.current_high, 200)

    def force(axes: Axes) -> None:
        for colour, group in _some(fit.groups):
            gap = float(points.gap[group].mean())
            axes.plot(points.current[group], points.force[group], '.', color=colour, markersize=4)
            axes.plot(current, checked_force(law, current, gap), color=colour, label=f'{1e6 * gap:.0f} µm')
        _label(
            axes, 'Force law, Eqs (3) and (4): lines; measured: points', y='magnetic force (N)', of='air gap'
        )

    def error(axes: Axes) -> None:
        axes.plot(points.current, fit.error, '.', color=_GREY, markersize=2)
        axes.axhline(0.0, color=_RED, linewidth=0.8)
        _label(axes, x='coil current (A)', y='law minus point (N)')

    _draw(file, [force, error], 1, (10.0, 7.0), height_ratios=(3, 1))


def draw_gap_curves(result: Any, file: Path) -> None:
    """Write the picture of map, curves and what temperature leaves to `file` (PNG): Fig. 4."""
    points, region = result.calibration.points, result.region

    def inductance_map(axes: Axes) -> None:
        for colour, (gap, inductance) in _some(list(zip(region.gaps, 1e3 * region.inductance, strict=True))):
            label = f'{1e6 * gap:.0f} µm'
            axes.plot(region.currents, inductance, color=colour, linewidth=1.0, label=label)
        for low, high in region.falling + region.rising:
            axes.axvspan(low, high, color=_GREY, alpha=0.15, linewidth=0)
        axes.axvline(result.base.rest_current, color=_RED, linestyle=':')
        axes.axhline(1e3 * result.base.crossing_inductance, color=_RED, linestyle='--')
        title = 'shaded: the inductance determines the gap'
        _label(axes, title, 'coil current (A)', 'incremental inductance (mH)', 'air gap')

    def temperatures(axes: Axes) -> None:
        rows = result.temperature_errors
        celsius = [row['celsius'] for row in rows]
        for name, colour, style in (
            ('rest_uncompensated', _BLUE, 'o:'),
            ('rest', _BLUE, 'o-'),
            ('contact_uncompensated', _RED, 'o:'),
            ('contact', _RED, 'o-'),
        ):
            label = f'at {name.replace("_", ", ")}'
            axes.plot(celsius, [row[f'{name}_um'] for row in rows], style, color=colour, label=label)
        _label(axes, 'what temperature leaves', 'coil temperature (degC)', 'largest gap error (µm)')

    def curve(name: str, values: list[float], factor: float, label: str) -> Panel:
        fit = getattr(result.calibration, name)
        gaps = np.linspace(fit.polynomial.low, fit.polynomial.high, 200)

        def panel(axes: Axes) -> None:
            axes.plot(1e6 * gaps, factor * evaluate(fit.polynomial, gaps), color=_BLUE, label='curve')
            axes.plot([1e6 * point.gap for point in points], values, '.', color=_RED, label='measured')
            title = f'degree {fit.degree}, rms {1e6 * fit.gap_rms:.2f} µm'
            _label(axes, title, 'air gap (µm)', label)

        return panel

    at_rest = curve('inductance', [1e3 * point.inductance for point in points], 1e3, 'L at rest (mH)')
    crossing = [point.crossing_current for point in points]
    panels = [inductance_map, temperatures, at_rest, curve('crossing', crossing, 1.0, 'crossing current (A)')]
    _draw(file, panels, 2, (12.0, 8.0))


def draw_drift(result: Any, file: Path) -> None:
    """Write points with their deviations, lines with one standard deviation, and the limit (PNG)."""
    hours = np.array([state.hours for state in result.states])
    grid = np.linspace(hours.min(), hours.max(), 100)

    def line(name: str, factor: float, label: str) -> Panel:
        def panel(axes: Axes) -> None:
            middle, spread = (factor * of(grid) for of in (result.lines[name].at, result.lines[name].std_at))
            axes.fill_between(grid, middle - spread, middle + spread, color=_BLUE, alpha=0.15, linewidth=0)
            axes.plot(grid, middle, color=_BLUE, linewidth=1.0)
            stds = [factor * getattr(state, f'{name}_std', 0.0) for state in result.states]
            values = [factor * getattr(state, name) for state in result.states]
            axes.errorbar(hours, values, yerr=stds, fmt='o', color=_GREY, markersize=4, capsize=3)
            if name == 'contact_gap':
                axes.axhline(1e6 * result.limit, color=_RED, linestyle='--', label='range of the law ends')
            _label(axes, x='time (h)', y=label)

        return panel

    panels = [
        line('contact_gap', 1e6, 'contact gap (µm)'),
        line('offset_current', 1e3, 'offset current (mA)'),
    ]
    _draw(file, panels, 1, (9.0, 6.0))


def draw_friction(result: Any, file: Path) -> None:
    """Write the picture of each step, and of the ladder on what was held out, to `file` (PNG)."""
    panels: list[Panel] = []
    if result.ramps:
        fit = result.ramps[0]
        measured = fit.recording
        x, fitted_x = 1e6 * measured.displacement, 1e6 * fit.displacement
        labels = f'step 1: {measured.name}', 'time (s)', 'displacement (µm)'
        panels.append(_over(measured.time, x, measured.time, {'fit, Eq (10) put right': fitted_x}, *labels))
        labels = 'step 1: force over displacement', 'displacement (µm)', 'friction force (N)'
        panels.append(_over(x, measured.force, fitted_x, {'fit': fit.force}, *labels))
    if result.lines:
        panels += [
            lambda axes: _stroke_lines(axes, result),
            lambda axes: _over_speed(axes, result, 'a', offset_coefficient, 1.0, ''),
            lambda axes: _over_speed(axes, result, 'b', slope_coefficient, 1e-3, ' (1/mm)'),
        ]
    for models in result.validations[:1]:
        measured = models.recording
        last = slice(-round(3.0 / measured.dt), None)  # 3 s, in which strokes are short enough to be seen
        forces = {'full model': models.full[last], 'simplified model': models.simplified[last]}
        time = measured.time[last]
        labels = f'held out: {measured.name}', 'time (s)', 'friction force (N)'
        panels.append(_over(time, measured.force[last], time, forces, *labels))
    if result.rungs or result.pairs:
        panels.append(lambda axes: _errors(axes, result.ladder()))
    if result.rungs and result.held_out:
        panels.append(_prediction(result.held_out[0], result.rungs, 'held out: '))
    if result.pairs:
        pair = min(result.pairs, key=lambda each: min(rung.held_out_error for rung in each.rungs))
        panels.append(_prediction(pair.recording, pair.rungs, f'{pair.train} -> '))
    columns = min(2, len(panels))
    _draw(file, panels, columns, (6.5 * columns, 3.9 * -(-len(panels) // columns)))


def _stroke_lines(axes: Axes, result: Any) -> None:
    name = result.lines[0].recording
    for line in result.lines:
        if line.recording == name:
            part = slice(None, None, max(1, line.u.size // 400))
            colour = _BLUE if line.velocity > 0.0 else _RED
            axes.plot(1e6 * line.u[part], line.mu[part], '.', color=colour, markersize=1.0, alpha=0.4)
            ends = np.array([line.u.min(), line.u.max()])
            axes.plot(1e6 * ends, line.a + line.b * ends, color='black', linewidth=0.9)
    _label(axes, f'step 2: {name} (blue: to the positive side)', 'deflection u (µm)', 'mu')


def _over_speed(axes: Axes, result: Any, name: str, form: Any, factor: float, unit: str) -> None:
    for place, recording in enumerate(dict.fromkeys(line.recording for line in result.lines)):
        lines = [line for line in result.lines if line.recording == recording]
        load, colour = float(np.mean([line.normal_force for line in lines])), _COLOURS[place % len(_COLOURS)]
        axes.errorbar(
            [1e3 * line.velocity for line in lines],
            [factor * getattr(line, name) for line in lines],
            [factor * getattr(line, f'{name}_interval') for line in lines],
            fmt='o', markersize=3, linewidth=0.8, color=colour, label=f'{load:.0f} N',
        )  # fmt: skip
        speeds = np.linspace(0.05, 1.0, 60) * max(abs(line.velocity) for line in lines)
        for sided in (-speeds, speeds):
            values = [factor * form(result.coefficients, speed, load) for speed in sided]
            axes.plot(1e3 * sided, values, color=colour, linewidth=1.0)
    _label(axes, f'step 3: {name}, lines by Eqs (13), (14)', 'velocity (mm/s)', name + unit, 'normal force')


def _errors(axes: Axes, ladder: dict[str, dict[str, Any]]) -> None:
    places = np.arange(len(ladder))
    for key, label, shift, colour in (
        ('held_out_error', 'held out', -0.2, _BLUE),
        ('train_error', 'training', 0.2, _GREY),
    ):
        errors = [100 * (entry[key] or 0.0) for entry in ladder.values()]
        bars = axes.barh(places + shift, errors, 0.4, color=colour, label=label)
        axes.bar_label(bars, fmt='%.1f', fontsize='small', padding=2)
    axes.set_yticks(places, list(ladder))
    axes.invert_yaxis()
    _label(axes, 'ladder, errors as means over all tries', 'rms error / rms force (%)')


def _prediction(recording: Any, rungs: Sequence[Any], title: str) -> Panel:
    from engine_mount.identification.friction.ladder import best_rung, predicted_force

    rung = best_rung(rungs)
    part = slice(None, None, max(1, recording.force.size // _LONGEST))
    x = 1e3 * recording.displacement[part]
    predicted = predicted_force(rung.law, rung.values, recording)[part]
    labels = f'{title}{recording.name}', 'displacement (mm)', 'friction force (N)'
    return _over(x, recording.force[part], x, {rung.law.name: predicted}, *labels)


def _over(x: Any, y: Any, model_x: Any, models: dict[str, Any], *labels: str) -> Panel:
    """Return a panel of measured values and of those of models."""

    def panel(axes: Axes) -> None:
        axes.plot(x, y, color=_GREY, linewidth=0.7, label='measured')
        for colour, (name, values) in zip((_RED, _BLUE), models.items(), strict=False):
            axes.plot(model_x, values, color=colour, linewidth=1.0, label=name)
        _label(axes, *labels)

    return panel


def _some(rows: Sequence[Any]) -> list[tuple[Any, Any]]:
    """Return some of many rows, each with a colour."""
    chosen = rows[:: max(1, len(rows) // _DRAWN_GAPS)]
    shades = np.linspace(0.0, 0.9, len(chosen))
    return list(zip(map(matplotlib.colormaps['viridis'], shades), chosen, strict=True))


def _label(axes: Axes, title: str = '', x: str = '', y: str = '', of: str = '') -> None:
    axes.set(xlabel=x, ylabel=y)
    axes.set_title(title, fontsize='medium')
    if axes.get_legend_handles_labels()[0]:
        axes.legend(fontsize='small', title=of or None, title_fontsize='small')


def _draw(
    file: Path, panels: Sequence[Panel], columns: int, size: tuple[float, float], **arrangement: Any
) -> None:
    picture = Figure(figsize=size, layout='constrained')
    rows = -(-len(panels) // columns)
    places = picture.subplots(rows, columns, squeeze=False, **arrangement).ravel()
    for axes in places[len(panels) :]:
        axes.set_visible(False)
    for axes, panel in zip(places, panels, strict=False):
        panel(axes)
        axes.grid(alpha=0.25)
    picture.savefig(file, dpi=100)
