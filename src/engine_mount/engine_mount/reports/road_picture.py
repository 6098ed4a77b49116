"""Picture of a measured road: its heights, and their density between the classes of ISO 8608."""

from pathlib import Path

import matplotlib

matplotlib.use('Agg')

import numpy as np
from matplotlib.figure import Figure

from engine_mount.reports.drawing.chart import COLOURS, LEVEL_COLOUR, SPAN_COLOUR
from engine_mount.signals.roads.iso8608 import (
    CLASSES,
    FIRST_LIMIT,
    LONGEST_WAVE,
    RoadProfile,
    Unevenness,
    without_long_waves,
)
from mount_sim.excitation.road import REFERENCE_FREQUENCY


def draw_road(profile: RoadProfile, found: Unevenness, file: Path) -> None:
    """Write the picture to `file` (PNG): heights without long waves, and density with the fitted line."""
    picture = Figure(figsize=(10.0, 6.5), layout='constrained')
    above, below = picture.subplots(2, 1, height_ratios=(2, 3))
    heights = 1e3 * without_long_waves(profile.height, profile.spacing)
    above.plot(profile.distance, heights, color=COLOURS[0], linewidth=0.7)
    above.set(xlabel='distance (m)', ylabel=f'height (mm), waves up to {LONGEST_WAVE:g} m')
    ends = np.array([found.frequency[0], found.frequency[-1]])
    for number, letter in enumerate(CLASSES[:-1]):
        limits = FIRST_LIMIT * 4.0**number * (ends / REFERENCE_FREQUENCY) ** -2.0
        below.loglog(ends, limits, color=SPAN_COLOUR, linewidth=0.6)
        place = (ends[0], 0.5 * limits[0])
        below.annotate(letter, place, color=SPAN_COLOUR, fontsize=8, ha='right', va='center')
    below.loglog(found.frequency, found.density, color=COLOURS[0], label='measured, smoothed')
    fitted = np.array([found.lowest, found.highest])
    line = found.roughness * (fitted / REFERENCE_FREQUENCY) ** -found.waviness
    label = f'class {found.letter}, waviness {found.waviness:.2f}'
    below.loglog(fitted, line, '--', color=LEVEL_COLOUR, label=label)
    below.set(xlabel='spatial frequency (cycles/m)', ylabel='density of the height (m³)')
    below.legend(loc='lower left', fontsize='small')
    for axes in (above, below):
        axes.grid(alpha=0.25)
    picture.suptitle(f'{profile.name}: road of {profile.length:.0f} m')
    picture.savefig(file, dpi=100)
