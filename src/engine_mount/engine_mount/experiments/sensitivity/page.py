"""The page about the sensitivity: where each mount wins, in words made from the numbers."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from engine_mount.drives.bands import ISOLATION_BANDS
from engine_mount.experiments.sensitivity.maps import EVEN_WITHIN, higher, lower
from engine_mount.experiments.sensitivity.reference import agreement

if TYPE_CHECKING:
    from engine_mount.experiments.sensitivity.maps import Maps, SensitivityParameters
    from engine_mount.reports.drive.signals import FloatArray

_EVEN = (2, 4, 6, 8)
_HEAD = """# Friction mount or hydromount: what the answer depends on

The paper found its friction mount better than the original hydromount. Its text gives neither the road level
nor whether the engine ran during the sweep, and nothing about the hydromount. What is not given had to be
chosen for the simulation, and the choice decides part of the comparison. So no single scenario stands here as
evidence: this page shows all combinations. `engine-mount experiment sensitivity` writes it from the numbers;
nobody edits it.
"""
_LIMITS = """## Limits

- One simulated car, one seed, one set of all other values; hydromount and car have magnitudes as in the
  literature, not those of the authors.
- Controller and pads share the friction law, and the initialisation is that of a healthy actuator.
- The runs of the grid go through the same closed loop as `engine-mount drive --core`, but are not recorded.
  Any of them can be repeated with a recording, for instance
  `engine-mount drive --core --scenario sweep --mount hydro --set mount_sim.sweep.velocity_amplitude=0.06
  --set mount_sim.hydromount.decoupler_resistance=2e7`.
- A sweep passes each frequency once. What a mount does on a real road in a mixture of all of them, this page
  does not tell; a minute of one is in [recorded_drive.md](recorded_drive.md).
"""


def in_short(maps: Maps) -> dict[str, str]:
    """Return one plain text for each of displacement, acceleration, harmonics."""
    return {
        'displacement': _displacement(maps),
        'acceleration': _acceleration(maps),
        'harmonics': _harmonics(maps),
    }


def write_results(
    maps: Maps, parameters: SensitivityParameters, runs: int, pictures: list[Path], file: Path
) -> Path:
    """Write the page to `file` and return it; its pictures are expected in `figures/`."""
    told = in_short(maps)
    peaks, acceleration = (picture.name for picture in pictures)
    parts = [
        _HEAD,
        _varied(maps, parameters, runs),
        '## In short\n',
        '\n'.join(f'- **{name.capitalize()}.** {text}' for name, text in told.items()) + '\n',
        '## Displacement near the resonance\n',
        f'![Largest displacement, friction mount over hydromount](figures/{peaks})\n',
        _peak_table(maps),
        '## Chassis acceleration where damping is off\n',
        f'![Chassis acceleration, friction mount over hydromount](figures/{acceleration})\n',
        _share_table(maps),
        _asymmetry(maps),
        '## Harmonics on the rack, 8 Hz and 1 mm\n',
        _harmonics_table(maps),
        '## Beside an independent computation\n',
        agreement(maps),
        _LIMITS,
    ]
    file.parent.mkdir(parents=True, exist_ok=True)
    file.write_text('\n'.join(parts), encoding='utf-8')
    return file


def _varied(maps: Maps, parameters: SensitivityParameters, runs: int) -> str:
    axes = maps.axes
    return (
        '| varied | values |\n|---|---|\n'
        f'| road level V0, vertical velocity under the wheel | {_listed(axes.levels)} m/s |\n'
        f'| resistance R_d of the decoupler | {_listed(axes.resistances)} Pa s/m^3 |\n'
        f'| asymmetry of the upper chamber C_1 | {_listed(axes.asymmetries)} |\n'
        f'| idle force F_i | {_listed(axes.idle_forces)} N |\n\n'
        f'{runs} runs; sweep from 1 to {parameters.last_frequency:g} Hz at 1 Hz/s, damper '
        f'{parameters.damper}. A ratio below 1 means that the friction mount has less; '
        f'within {100 * EVEN_WITHIN:.0f} % of 1 the two count as even (chosen). The friction mount '
        'itself does not depend on the two values of the hydromount.\n'
    )


def _displacement(maps: Maps) -> str:
    axes = maps.axes
    always = [level for k, level in enumerate(axes.levels) if lower(maps.peak[k]).all()]
    never = [level for k, level in enumerate(axes.levels) if higher(maps.peak[k]).all()]
    mixed = [level for level in axes.levels if level not in always and level not in never]
    parts = [
        'The largest displacement from 3 to 14 Hz is smaller with the friction mount than with the '
        f'hydromount in {_counted(maps.peak)} combinations'
    ]
    for levels, text in (
        (always, 'it wins whatever the rest'),
        (never, 'it loses whatever the rest'),
        (mixed, 'it depends on the rest, or they are even'),
    ):
        if levels:
            parts.append(f'at V0 = {_listed(levels)} m/s {text}')
    highest = np.unravel_index(int(np.argmax(maps.peak)), maps.peak.shape)
    lowest = np.unravel_index(int(np.argmin(maps.peak)), maps.peak.shape)
    return (
        '; '.join(parts)
        + f'. The ratio reaches from {maps.peak[lowest]:.2f} ({_where(maps, lowest)}) to '
        + f'{maps.peak[highest]:.2f} ({_where(maps, highest)}). '
        + _why(maps)
    )


def _why(maps: Maps) -> str:
    """Say by how much each mount's displacement follows the road level."""
    levels = maps.axes.levels
    if len(levels) < 2:
        return ''
    growth = maps.friction_peak[-1, 0] / maps.friction_peak[0, 0]
    hydro = maps.friction_peak / maps.peak[:, 0, 0, :]
    return (
        f'From V0 = {levels[0]:g} to {levels[-1]:g} m/s the largest displacement grows by a factor of '
        f'{growth:.1f} with the friction mount and {hydro[-1, 0] / hydro[0, 0]:.1f} with the hydromount '
        '(first values of the rest): the switched mount first lets the engine move up to its switch-on level.'
    )


def _acceleration(maps: Maps) -> str:
    axes = maps.axes
    rms = maps.rms[~np.isnan(maps.rms).any(axis=(1, 2, 3, 4))]
    if not len(rms):
        return 'The sweep ends before 20 Hz.'
    forces = [f'F_i = {f:g} N: {_counted(rms[..., k])}' for k, f in enumerate(axes.idle_forces)]
    decouplers = [f'R_d = {r:.0e}: {_counted(rms[:, :, k])}' for k, r in enumerate(axes.resistances)]
    bands = ', '.join(f'{low:.0f} to {high:.0f}' for low, high in ISOLATION_BANDS[: len(rms)])
    return (
        f'In the bands {bands} Hz the chassis has less acceleration with the friction mount in '
        f'{_counted(rms)} combinations of a band and the rest (ratio {_range(rms)}). By idle force, '
        f'{"; ".join(forces)}. By decoupler, {"; ".join(decouplers)}. {_extremes(maps)}'
    )


def _extremes(maps: Maps) -> str:
    known = np.nanmean(maps.rms, axis=0)
    best = np.unravel_index(int(np.nanargmin(known)), known.shape)
    worst = np.unravel_index(int(np.nanargmax(known)), known.shape)
    return (
        f'On the mean over the bands it is best for the friction mount at {_where(maps, best)} '
        f'({known[best]:.2f}), worst at {_where(maps, worst)} ({known[worst]:.2f}).'
    )


def _harmonics(maps: Maps) -> str:
    texts = []
    for asymmetry in maps.axes.asymmetries:
        counts = [
            f'{len(orders)} of 8 at R_d = {key[0]:.0e}'
            for key, orders in maps.below.items()
            if key[1] == asymmetry
        ]
        texts.append(f'chamber asymmetry {asymmetry:g}: {", ".join(counts)}')
    odd = [key for key, orders in maps.below.items() if not {1, 3, 5, 7} <= set(orders)]
    lost = (
        'The odd ones are lower everywhere'
        if not odd
        else f'An odd one is not lower at {"; ".join(f"R_d = {r:.0e}, asymmetry {a:g}" for r, a in odd)}'
    )
    return f'Number of harmonics in which the friction mount is lower: {"; ".join(texts)}. {lost}.'


def _where(maps: Maps, place: tuple[np.intp, ...]) -> str:
    level, resistance, asymmetry, idle = (values[int(k)] for values, k in zip(maps.axes, place, strict=True))
    return f'V0 = {level:g} m/s, R_d = {resistance:.0e}, asymmetry {asymmetry:g}, F_i = {idle:g} N'


def _peak_table(maps: Maps) -> str:
    axes = maps.axes
    lines = _head(
        "Over all decouplers and chambers: the friction mount's largest displacement, and the range of its "
        'ratio to the hydromount.',
        'V0 (m/s)',
        [f'F_i = {force:g} N' for force in axes.idle_forces],
    )
    for k, level in enumerate(axes.levels):
        cells = [
            f'{1e3 * maps.friction_peak[k, i]:.2f} mm; {_range(maps.peak[k, :, :, i])}'
            for i in range(len(axes.idle_forces))
        ]
        lines.append(f'| {level:g} | ' + ' | '.join(cells) + ' |')
    return '\n'.join(lines) + '\n'


def _share_table(maps: Maps) -> str:
    axes = maps.axes
    lines = _head(
        'Over all road levels, decouplers and chambers: in how many the friction mount is lower, and the '
        'range of the ratio.',
        'band',
        [f'F_i = {force:g} N' for force in axes.idle_forces],
    )
    for band, (low, high) in enumerate(ISOLATION_BANDS):
        cells = []
        for i in range(len(axes.idle_forces)):
            ratios = maps.rms[band, ..., i]
            cells.append('not reached' if np.isnan(ratios).any() else f'{_counted(ratios)}; {_range(ratios)}')
        lines.append(f'| {low:.0f} to {high:.0f} Hz | ' + ' | '.join(cells) + ' |')
    return '\n'.join(lines) + '\n'


def _asymmetry(maps: Maps) -> str:
    """Say how much the chamber's asymmetry moves the ratios of the sweep."""
    if len(maps.axes.asymmetries) < 2:
        return ''
    peak, rms = np.ptp(maps.peak, axis=2), np.ptp(maps.rms, axis=3)
    told = '' if np.isnan(rms).all() else f', those of the acceleration by at most {np.nanmax(rms):.2f}'
    return (
        f'Between the asymmetries of the chamber ({_listed(maps.axes.asymmetries)}) the ratios of the '
        f'displacement differ by at most {peak.max():.2f}{told}.\n'
    )


def _harmonics_table(maps: Maps) -> str:
    axes = maps.axes
    lines = _head(
        'Harmonics in which the friction mount is lower.',
        'R_d (Pa s/m^3)',
        [f'asymmetry {value:g}' for value in axes.asymmetries],
    )
    for resistance in axes.resistances:
        cells = [_orders(maps.below[resistance, asymmetry]) for asymmetry in axes.asymmetries]
        lines.append(f'| {resistance:.0e} | ' + ' | '.join(cells) + ' |')
    even = [f'{_largest_even(maps, value):.2f} N with asymmetry {value:g}' for value in axes.asymmetries]
    lines.append(
        f'\nThe largest even harmonic of the hydromount is {", ".join(even)}. The asymmetry was put into its '
        'model so that there are even harmonics; an advantage in them is therefore no finding.'
    )
    return '\n'.join(lines) + '\n'


def _head(sentence: str, first: str, columns: list[str]) -> list[str]:
    """Return the first lines of a table under a sentence."""
    return [f'{sentence}\n', f'| {first} | ' + ' | '.join(columns) + ' |', '|---|' + '---|' * len(columns)]


def _largest_even(maps: Maps, asymmetry: float) -> float:
    found = [each for key, each in maps.hydro_harmonics.items() if key[1] == asymmetry]
    return max(each[order - 1] for each in found for order in _EVEN)


def _orders(orders: list[int]) -> str:
    return 'all 8' if len(orders) == 8 else ', '.join(str(order) for order in orders) or 'none'


def _counted(ratios: FloatArray) -> str:
    won, lost = int(np.sum(lower(ratios))), int(np.sum(higher(ratios)))
    even = ratios.size - won - lost
    return f'{won} of {ratios.size}' + (f' ({even} even)' if even else '')


def _range(ratios: FloatArray) -> str:
    return f'{ratios.min():.2f} to {ratios.max():.2f}'


def _listed(values: list[float]) -> str:
    return ', '.join(f'{value:g}' for value in values)
