"""The same figures from an independent computation of the same equations, and how near ours come to them.

They were made for this project by another program; no measurement is among them.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from engine_mount.drives.bands import ISOLATION_BANDS

if TYPE_CHECKING:
    from engine_mount.experiments.sensitivity.maps import Maps

DAMPER = {'law': 'viscous', 'damping_coefficient': 2500.0}
"""The characteristic of its sweeps, N s/m."""

PEAK_RATIOS = {0.04: 1.93, 0.06: 1.78, 0.08: 1.09, 0.10: 0.89, 0.12: 0.72, 0.16: 0.57, 0.20: 0.48}
"""{V0: friction mount over hydromount, largest displacement}; R_d 1e8, asymmetry 0.25, no idle force."""

ACCELERATION_RATIOS = {
    (2e7, 0.0): (1.00, 1.00, 1.19),
    (2e7, 80.0): (1.01, 1.01, 1.06),
    (2e7, 200.0): (1.01, 1.01, 1.03),
    (2e7, 400.0): (1.02, 1.02, 1.02),
    (5e7, 0.0): (1.01, 1.04, 1.36),
    (5e7, 80.0): (0.97, 0.94, 1.01),
    (5e7, 200.0): (0.94, 0.92, 0.94),
    (5e7, 400.0): (0.93, 0.92, 0.93),
    (1e8, 0.0): (1.03, 1.11, 1.39),
    (1e8, 80.0): (0.94, 0.88, 0.93),
    (1e8, 200.0): (0.86, 0.84, 0.85),
    (1e8, 400.0): (0.84, 0.83, 0.84),
}
"""{(R_d, F_i): ratios in the bands above 14 Hz}; V0 0.12, asymmetry 0.25."""

LOWER_HARMONICS = {
    (2e7, 0.25): 8,
    (5e7, 0.25): 8,
    (1e8, 0.25): 8,
    (2e8, 0.25): 7,
    (2e7, 0.0): 4,
    (5e7, 0.0): 4,
    (1e8, 0.0): 4,
}
"""{(R_d, asymmetry): harmonics of 8 in which the friction mount is lower}."""

NEAR = 0.03
"""Agreement means that a ratio differs by at most so much of itself (chosen)."""


def agreement(maps: Maps) -> str:
    """Return a table of those reference figures whose values are in the grid, and a sentence on them."""
    rows = [*_peaks(maps), *_accelerations(maps), *_harmonics(maps)]
    if not rows:
        return 'None of its values is in this grid.\n'
    agreed = sum(near for *_, near in rows)
    lines = [
        'Another program, written for this project from the same equations, gave the figures below, the '
        'displacements with a viscous damper of 2500 N s/m; so here, for this comparison, with that one too. '
        f'{agreed} of {len(rows)} agree within {100 * NEAR:.0f} % (counts: exactly). Where other figures of '
        'it differ, on rack and gap, and which of the two is wrong: [differences.md](differences.md).\n',
        '| figure | there | here | agrees |',
        '|---|---|---|---|',
    ]
    lines += [
        f'| {what} | {there} | {here} | {"yes" if near else "no"} |' for what, there, here, near in rows
    ]
    return '\n'.join(lines) + '\n'


Row = tuple[str, str, str, bool]


def _peaks(maps: Maps) -> list[Row]:
    axes, rows = maps.axes, []
    if not (1e8 in axes.resistances and 0.25 in axes.asymmetries and 0.0 in axes.idle_forces):
        return []
    place = (axes.resistances.index(1e8), axes.asymmetries.index(0.25), axes.idle_forces.index(0.0))
    for level, there in PEAK_RATIOS.items():
        if level in axes.levels:
            k = axes.levels.index(level)
            hydro = maps.friction_peak[k, place[2]] / maps.peak[(k, *place)]
            what = f'displacement, V0 = {level:g} m/s, R_d = 1e+08, F_i = 0 N'
            rows.append(_row(what, there, float(maps.peak_as_there[level] / hydro)))
    return rows


def _accelerations(maps: Maps) -> list[Row]:
    axes, rows = maps.axes, []
    if not (0.12 in axes.levels and 0.25 in axes.asymmetries):
        return []
    level, asymmetry = axes.levels.index(0.12), axes.asymmetries.index(0.25)
    for (resistance, force), expected in ACCELERATION_RATIOS.items():
        if resistance not in axes.resistances or force not in axes.idle_forces:
            continue
        place = (level, axes.resistances.index(resistance), asymmetry, axes.idle_forces.index(force))
        for band, (low, high) in enumerate(ISOLATION_BANDS):
            here = float(maps.rms[(band, *place)])
            what = f'acceleration, R_d = {resistance:.0e}, F_i = {force:g} N, {low:.0f} to {high:.0f} Hz'
            if here == here:  # known
                rows.append(_row(what, expected[band], here))
    return rows


def _harmonics(maps: Maps) -> list[Row]:
    rows = []
    for key, there in LOWER_HARMONICS.items():
        if key in maps.below:
            here = len(maps.below[key])
            what = f'lower harmonics, R_d = {key[0]:.0e}, asymmetry {key[1]:g}'
            rows.append((what, f'{there} of 8', f'{here} of 8', here == there))
    return rows


def _row(what: str, there: float, here: float) -> Row:
    # the reference is printed with two digits behind the point
    return what, f'{there:.2f}', f'{here:.2f}', abs(here - there) <= NEAR * there + 0.005
