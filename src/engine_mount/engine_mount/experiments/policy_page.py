"""The page about the policies, written from the numbers."""

from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np

from engine_mount.experiments.harness.contract import Settings, Values, write_page
from engine_mount.experiments.policy_cases import CONTINUOUS, PAPER, POLICIES

_HEAD = f"""# Control policies side by side

`engine-mount experiment policy` writes this page from its numbers. Two policies drive the
same mount. `{PAPER}`, the paper's, waits until the magnitude has exceeded 0.8 mm for one period and then
damps by a characteristic of the velocity in the band. `{CONTINUOUS}` opens a viscous damper with the
amplitude in the band, from 0.12 mm on, without waiting, and takes the force from the unfiltered velocity
(`mount_control/policy/continuous_viscous.py`). `mount_control.policy` chooses. All of it is simulated;
vehicle and hydromount are chosen, not measured ([results.md](results.md)).

All ratios are to the original hydromount (displacement) or to the same mount without current (acceleration):
below 1 is won.
"""


def write_policy(figures: Values, pictures: Sequence[Path], file: Path) -> Path:
    """Write the page to `file` and return it; its pictures are expected in `figures/`."""
    shown = {picture.stem: picture.name for picture in pictures}
    parts = [_HEAD, _in_short(figures), _sweeps(figures, shown), _gaps(figures, shown), _rack(figures, shown)]
    parts.append(_roads(figures, shown))
    if 'front' in figures:
        parts += [_engines(figures), _idling(figures), _limits(figures), _ablation(figures)]
        parts.append(_front(figures, shown))
    else:
        parts.append(_limits(figures))
    if 'learnt' in figures:
        parts += ['## What was not done, and why\n', _learnt(figures['learnt'])]
    return write_page(filter(None, parts), file)


def _in_short(figures: Values) -> str:
    sweep, gap = figures['sweep_ratio'], figures['gap_peak_ratio']
    lines = ['## In short\n', '| | ' + ' | '.join(POLICIES) + ' |', '|---|---|---|']
    road = figures['roads'][figures['energy_road']]
    rows = {
        'sweep, lightest road': [next(iter(sweep[who].values())) for who in POLICIES],
        'sweep, worst road': [max(sweep[who].values()) for who in POLICIES],
        'gap, worst': [max(v for values in gap[who].values() for v in values) for who in POLICIES],
        'first extremum of a gap, worst': [
            max(v for values in figures['gap_first_extremum_ratio'][who].values() for v in values)
            for who in POLICIES
        ],
        f'acceleration 20 to 200 Hz, {figures["energy_road"]} road': [
            road[who]['acceleration'] for who in POLICIES
        ],
        'the same, engine idling': [road[who]['acceleration_idling'] for who in POLICIES],
        'energy in the pads, J/km': [road[who]['j_per_km'] for who in POLICIES],
        'heat of the coil, W': [road[who]['heat_w'] for who in POLICIES],
    }
    lines += [
        f'| {name} | ' + ' | '.join(f'{value:.2f}' for value in each) + ' |' for name, each in rows.items()
    ]
    return '\n'.join(lines) + '\n\n' + _lost(figures)


def _lost(figures: Values) -> str:
    """Return what the continuous law costs."""
    road, tip = figures['roads'][figures['energy_road']], figures['tip_in'][CONTINUOUS]
    paper, ours = road[PAPER], road[CONTINUOUS]
    lines = [
        'What is lost:\n',
        f'- The pads wear {ours["j_per_km"] / max(paper["j_per_km"], 1e-9):.1f} times as fast as with '
        f'`{PAPER}` ({figures["energy_road"]} road), and the coil takes {ours["heat_w"]:.2f} W instead of '
        f'{paper["heat_w"]:.2f} W.',
        f'- On a tip-in the chassis gets {tip["acceleration"]:.2f} times the acceleration of the mount '
        f'without current, the engine moves {tip["peak"]:.2f} times as far as on the hydromount.',
    ]
    if 'idling' in figures:
        cases = [values for each in figures['idling'].values() for values in each[CONTINUOUS].values()]
        lines.append(
            f'- With an idling engine on a road the acceleration rises up to {max(c[0] for c in cases):.2f} '
            f'times ({100.0 * np.mean([c[0] > 1.05 for c in cases]):.0f} % of the cases above 1.05), and '
            f'the engine moves up to {max(c[1] for c in cases):.2f} times as far as on the hydromount.'
        )
    return '\n'.join(lines) + '\n'


def _sweeps(figures: Values, shown: Mapping[str, str]) -> str:
    text = '## Sweep\n\n' + _picture(shown, 'policy_sweep', 'Largest displacement over frequency')
    text += 'Largest displacement from 3 to 14 Hz, by road level V0 in m/s:\n\n'
    text += _table('policy', figures['sweep_ratio'])
    for key, told in (
        ('high_frequency_ratio', 'road alone'),
        ('high_frequency_ratio_idling', 'engine idling'),
    ):
        if any(figures[key].values()):
            text += f'\nAcceleration of the chassis from 14 to 50 Hz, {told}:\n\n'
            text += _table('policy', figures[key], '.3f')
    return text


def _gaps(figures: Values, shown: Mapping[str, str]) -> str:
    text = '## Gap in the motorway\n\n' + _picture(shown, 'policy_gap', 'Displacement over a gap')
    for key, told in (
        ('gap_peak_ratio', 'Largest displacement'),
        ('gap_first_extremum_ratio', 'First extremum'),
    ):
        text += f'{told}, median and worst of the roads, by depth in mm:\n\n'
        cells = {
            who: {depth: f'{np.median(values):.2f}, {max(values):.2f}' for depth, values in each.items()}
            for who, each in figures[key].items()
        }
        text += _table('policy', cells) + '\n'
    return text


def _rack(figures: Values, shown: Mapping[str, str]) -> str:
    text = '## Rack\n\n' + _picture(shown, 'policy_velocity', 'Gain and phase of the velocity')
    text += 'A sine of 1 mm: total harmonic distortion of the mount force, %, by frequency in Hz:\n\n'
    text += _table('policy', figures['thd'])
    text += '\nFriction force against what the damper asks for, rms of the error over the peak, %:\n\n'
    return text + _table('policy', figures['tracking'], '.1f')


def _roads(figures: Values, shown: Mapping[str, str]) -> str:
    text = '## Roads\n\n' + _picture(shown, 'policy_recorded', 'Acceleration on the recorded road')
    text += (
        'The law was tuned on random roads with other seeds; the figures of the recorded road and of '
        'the sweeps '
        'were seen while it was chosen, so they are no blind check. '
        'A random road of class A, a smooth one (2e-6 m^3), and where a recording was given, the road that '
        'gives the model its vertical '
        'acceleration (0.9 to 50 Hz). Acceleration of the chassis from 20 to 200 Hz; largest '
        'displacement:\n\n'
        '| road | | acceleration | engine idling | displacement | J/km | coil, W '
        '|\n|---|---|---|---|---|---|---|\n'
    )
    for road, each in figures['roads'].items():
        for who, values in each.items():
            cells = ' | '.join(f'{value:.2f}' for value in values.values())
            text += f'| {road} | {who} | {cells} |\n'
    text += '\nTip-in of 400 N within 50 ms, displacement over the hydromount, acceleration over no current: '
    told = [f'{who} {v["peak"]:.2f} and {v["acceleration"]:.2f}' for who, v in figures['tip_in'].items()]
    return text + '; '.join(told) + '.\n'


def _engines(figures: Values) -> str:
    return (
        '## Other engines, pads, sensors, temperatures\n\n'
        'Largest displacement on the sweep, worst road level; the continuous law, and in the last column the '
        "paper's policy undisturbed:\n\n" + _table('engine', figures['robustness'])
    )


def _idling(figures: Values) -> str:
    text = (
        '## Idling engine\n\nAcceleration from 20 to 200 Hz over that without current, and rms '
        'displacement from '
        '3 to 14 Hz over the hydromount, on roads of two roughnesses (1e-6 m^3). The worst and the '
        'mean of all '
        'idle frequencies and forces:\n\n'
        '| roughness | | acceleration: worst, at | mean | share above 1.05 | displacement: mean | worst |\n'
        '|---|---|---|---|---|---|---|\n'
    )
    for roughness, each in figures['idling'].items():
        for who, cases in each.items():
            worst = max(cases, key=lambda case: cases[case][0])
            acceleration = [values[0] for values in cases.values()]
            displacement = [values[1] for values in cases.values()]
            above = np.mean([value > 1.05 for value in acceleration])
            text += (
                f'| {roughness} | {who} | {cases[worst][0]:.2f}, {worst} | {np.mean(acceleration):.2f} | '
                f'{100.0 * above:.0f} % | {np.mean(displacement):.2f} | {max(displacement):.2f} |\n'
            )
    return text + (
        '\nThe price of quiet: where a strong idle line meets a rough road, the damper stays nearly '
        'closed and '
        'the engine moves more than on the hydromount, which passes the line on instead. `idle_weight` '
        'chooses between both.\n'
    )


def _limits(figures: Values) -> str:
    limits = figures['limits']
    delays = ', '.join(f'{value:.2f} at {delay} ms' for delay, value in limits['gap_after_delay'].items())
    return (
        '## What no policy can beat\n\n'
        'An ideal viscous damper with perfect knowledge, always on: largest displacement on the '
        'sweep, by its '
        'coefficient in N s/m:\n\n' + _table('N s/m', limits['sweep_always_on']) + '\n'
        f'Over a gap of {1e3 * limits["gap_depth_m"]:g} mm on a smooth road, '
        f'{limits["gap_damping"]:g} N s/m, '
        f'switched on perfectly so long after the wheel meets it, over no damping: {delays}. The '
        f'first extremum '
        f'keeps {limits["gap_first_extremum_always_on"]:.2f} of the undamped one even with the damper '
        f'always on.\n'
    )


def _learnt(learnt: Values) -> str:
    scales = {
        scale: {road: f'{np.mean(values):.2f} +- {np.std(values):.2f}' for road, values in each.items()}
        for scale, each in learnt['friction_scale'].items()
    }
    return (
        "- **The engine's frequency is not estimated.** While the road shakes the wheel, the phasor "
        'in the band '
        'turns as the road does, and free decays the damper ends. How fast it turns on random '
        'roads (Hz), by roughness (1e-6 m^3), where the engine is known:\n\n'
        + _table('engine', learnt['frequency_hz'], '.1f')
        + '\n  The law was made insensitive instead: a band of quality 0.5, and no measure that grows beside '
        'the centre of the band. The table of engines was run with 8 Hz throughout.\n'
        '- **The friction coefficient is not adapted.** In the ringing behind a gap, acceleration over '
        'displacement, velocity and the force that the current should have made gives the scale of the pads, '
        'mean and spread over the roads, by roughness (1e-6 m^3):\n\n'
        + _table('scale in truth', scales)
        + '\n  The wanted force is nearly proportional to the velocity, so least squares cannot part it from '
        "the elastomer's own loss, and the acceleration of the chassis, which no sensor tells, goes "
        'into both. '
        'Another sensor, of chassis acceleration or of mount force, would be needed.\n'
    )


def _ablation(figures: Values) -> str:
    return '## What each part is for\n\nThe continuous law, one part changed at a time:\n\n' + _table(
        'changed', figures['ablation']
    )


def _front(figures: Values, shown: Mapping[str, str]) -> str:
    text = '## Wear against effect\n\n' + _picture(shown, 'policy_front', 'Front of ratio and cost')
    text += (
        'Points that none beats in all of ratio on a light road, both accelerations and wear (random road); '
        'choose one by its three parameters:\n\n'
        '| name | lowest, full amplitude (mm) | c (N s/m) | light road | strong road | acceleration '
        '| idling | '
        'J/km |\n|---|---|---|---|---|---|---|---|\n'
    )
    keys = ('light_road', 'strong_road', 'acceleration', 'acceleration_idling', 'j_per_km')
    for point in figures['front']:
        if point['on_front'] or point['name']:
            cells = ' | '.join(f'{point[key]:.2f}' for key in keys)
            amplitudes = f'{1e3 * point["lowest_amplitude_m"]:g}, {1e3 * point["full_amplitude_m"]:g}'
            text += f'| {point["name"]} | {amplitudes} | {point["damping_coefficient"]:g} | {cells} |\n'
    return text + (
        '\nThe default was chosen so that engines from 6 to 11 Hz stay at or below 0.8 of the hydromount '
        'with worn pads too: see the table of engines.\n'
    )


def _picture(shown: Mapping[str, str], name: str, title: str) -> str:
    return f'![{title}](figures/{shown[name]})\n\n' if name in shown else ''


def _table(corner: str, rows: Settings, form: str = '.2f') -> str:
    columns = list(next(iter(rows.values())))
    lines = [f'| {corner} | ' + ' | '.join(columns) + ' |', '|---|' + '---|' * len(columns)]
    for name, values in rows.items():
        cells = ' | '.join(
            value if isinstance(value, str) else format(value, form) for value in values.values()
        )
        lines.append(f'| {name.replace("_", " ") if name not in POLICIES else f"`{name}`"} | {cells} |')
    return '\n'.join(lines) + '\n'
