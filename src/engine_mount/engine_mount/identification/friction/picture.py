"""The picture of an identification: each step, and the ladder on what was held out."""

import itertools
from pathlib import Path

import matplotlib

matplotlib.use('Agg')

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from engine_mount.identification.friction.found import Identification, mean_ladder
from engine_mount.identification.friction.ladder import best_rung, predicted_force
from mount_models.friction.coefficient import offset_coefficient, slope_coefficient

_BLUE, _RED, _GREY = '#1f5fa8', '#b03030', '#666666'
_COLOURS = ('#1f5fa8', '#2a8a57', '#b07a1e', '#b03030', '#6a3d9a')
_LONGEST = 4000  # samples of a curve in the picture


def draw_identification(found: Identification, file: Path) -> None:
    """Write the picture of everything that was found to `file` (PNG)."""
    panels = []
    if found.ramps:
        panels += [_ramp_displacement, _ramp_force]
    if found.lines:
        panels += [_lines, _coefficient_a, _coefficient_b]
    if found.validations:
        panels.append(_validation)
    if found.rungs or found.pairs:
        panels.append(_errors)
    if (found.rungs and found.held_out) or found.pairs:
        panels.append(_held_out)
    columns = min(2, len(panels))
    rows = -(-len(panels) // max(columns, 1))
    picture = Figure(figsize=(6.5 * columns, 3.9 * rows), layout='constrained')
    places = picture.subplots(rows, columns, squeeze=False).ravel()
    for axes, panel in itertools.zip_longest(places, panels):
        if panel is None:
            axes.set_visible(False)
            continue
        panel(axes, found)
        axes.grid(alpha=0.25)
    picture.savefig(file, dpi=100)


def _ramp_displacement(axes: Axes, found: Identification) -> None:
    recording, fit = found.ramps[0]
    axes.plot(recording.time, 1e6 * recording.displacement, color=_GREY, linewidth=0.6, label='measured')
    axes.plot(
        recording.time, 1e6 * fit.displacement, color=_RED, linewidth=1.4, label='fit, Eq (10) put right'
    )
    axes.set(title=f'step 1: {recording.name}', xlabel='time (s)', ylabel='displacement (µm)')
    axes.legend(fontsize='small')


def _ramp_force(axes: Axes, found: Identification) -> None:
    recording, fit = found.ramps[0]
    axes.plot(1e6 * recording.displacement, recording.force, color=_GREY, linewidth=0.6, label='measured')
    axes.plot(1e6 * fit.displacement, fit.force, color=_RED, linewidth=1.4, label='fit')
    axes.set(title='step 1: force over displacement', xlabel='displacement (µm)', ylabel='friction force (N)')
    axes.legend(fontsize='small')


def _lines(axes: Axes, found: Identification) -> None:
    shown = [line for line in found.lines if line.recording == found.lines[0].recording]
    for line in shown:
        part = slice(None, None, max(1, line.u.size // 400))
        colour = _BLUE if line.velocity > 0.0 else _RED
        axes.plot(1e6 * line.u[part], line.mu[part], '.', color=colour, markersize=1.0, alpha=0.4)
        ends = np.array([line.u.min(), line.u.max()])
        axes.plot(1e6 * ends, line.a + line.b * ends, color='black', linewidth=0.9)
    axes.plot([], [], color=_BLUE, label='to the positive side')
    axes.plot([], [], color=_RED, label='to the negative side')
    axes.set(title=f'step 2: {found.lines[0].recording}', xlabel='deflection u (µm)', ylabel='mu')
    axes.legend(fontsize='small')


def _coefficient_a(axes: Axes, found: Identification) -> None:
    _over_speed(axes, found, offset_coefficient, 1.0, 'a')
    axes.set(title='step 3: a, lines by Eq (14)', xlabel='velocity (mm/s)', ylabel='a')


def _coefficient_b(axes: Axes, found: Identification) -> None:
    _over_speed(axes, found, slope_coefficient, 1e-3, 'b')
    axes.set(title='step 3: b, lines by Eq (13)', xlabel='velocity (mm/s)', ylabel='b (1/mm)')


def _over_speed(axes: Axes, found: Identification, law, factor: float, name: str) -> None:
    assert found.coefficients is not None
    for place, recording in enumerate(dict.fromkeys(line.recording for line in found.lines)):
        lines = [line for line in found.lines if line.recording == recording]
        load = float(np.mean([line.normal_force for line in lines]))
        colour = _COLOURS[place % len(_COLOURS)]
        axes.errorbar(
            [1e3 * line.velocity for line in lines], [factor * getattr(line, name) for line in lines],
            [factor * getattr(line, f'{name}_interval') for line in lines],
            fmt='o', markersize=3, linewidth=0.8, color=colour, label=f'{load:.0f} N',
        )  # fmt: skip
        fastest = max(abs(line.velocity) for line in lines)
        for sign in (-1.0, 1.0):
            speeds = sign * np.linspace(0.05, 1.0, 60) * fastest
            values = [factor * law(found.coefficients, speed, load) for speed in speeds]
            axes.plot(1e3 * speeds, values, color=colour, linewidth=1.0)
    axes.legend(fontsize='small', title='normal force', title_fontsize='small')


def _validation(axes: Axes, found: Identification) -> None:
    recording, models = found.validations[0]
    inside = _shown(recording.force.size, recording.dt)
    time = recording.time[inside]
    axes.plot(time, recording.force[inside], color=_GREY, linewidth=2.0, alpha=0.6, label='measured')
    axes.plot(time, models.full[inside], color=_BLUE, linewidth=1.0, label='full model')
    axes.plot(time, models.simplified[inside], '--', color=_RED, linewidth=1.0, label='simplified model')
    axes.set(title=f'held out: {recording.name}', xlabel='time (s)', ylabel='friction force (N)')
    axes.legend(fontsize='small')


def _errors(axes: Axes, found: Identification) -> None:
    if found.pairs:
        ladder = mean_ladder(found.pairs)
        names = list(ladder)
        train = [ladder[name]['train_error'] for name in names]
        held_out = [ladder[name]['held_out_error'] for name in names]
        title = 'ladder: means over all ordered pairs'
    else:
        names = [rung.law.name for rung in found.rungs]
        train = [rung.train_error for rung in found.rungs]
        held_out = [rung.held_out_error for rung in found.rungs]
        title = 'ladder'
    places = np.arange(len(names))
    bars = axes.barh(places - 0.2, 100 * np.array(held_out), 0.4, color=_BLUE, label='held out')
    axes.bar_label(bars, fmt='%.1f', fontsize='small', padding=2)
    axes.barh(places + 0.2, 100 * np.array(train), 0.4, color=_GREY, alpha=0.6, label='training')
    axes.set_yticks(places, names)
    axes.invert_yaxis()
    axes.set(title=title, xlabel='rms error / rms force (%)')
    axes.legend(fontsize='small')


def _held_out(axes: Axes, found: Identification) -> None:
    if found.pairs:
        pair = min(found.pairs, key=lambda each: best_rung(each.rungs).held_out_error)
        recording, rungs, title = pair.recording, pair.rungs, f'{pair.train} -> {pair.held_out}'
    else:
        recording, rungs = found.held_out[0], found.rungs
        title = f'held out: {recording.name}'
    rung = best_rung(rungs)
    inside = slice(None, None, max(1, recording.force.size // _LONGEST))
    axes.plot(
        1e3 * recording.displacement[inside],
        recording.force[inside],
        color=_GREY,
        linewidth=0.7,
        label='measured',
    )
    predicted = predicted_force(rung.law, rung.values, recording)
    axes.plot(
        1e3 * recording.displacement[inside],
        predicted[inside],
        color=_RED,
        linewidth=0.8,
        label=rung.law.name,
    )
    axes.set_title(title, fontsize='small')
    axes.set(xlabel='displacement (mm)', ylabel='friction force (N)')
    axes.legend(fontsize='small')


def _shown(count: int, dt: float) -> slice:
    """Return the last three seconds, where strokes are short enough to be seen."""
    return slice(max(0, count - round(3.0 / dt)), count)
