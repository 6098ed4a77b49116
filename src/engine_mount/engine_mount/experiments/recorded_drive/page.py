"""The page about a recorded drive: bands and events in numbers, and what the comparison cannot tell."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

from engine_mount.experiments.recorded_drive.evaluation import ELASTOMER, FRICTION, HYDRO, ratios, while_on

if TYPE_CHECKING:
    from collections.abc import Sequence

_HEAD = """# A recorded drive: friction mount, hydromount, elastomer alone

`engine-mount experiment recorded_drive` writes this page from its numbers; nobody edits it. `make
experiments` writes it anew where the recording lies beside this repository, in
`../shared/data/motorway_i280`; elsewhere it stays as it was last written. The recording is not part of this
project. Any other vertical acceleration (CSV, NPY, MCAP) can take its place:

```
engine-mount experiment recorded_drive --set recorded_drive.file=drive.csv --set recorded_drive.column=az \\
  --set recorded_drive.scale=-1
```
"""
_LIMITS = """## Limits of this comparison

- **The sensor is not at the mount.** The recording of the I-280 is that of a device behind the windscreen.
  What it feels there, after body, holder and its own noise, is taken as the motion of the chassis at the
  engine mount.
- **It was measured under another engine mount.** What that car's own engine and mounts did to the body is in
  the recording already, and is no excitation by the road.
- **Its bandwidth is small.** It has {rate}: nothing above {nyquist} is known, and what lay above may
  be folded below. Of the acoustics, up to 400 Hz, it tells nothing; no engine vibration is added.
- **No feedback from force to chassis.** The chassis moves as recorded, whatever the mount does. So its
  acceleration is the same with all mounts, and the force on it is compared instead. A mount that pushes more
  would in a car also move the chassis, and be moved by it.
- **The hydromount's parameters are chosen**, as are the elastomer's and the engine's mass: magnitudes as in
  the literature, not those of this car nor those of the authors. What depends on them:
  [results.md](results.md).
- **Friction acts only after the displacement left {level} for one period.** Such events are few in one drive:
  a figure over the whole of it mostly compares a soft spring with a hydromount, and figures of the events
  stand on a handful of them.
"""


def write_recorded_drive(figures: dict[str, Any], pictures: Sequence[Path], rate: float, file: Path) -> Path:
    """Write the page to `file` and return it; `rate` (Hz) is that of the recording's sensor.

    Its pictures are expected in `figures/`.
    """
    spectra, traces = (picture.name for picture in pictures)
    parts = [
        _HEAD,
        _drive(figures, rate),
        '## In short\n',
        _in_short(figures),
        '## Spectra and bands\n',
        f'![Spectra of displacement and force](figures/{spectra})\n',
        _parts(figures),
        _bands(figures, 'displacement', 'displacement', 'm', 1e3),
        _bands(figures, 'force on the chassis', 'force', 'n', 1.0),
        '## When damping was on\n',
        f'![Displacement over time](figures/{traces})\n',
        _events(figures),
        _LIMITS.format(
            rate=f'{rate:.0f} samples per second',
            nyquist=f'{rate / 2.0:.0f} Hz',
            level=f'{1e3 * figures["switch_on_level_m"]:g} mm',
        ),
    ]
    file.parent.mkdir(parents=True, exist_ok=True)
    file.write_text('\n'.join(parts), encoding='utf-8')
    return file


def _drive(figures: dict[str, Any], rate: float) -> str:
    bands = ', '.join(
        f'{value:.3f} m/s^2 from {low:g} to {high:g} Hz'
        for (low, high), value in zip(figures['bands_hz'], figures['acceleration_band_rms_m_s2'], strict=True)
    )
    column = f', `{figures["column"]}`' if figures['column'] else ''
    return (
        f'Driven: `{figures["source"]}`{column}, times {figures["scale"]:g}, '
        f'{figures["duration_s"]:.1f} s at {rate:.0f} samples per second, without its mean. '
        f'Acceleration, rms: {bands}. Damper {figures["damper"]}; mode {figures["mode"]}.\n'
    )


def _in_short(figures: dict[str, Any]) -> str:
    lines = []
    for where, suffix in (('At the moments of damping', 'at_events'), ('Else', 'else')):
        for what, unit in (('displacement', 'm'), ('force', 'n')):
            key = f'{what}_band_rms_{suffix}_{unit}'
            told = [
                f'{low:g} to {high:g} Hz {hydro:.2f} of the hydromount, {soft:.2f} of the elastomer alone'
                for (low, high), hydro, soft in zip(
                    figures['bands_hz'], ratios(figures, key), ratios(figures, key, ELASTOMER), strict=False
                )
            ]
            if told:
                lines.append(f'- **{where}, {what}** with the friction mount, rms: {"; ".join(told)}.')
    peaks = {name: 1e3 * each['displacement_peak_m'] for name, each in figures['runs'].items()}
    listed = ', '.join(f'{name} {peak:.2f} mm' for name, peak in peaks.items())
    lines.append(f'- **Largest displacement**: {listed}.')
    return '\n'.join(lines) + '\n'


def _bands(figures: dict[str, Any], what: str, name: str, unit: str, scale: float) -> str:
    bands = [f'{low:g} to {high:g} Hz' for low, high in figures['bands_hz']]
    shown = {'m': 'mm', 'n': 'N'}[unit]
    lines = [
        f'Rms of the {what} in {shown}:\n',
        '| part of the drive | mount | ' + ' | '.join(bands) + ' |',
        '|---|---|' + '---|' * len(bands),
    ]
    for part, suffix in (('whole', ''), ('moments of damping', 'at_events_'), ('the rest', 'else_')):
        for mount in (FRICTION, HYDRO, ELASTOMER):
            values = figures['runs'][mount][f'{name}_band_rms_{suffix}{unit}']
            if values is not None:
                cells = ' | '.join(f'{scale * value:.3g}' for value in values)
                lines.append(f'| {part} | {mount} | {cells} |')
    return '\n'.join(lines) + '\n'


def _parts(figures: dict[str, Any]) -> str:
    return (
        f'Moments of damping are those with the friction damper on, and {figures["events_margin_s"]:.3f} s '
        f'before and behind: {100.0 * figures["events_share"]:.1f} % of the drive, the same ones for all '
        'mounts. In the rest the friction mount is the elastomer alone. The whole is from its spectrum, the '
        'parts are by a band-pass that halves the amplitude at the edges of a band; so they do not add up.\n'
    )


def _events(figures: dict[str, Any]) -> str:
    share = 100.0 * figures['damping_active_share']
    return (
        f'Damping went on {figures["times_on"]} times and was on for {share:.1f} % of the drive '
        f'(switch-on level {1e3 * figures["switch_on_level_m"]:g} mm). {while_on(figures)}\n'
    )
