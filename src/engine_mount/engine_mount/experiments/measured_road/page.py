"""The page about a measured road: every mount at every speed in numbers, and what they cannot tell."""

from collections.abc import Sequence
from pathlib import Path
from typing import Any

_HEAD = """# A measured road: policies, hydromount, no current

`engine-mount experiment measured_road` writes this page from its numbers; nobody edits it. The blocks are
those of [drive a measured road](../how-to/drive_a_measured_road.md).
"""
_CLEAR = 2.0  # %, chosen: two rms count as even within so much of each other
_LIMITS = """## Limits of this comparison

- **One wheel.** The vehicle model is a quarter of a car: one track, no axle behind, no roll.
- **The tyre is a spring** that feels the mean of the road over {contact:g} m. A real tyre rolls over stones
  in a way that no mean tells, most of all at low speed.
- **Vehicle, engine and hydromount are chosen**, magnitudes as in the literature ([results.md](results.md)).
- **No engine vibration is added**, so nothing is said of idle.
- Figures begin 1 s after the road, which fades in.
"""


def write_measured_road(figures: dict[str, Any], pictures: Sequence[Path], file: Path) -> Path:
    """Write the page to `file` and return it; its pictures are expected in `figures/`."""
    parts = [_HEAD, _road(figures), f'![The road](figures/{pictures[0].name})\n']
    parts += [_table(speed, runs, figures['bands_hz']) for speed, runs in figures['runs'].items()]
    parts += [_in_words(figures), _LIMITS.format(contact=figures['contact_length_m'])]
    file.parent.mkdir(parents=True, exist_ok=True)
    file.write_text('\n'.join(parts), encoding='utf-8')
    return file


def _road(figures: dict[str, Any]) -> str:
    told = '. '.join(sentence[0].upper() + sentence[1:] for sentence in figures['road'])
    command = f'engine-mount experiment measured_road --set measured_road.road={figures["source"]}'
    lateral = f' --set measured_road.lateral={figures["lateral_m"]:g}' if figures['lateral_m'] else ''
    return (
        f'`{command}{lateral}`\n\nDriven: `{figures["source"]}`, {figures["length_m"]:.0f} m, a height every '
        f'{1e3 * figures["spacing_m"]:.3g} mm. {told}.\n'
    )


def _table(speed: str, runs: dict[str, Any], bands: list[list[float]]) -> str:
    seconds = next(iter(runs.values()))['seconds']
    heads = [f'{low:g} to {high:g} Hz' for low, high in bands]
    lines = [
        f'## {speed} km/h\n',
        f'{seconds:.1f} s. Displacement of the mount, rms and largest; acceleration of the chassis, rms in '
        'm/s²:\n',
        '| mount | rms (mm) | largest (mm) | ' + ' | '.join(heads) + ' | heat of the pads (W) |',
        '|---|---|---|' + '---|' * (len(heads) + 1),
    ]
    for who, run in runs.items():
        accelerations = ' | '.join(f'{value:.3f}' for value in run['acceleration_band_rms_m_s2'])
        lines.append(
            f'| {who} | {1e3 * run["displacement_rms_m"]:.3f} | {1e3 * run["displacement_peak_m"]:.2f} | '
            f'{accelerations} | {run["friction_power_w"]:.2f} |'
        )
    return '\n'.join(lines) + '\n'


def _in_words(figures: dict[str, Any]) -> str:
    """Return who has the least of what, at each speed, as it came out."""
    lines = ['## In words\n']
    bands = figures['bands_hz']
    for speed, runs in figures['runs'].items():
        least = [f'rms displacement {_least(runs, lambda run: run["displacement_rms_m"])}']
        for place, (low, high) in enumerate(bands):
            who = _least(runs, lambda run, place=place: run['acceleration_band_rms_m_s2'][place])
            least.append(f'acceleration {low:g} to {high:g} Hz {who}')
        lines.append(f'- At {speed} km/h the least has: {"; ".join(least)}.')
    return '\n'.join(lines) + '\n'


def _least(runs: dict[str, Any], value: Any) -> str:
    """Return who has the least, and by how much less than the next."""
    first, second = sorted(runs, key=lambda who: value(runs[who]))[:2]
    share = 100.0 * (1.0 - value(runs[first]) / value(runs[second])) if value(runs[second]) else 0.0
    if share < _CLEAR:
        return f'nobody clearly (within {_CLEAR:g} %)'
    return f'{first} ({share:.0f} % less than {second})'
