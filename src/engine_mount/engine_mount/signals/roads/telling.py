"""What a road is, in rows and figures."""

from typing import Any

import numpy as np

from engine_mount.signals.roads.driving import kept_frequency
from engine_mount.signals.roads.iso8608 import Unevenness
from engine_mount.signals.roads.long_waves import LONGEST_WAVE, without_long_waves
from engine_mount.signals.roads.plausibility import root_mean_square
from engine_mount.signals.roads.profile import RoadProfile
from engine_mount.signals.roads.speed import Speed


def as_rows(profile: RoadProfile, found: Unevenness, speed: Speed | None) -> list[tuple[str, str]]:
    """Return rows of a table about a road, and at `speed` which frequencies it holds."""
    short = without_long_waves(profile.height, profile.spacing)
    rows = [
        ('format', profile.provenance.format),
        ('length', f'{profile.length:.1f} m, a height every {1e3 * profile.spacing:.4g} mm'),
        ('heights', f'{np.ptp(profile.height):.3g} m from the lowest to the highest'),
        (
            f'up to {LONGEST_WAVE:g} m',
            f'{1e3 * root_mean_square(short):.3g} mm rms, {1e3 * np.ptp(short):.3g} mm in all',
        ),
        ('ISO 8608', f'class {found.letter}{" (a guess)" if found.beyond else ""}'),
        ('Gd(0.1 cycles/m)', f'{1e6 * found.roughness:.3g}e-6 m^3'),
        ('waviness', f'{found.waviness:.2f}'),
    ]
    rows += [
        ('comes again', f'every {period.wavelength:.3g} m, {1e3 * period.amplitude:.2g} mm')
        for period in found.periods
    ]
    if speed is not None:
        lowest, highest = speed.mean / min(profile.length, LONGEST_WAVE), kept_frequency(profile, speed)
        rows.append(
            (
                f'at {3.6 * speed.mean:.4g} km/h',
                f'{profile.length / speed.mean:.1f} s; {lowest:.2g} .. {highest:.4g} Hz',
            )
        )
        rows += [
            ('', f'{period.wavelength:.3g} m are met at {speed.mean / period.wavelength:.3g} Hz')
            for period in found.periods
        ]
    return rows


def as_figures(profile: RoadProfile, found: Unevenness) -> dict[str, Any]:
    """Return the figures of a road as plain data."""
    return {
        'uri': profile.provenance.uri,
        'sha256': profile.provenance.sha256,
        'format': profile.provenance.format,
        'length_m': profile.length,
        'spacing_m': profile.spacing,
        'rms_m': root_mean_square(without_long_waves(profile.height, profile.spacing)),
        'class': found.letter,
        'roughness_m3': found.roughness,
        'waviness': found.waviness,
        'fitted_cycles_per_m': [found.lowest, found.highest],
        'class_is_a_guess': found.beyond,
        'periods': [period._asdict() for period in found.periods],
        'notes': list(profile.notes),
    }
