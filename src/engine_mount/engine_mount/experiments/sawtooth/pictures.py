"""Pictures of the saw tooth, Figs. 8 to 11."""

from pathlib import Path

import numpy as np
from matplotlib.ticker import MaxNLocator

from engine_mount.experiments.harness.drawing import BLUE, GREY, RED, family, finish, new_figure
from engine_mount.experiments.sawtooth.evaluation import Run
from engine_mount.identification.friction.steps.sawtooth import StrokeLine
from mount_models.friction.coefficient import FrictionCoefficients, offset_coefficient, slope_coefficient


def draw_time(run: Run, file: Path) -> Path:
    """Draw force and deflection u over time, Fig. 8."""
    figure = new_figure(f'Saw tooth at {run.strokes[0].normal_force:g} N: force and deflection (Fig. 8)')
    upper, lower = figure.subplots(2, 1, sharex=True)
    force = run.recording.force
    upper.plot(run.recording.time, force, color=BLUE, linewidth=0.6)
    upper.set_ylabel('friction force (N)')
    lower.plot(run.recording.time, 1e6 * np.sign(force) * run.deflection, color=RED, linewidth=0.8)
    lower.set_ylabel('deflection u (µm)')
    lower.set_xlabel('time (s)')
    return finish(figure, file)


def draw_lines(run: Run, file: Path) -> Path:
    """Draw mu over u for each stroke with its line, Fig. 9; one panel for each direction."""
    load = run.strokes[0].normal_force
    figure = new_figure(f'Coefficient over deflection at {load:g} N, one colour for each speed (Fig. 9)')
    for axes, direction in zip(figure.subplots(1, 2), (1.0, -1.0), strict=True):
        chosen = [stroke for stroke in run.strokes if stroke.velocity * direction > 0.0]
        for stroke, colour in zip(chosen, family(len(chosen)), strict=True):
            step = max(stroke.u.size // 150, 1)
            axes.plot(1e6 * stroke.u[::step], stroke.mu[::step], '.', color=colour, markersize=2, alpha=0.6)
            ends = np.array([stroke.u.min(), stroke.u.max()])
            label = f'{1e3 * _speed(stroke):.3g} mm/s'
            axes.plot(1e6 * ends, stroke.a + stroke.b * ends, color=colour, linewidth=1.5, label=label)
        axes.set_title('positive direction' if direction > 0.0 else 'negative direction', fontsize='medium')
        axes.set_xlabel('deflection u (µm)')
        axes.set_ylabel('coefficient of both pads, mu_dyn (1)')
    handles, labels = figure.axes[0].get_legend_handles_labels()
    figure.legend(handles, labels, loc='outside lower center', ncols=5, fontsize='small')
    return finish(figure, file)


def draw_parameters(runs: list[Run], coefs: FrictionCoefficients, file: Path) -> Path:
    """Draw a and b of each stroke as dots, Eqs (13), (14) as lines, Fig. 10."""
    figure = new_figure(
        'Parameters of Eq (12): found on each stroke (dots), Eqs (13), (14) (lines) (Fig. 10)'
    )
    left, right = figure.subplots(1, 2)
    largest = max(abs(stroke.velocity) for run in runs for stroke in run.strokes)
    velocity = np.concatenate([np.linspace(-largest, -2e-4, 100), [np.nan], np.linspace(2e-4, largest, 100)])
    for run, colour in zip(runs, family(len(runs)), strict=True):
        load = run.strokes[0].normal_force
        found = 1e3 * np.array([stroke.velocity for stroke in run.strokes])
        left.plot(found, [1e-3 * s.b for s in run.strokes], 'o', color=colour, markersize=4)
        right.plot(found, [s.a for s in run.strokes], 'o', color=colour, markersize=4)
        b = [1e-3 * slope_coefficient(coefs, v, load) for v in velocity]
        a = [offset_coefficient(coefs, v, load) for v in velocity]
        gap = np.isnan(velocity)
        left.plot(1e3 * velocity, np.where(gap, np.nan, b), color=colour, linewidth=1.0, label=f'{load:g} N')
        right.plot(1e3 * velocity, np.where(gap, np.nan, a), color=colour, linewidth=1.0)
    left.set_ylabel('b (1/mm)')
    right.set_ylabel('a (1)')
    for axes in (left, right):
        axes.set_xlabel('velocity (mm/s)')
        axes.xaxis.set_major_locator(MaxNLocator(5))
    left.axhline(0.0, color=GREY, linewidth=0.8)
    figure.legend(*left.get_legend_handles_labels(), loc='outside lower center', ncols=6, fontsize='small')
    return finish(figure, file)


def draw_models(run: Run, file: Path) -> Path:
    """Draw the recorded force with both models: all of it, and two turning points in detail, Fig. 11."""
    figure = new_figure(
        f'Both friction models on the recorded displacement, {run.strokes[0].normal_force:g} N (Fig. 11)', 6.5
    )
    rows = figure.subplot_mosaic([['whole', 'whole'], ['slow', 'fast']])
    time = run.recording.time
    slow, fast = run.strokes[1], run.strokes[-1]
    windows = {
        'whole': (time[0], time[-1]),
        'slow': _around(time[slow.stroke.start], _speed(slow)),
        'fast': _around(time[fast.stroke.start], _speed(fast)),
    }
    for name, axes in rows.items():
        shown = (time >= windows[name][0]) & (time <= windows[name][1])
        axes.plot(time[shown], run.recording.force[shown], color=GREY, linewidth=1.6, label='recorded')
        axes.plot(
            time[shown], run.simplified_force[shown], color=RED, linewidth=0.9, label='simplified model'
        )
        axes.plot(
            time[shown], run.full_force[shown], color=BLUE, linewidth=0.9, linestyle='--', label='full model'
        )
        axes.set_ylabel('friction force (N)')
        axes.set_xlabel('time (s)')
    rows['slow'].set_title(f'turning point at {1e3 * _speed(slow):.3g} mm/s', fontsize='medium')
    rows['fast'].set_title(f'turning point at {1e3 * _speed(fast):.3g} mm/s', fontsize='medium')
    figure.legend(*rows['whole'].get_legend_handles_labels(), loc='outside lower center', ncols=3)
    return finish(figure, file)


def _speed(stroke: StrokeLine) -> float:
    return abs(stroke.displacement_velocity)


def _around(turn: float, speed: float) -> tuple[float, float]:
    """Return the times within which the pads go 0.1 mm before and 0.4 mm behind a turning point."""
    return turn - 0.1e-3 / speed, turn + 0.4e-3 / speed
