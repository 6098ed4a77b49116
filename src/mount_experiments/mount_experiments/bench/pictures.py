"""Pictures of the rack, Fig. 13."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from mount_experiments.bench.evaluation import COULOMB, HYDRO, OFF, ORDERS, Loop
from mount_experiments.harness.drawing import BLUE, GREY, RED, family, finish, new_figure


def draw_hysteresis(loops: dict[str, Loop], dampers: list[str], title: str, file: Path) -> Path:
    """Draw mount force over displacement for the family of characteristics, Fig. 13 left."""
    figure = new_figure(f'Loss hysteresis of the mount at {title} (Fig. 13 left)', 6.0)
    axes = figure.subplots()
    lines = [(OFF, 'black', '-', 1.4)]
    lines += [(name, colour, '-', 1.4) for name, colour in zip(dampers, family(len(dampers)), strict=True)]
    lines += [(HYDRO, RED, '--', 2.0)]
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
    """Draw harmonics 1 to 8 of the mount force as bars, Fig. 13 right."""
    figure = new_figure(f'Harmonics of the mount force at {title} (Fig. 13 right)')
    axes = figure.subplots()
    places = np.arange(1, ORDERS + 1)
    shown = (
        (damper, f'friction mount, {damper}', BLUE),
        (HYDRO, HYDRO, RED),
        (COULOMB, 'plain Coulomb', GREY),
    )
    least = 0.01  # N: below it a bar tells nothing
    for number, (name, label, colour) in enumerate(shown):
        found = loops[name].figures
        axes.bar(
            places + 0.27 * (number - 1),
            np.maximum(found['harmonics_n'], least),
            0.25,
            color=colour,
            label=f'{label}: THD {100 * found["thd"]:.1f} %',
        )
    axes.set_yscale('log')
    axes.set_ylim(bottom=least)
    axes.set_xticks(places)
    axes.set_xlabel('order of the harmonic (1)')
    axes.set_ylabel('amplitude (N), logarithmic')
    axes.legend(fontsize='small')
    return finish(figure, file)
