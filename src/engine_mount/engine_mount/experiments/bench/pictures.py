"""Pictures of the rack, Fig. 13."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from engine_mount.experiments.bench.evaluation import COULOMB, HYDRO, OFF, ORDERS, Loop
from engine_mount.experiments.harness.drawing import BLUE, family, finish, new_figure
from engine_mount.reports.drawing.style import COLOURS, HYDROMOUNT_COLOUR, UNDAMPED_COLOUR
from engine_mount.reports.sections.charts import decibels


def draw_hysteresis(loops: dict[str, Loop], dampers: list[str], title: str, file: Path) -> Path:
    """Draw mount force over displacement for the family of characteristics, Fig. 13 left."""
    figure = new_figure(f'Loss hysteresis of the mount at {title} (Fig. 13 left)', 6.0)
    axes = figure.subplots()
    lines = [(OFF, UNDAMPED_COLOUR, '-', 1.4)]
    lines += [(name, colour, '-', 1.4) for name, colour in zip(dampers, family(len(dampers)), strict=True)]
    lines += [(HYDRO, HYDROMOUNT_COLOUR, '--', 2.0)]
    for name, colour, dash, width in lines:
        loop = loops[name]
        loss = 1e3 * loop.figures['loss_energy_j']
        axes.plot(
            1e3 * loop.displacement,
            loop.force,
            color=colour,
            linestyle=dash,
            linewidth=width,
            label=f'{name}: {loss:.0f} mJ per cycle',
        )
    axes.set_xlabel('displacement of the mount (mm)')
    axes.set_ylabel('mount force (N)')
    axes.legend(fontsize='small', loc='upper left')
    return finish(figure, file)


def draw_harmonics(loops: dict[str, Loop], damper: str, title: str, file: Path) -> Path:
    """Draw harmonics 1 to 8 of the mount force as dots in dB, Fig. 13 right."""
    figure = new_figure(f'Harmonics of the mount force at {title} (Fig. 13 right)')
    axes = figure.subplots()
    places = np.arange(1, ORDERS + 1)
    shown = (
        (damper, f'friction mount, {damper}', BLUE),
        (HYDRO, HYDRO, HYDROMOUNT_COLOUR),
        (COULOMB, 'plain Coulomb', COLOURS[1]),
    )
    least = -40.0  # dB above 1 N: below it a dot tells nothing
    for number, (name, label, colour) in enumerate(shown):
        found = loops[name].figures
        level = np.maximum(decibels(np.asarray(found['harmonics_n'])), least)
        beside = places + 0.12 * (number - 1)  # so that dots of one height do not hide each other
        axes.vlines(beside, least, level, color=colour, linewidth=0.8, alpha=0.5)
        axes.plot(
            beside,
            level,
            'o',
            color=colour,
            label=f'{label}: THD {100 * found["thd"]:.1f} %',
        )
    axes.set_ylim(bottom=least)
    axes.set_xticks(places)
    axes.set_xlabel('order of the harmonic (1)')
    axes.set_ylabel('amplitude above 1 N (dB)')
    axes.legend(fontsize='small')
    return finish(figure, file)
