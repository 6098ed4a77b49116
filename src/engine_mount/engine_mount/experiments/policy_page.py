"""The page about the policies, written from the numbers."""

from collections.abc import Collection

import numpy as np

from engine_mount.experiments.bound import HORIZON, LATE, MEASURES
from engine_mount.experiments.harness.experiment import PAPER, Values, table, table_rows
from engine_mount.experiments.policy_cases import (
    CONTINUOUS,
    FORCE,
    HIGH_BANDS,
    POLICIES,
    STEPPED,
    UNEVEN,
    UNEVEN_FORCE,
)
from engine_mount.reports.drive.felt import FIGURES


def page_of(figures: Values, pictures: Collection[str]) -> str:
    """Return the page; `pictures` are the names of those that there are."""

    def picture(name: str, title: str) -> str:
        return f'![{title}](figures/{name}.png)\n\n' if name in pictures else ''

    roads = figures['roads']
    high = ''
    for kind, told in (('', 'road alone'), ('_idling', 'engine idling')):
        ratios = figures[f'high_frequency_ratio{kind}']
        if any(ratios.values()):
            shown = by_name('policy', ratios, '.3f')
            high += f'\nAcceleration of the chassis from 14 to 50 Hz, {told}:\n\n{shown}'
    gaps = ''
    for kind, told in (('peak', 'Largest displacement'), ('first_extremum', 'First extremum')):
        cells = {
            who: {depth: f'{np.median(values):.2f}, {max(values):.2f}' for depth, values in each.items()}
            for who, each in figures[f'gap_{kind}_ratio'].items()
        }
        gaps += f'{told}, median and worst of the roads, by depth in mm:\n\n{by_name("policy", cells)}\n'
    road_rows = [
        (road, who, *map('{:.2f}'.format, values.values()))
        for road, each in roads.items()
        for who, values in each.items()
    ]
    pulls = {
        name: {who: f'{v["peak"]:.2f}, {v["acceleration"]:.2f}' for who, v in each.items()}
        for name, each in figures['pulls'].items()
    }
    steady = {
        name: {who: f'{v["displacement"]:.2f}, {1e3 * v["acceleration"]:.1f}' for who, v in each.items()}
        for name, each in figures['steady'].items()
    }
    felt = ''.join(
        f'\nAcceleration of the chassis, {road} road:\n\n{by_name("", in_mm(each))}'
        for road, each in figures['bands'].items()
    )
    beaten = ''
    if 'bound' in figures:
        beaten = best_force(figures['bound'], picture('policy_bound', 'Acceleration over displacement'))
    if 'front' in figures:
        beaten = thorough(figures, beaten)
    return f"""# Control policies side by side

`engine-mount experiment policy` writes this page from its numbers. Two policies drive the
same mount. `{PAPER}`, the paper's, waits until the magnitude has exceeded 0.8 mm for one period and then
damps by a characteristic of the velocity in the band. `{CONTINUOUS}` engages a viscous damper with the
amplitude in the band, by half at 0.1 mm, without waiting, takes the force from the unfiltered velocity,
and cancels the lines of the engine (`mount_control/policy/continuous_viscous.py`):

    F = c g v_n - K (1 + r) x_l where that has the direction of v, else 0
    g follows A^2 / (A^2 + A_0^2 + A A_l + A_n^2)

v: velocity, v_n without lines of the engine; x_l: the lines when the force acts; A, A_l, A_n: amplitudes of
motion in the band, lines and noise; r: up to 0.5 where the lines turn the friction, so that half of each
period is left. `mount_control.policy` selects the policy. All figures are simulated; vehicle and hydromount
are chosen, not measured.

All ratios are to the original hydromount (displacement) or to the same mount without current (acceleration):
a ratio below 1 is better.

## In short

| | {' | '.join(POLICIES)} |
|---|---|---|
{in_short(figures)}
Costs:

{lost(figures)}
## Sweep

{picture('policy_sweep', 'Largest displacement over frequency')}Largest displacement from 3 to 14 Hz, by \
road level V0 in m/s:

{by_name('policy', figures['sweep_ratio'])}{high}
## Gap in the motorway

{picture('policy_gap', 'Displacement over a gap')}{gaps}
## Rack

A sine of 1 mm: total harmonic distortion of \
the mount force, %, by frequency in Hz:

{by_name('policy', figures['thd'])}
## Roads

The law was tuned on random roads with other seeds; the figures of the sweeps were known during the tuning, \
so they are no blind check. A random road of class A and a smooth one (2e-6 m^3). Acceleration of \
the chassis from 20 to 200 Hz; largest displacement:

| road | | acceleration | engine idling | displacement | J/km | coil, W |
|---|---|---|---|---|---|---|
{table_rows(road_rows)}
{felt}
A force on the engine, of 400 N within 50 ms up and down, and of 800 N within 30 ms: displacement over the \
hydromount, acceleration over no current.

{by_name('', pulls)}
Steady: a sine of the road with 0.06 m/s; a half order of the engine, 60 N, on the smooth road. Rms \
displacement from 3 to 14 Hz over the hydromount, acceleration from 20 to 200 Hz in mm/s^2:

{by_name('', steady)}
{beaten}"""


def best_force(windows: Values, picture: str) -> str:
    """Return the part about the best force that was found."""

    def cost(point: Values) -> float:
        return float(np.mean([point[measure] for measure in MEASURES]))

    rows, foreseen = {}, ''
    for name, each in windows.items():
        best = each['best']['0.5']
        late = {f'{LATE} ms later': each['late']}
        ideal = {f'{damping} N s/m': point for damping, point in each['ideal'].items()}
        ratios = {who: cost(point) / cost(best) for who, point in (late | each['mounts'] | ideal).items()}
        rows[name] = {'J of the best': cost(best), 'its wear, W': best['wear_w']} | ratios
        for preview, point in each['foreseen'].items():
            foreseen += f'| {name} | {preview} | {cost(point) / cost(best):.2f} |\n'
    return f"""## The best force of the pads

{picture}Road and engine are known for the whole window of 3 to 4 s. J is the mean of \
two mean squares over those without current, displacement from 3 to 14 Hz and acceleration of the chassis \
from 20 to 200 Hz (weights chosen; the picture has others). The force was sought by its gradient in the \
linear car (`engine_mount/experiments/bound.py`), then made by currents in the whole simulation: the figures \
are from there. It is a local optimum, so at least this good. J of each mount over J of the best:

{by_name('window', rows)}
`{LATE} ms later`: the same currents, so much later, as the delay of the loop would make them. The ideal \
dampers know the velocity at once and nothing else. The best force also knows what road and engine will do. \
What that is worth: the best force for the next {HORIZON} ms, found anew at each sample of the linear car \
from its exact state, where the road is known for so long and taken to stand still behind. J over J of the \
best:

| window | road known ahead, ms | J |
|---|---|---|
{foreseen}
Nothing in the car sees the road ahead of the wheel: the J of the law in the table above is without it.
"""


def in_short(figures: Values) -> str:
    """Return the rows of the first table."""
    road = figures['roads']['random']

    def worst(ratios: Values, who: str) -> float:
        return max(value for values in ratios[who].values() for value in values)

    def column(who: str) -> list[float]:
        swept, of = [*figures['sweep_ratio'][who].values()], road[who]
        gaps = (worst(figures[f'gap_{what}_ratio'], who) for what in ('peak', 'first_extremum'))
        return [swept[0], max(swept), *gaps, *(of[key] for key in of if key != 'displacement')]

    names = (
        'sweep, lightest road',
        'sweep, worst road',
        'gap, worst',
        'first extremum of a gap, worst',
        'acceleration 20 to 200 Hz, random road',
        'the same, engine idling',
        'energy in the pads, J/km',
        'heat of the coil, W',
    )
    rows = zip(names, *map(column, POLICIES), strict=True)
    return table_rows((name, *map('{:.2f}'.format, values)) for name, *values in rows)


def lost(figures: Values) -> str:
    """Return what the continuous law costs."""
    road, tip = figures['roads']['random'], figures['pulls']['tip-in'][CONTINUOUS]
    paper, ours = road[PAPER], road[CONTINUOUS]
    wear = ours['j_per_km'] / max(paper['j_per_km'], 1e-9)
    text = f"""- The pads wear {wear:.1f} times as fast as with `{PAPER}` (random road), \
and the coil takes {ours['heat_w']:.2f} W instead of {paper['heat_w']:.2f} W.
- On a tip-in the chassis gets {tip['acceleration']:.2f} times the acceleration of the mount without \
current, the engine moves {tip['peak']:.2f} times as far as on the hydromount.
"""
    if 'engine' in figures:
        cases = [values for each in figures['engine'].values() for values in each[CONTINUOUS].values()]
        shaken, moved = np.transpose(cases)
        text += f"""- With a running engine on a road, 20 to 190 Hz, the acceleration rises up to \
{shaken.max():.2f} times ({100.0 * np.mean(shaken > 1.05):.0f} % of the cases above 1.05), and the engine \
moves up to {moved.max():.2f} times as far as on the hydromount.
"""
    return text


def thorough(figures: Values, beaten: str) -> str:
    """Return the parts from other engines on; `beaten` holds the limits of any policy."""
    engine = front = ''
    uneven = {
        who: {f'{frequency} Hz': '{:.2f}, {:.2f}'.format(*values) for frequency, values in each.items()}
        for who, each in figures['uneven'].items()
    }
    for roughness, each in figures['engine'].items():
        for who, cases in each.items():
            worst = max(cases, key=lambda case: cases[case][0])
            shaken, moved = np.transpose(list(cases.values()))
            engine += f"""| {roughness} | {who} | {cases[worst][0]:.2f}, {worst} | {np.mean(shaken):.2f} | \
{100.0 * np.mean(shaken > 1.05):.0f} % | {np.mean(moved):.2f} | {max(moved):.2f} |
"""
    at_rest = {
        name: {'displacement, um': 1e6 * each['peak_m'], 'friction, N': each['force_n']}
        for name, each in figures['rest'].items()
    }
    others = ''.join(
        f'`{who}`:\n\n{by_name("hydromount", {name: ranges(each) for name, each in rows.items()})}\n'
        for who, rows in figures['hydromounts'].items()
    )
    for point in figures['front']:
        if point['on_front'] or point['name']:
            front += f"""| {point['name']} | {1e3 * point['half_amplitude_m']:g} | \
{point['damping_coefficient']:g} | {point['light_road']:.2f} | \
{point['strong_road']:.2f} | {point['acceleration']:.2f} | {point['acceleration_idling']:.2f} | \
{point['j_per_km']:.2f} |
"""
    return f"""{above(figures['high_bands'])}
## Other engines, pads, sensors, temperatures

Largest displacement on the sweep, worst road level; the continuous law, and in the last column the paper's \
policy undisturbed:

{by_name('engine', figures['robustness'])}
Nothing moves by itself: 5 s after a gap of 2 to 60 mm in a flat road, with engines of 6, 8 and \
11 Hz, the largest that is left, noise of the sensor included. `2 ms later` is a current loop of \
60 Hz that the law does not know of. Friction takes energy whatever the current is, so there can be no limit \
cycle without excitation:

{by_name('', at_rest)}
## Other hydromounts

The paper gives nothing of its hydromount and neither the road level nor whether the engine ran; all are \
chosen here. On the sweep, range over the road levels: largest displacement and acceleration from 14 to \
50 Hz over each hydromount, which is named by the resistance of its decoupler and the asymmetry of its \
upper chamber. On the rack, 8 Hz and 1 mm: the harmonics of the force in which the friction \
mount is lower. The asymmetry is in the model so that the fluid has even harmonics; an \
advantage there is no finding.

{others}
## Running engine

Acceleration from 20 to 200 Hz over that without current, and rms displacement from 3 to 14 Hz over the \
hydromount, by roughness of the road (1e-6 m^3; 16, 64, 256 are the classes A, B, C). The table gives the \
worst and the mean of all frequencies of the engine's line and forces; the line's double has 0.4 of its force:

| roughness | | acceleration: worst, at | mean | share above 1.05 | displacement: mean | worst |
|---|---|---|---|---|---|---|
{engine}
An engine whose cylinders differ, class A, {UNEVEN_FORCE:g} N: orders 0.5, 1, 1.5, 2.5 and 3 of the \
crankshaft have {UNEVEN:g} of the line's force. Acceleration and displacement as above, by frequency of the \
line:

{by_name('', uneven)}
The price of quiet: where a strong line meets a smooth road, its friction would be heard, so the damper is \
released and the engine moves more than on the hydromount, which transmits the line instead. `line_weight` \
weighs one against the other. A bank of resonators finds the lines; `speed known`: the vehicle sends the \
speed of its engine (`mount_sim.idle.speed_sent`).

## Noise

Acceleration from 20 to 200 Hz over that without current, by the standard deviation of the noise in the \
displacement:

{by_name('road', figures['noise'])}

{beaten}
## Effect of each part

The continuous law, one part changed at a time:

{by_name('changed', figures['ablation'])}
## Wear against effect

No other point is better than these in all of ratio on a light road, both accelerations and wear \
(random road). Wear is the price: the pads take what leaves the motion, so points of about the same ratio \
differ by a few per cent only. Choose one by its two parameters:

| name | half amplitude (mm) | c (N s/m) | light road | strong road | acceleration | idling | J/km |
|---|---|---|---|---|---|---|---|
{front}
The default was chosen so that engines from 6 to 11 Hz stay at or below 0.8 of the hydromount with worn \
pads too: see the table of engines.

## Omissions and their reasons

- **The eigenfrequency is not estimated.** While the road shakes the wheel, the phasor in the band \
turns with the road, and the damper ends free decays. The law was made insensitive instead: a band of \
quality 0.5, and no measure that grows beside the centre of the band. The table of engines was run with 8 Hz \
throughout.
- **The friction coefficient is not adapted.** The wanted force is nearly proportional to the velocity, so \
least squares over the ringing behind a gap cannot separate it from the elastomer's own loss. The \
acceleration of the chassis, which no sensor measures, enters both. Another sensor, of chassis acceleration \
or of mount force, would be needed.
"""


def ranges(figures: Values) -> Values:
    """Return the lowest and highest of each list of ratios, and the numbers of harmonics, as texts."""
    told = {
        name.replace('_', ' '): f'{min(values):.2f} to {max(values):.2f}' if values else 'not swept'
        for name, values in figures.items()
    }
    return told | {'lower harmonics': ', '.join(map(str, figures['lower_harmonics'])) or 'none'}


def above(high: Values) -> str:
    """Return the part on high frequencies: how much there is, and where it comes from."""
    names = [f'{low:g}-{high:g} Hz' for low, high in HIGH_BANDS]
    first = f'{CONTINUOUS}, as driven'
    rows = {
        f'{case}, {record}': dict(zip(names, values, strict=False))
        for case, each in high.items()
        for record, values in each.items()
        if record == STEPPED or (case == first and record != FORCE)
    }
    forces = {
        case: dict(zip(names, map('{:.3f}'.format, each[FORCE]), strict=True)) for case, each in high.items()
    }
    return f"""## High frequencies

The drive of `engine-mount drive --core`, rms of the chassis acceleration in mm/s^2. `sim/truth` samples \
it at 1 kHz without a filter; the plant was driven once more by the same setpoints, and looked at in each \
of its steps of 50 us.

{by_name('drive', in_mm(rows))}
Rms of the mount force in N, each step of the plant:

{by_name('drive', forces)}
Above 200 Hz nearly all of it is the model: setpoints that jump at 1 kHz, a current loop of first order, \
pads that follow the current at once, a chassis without modes above 36 Hz. A real coil, its eddy currents \
and a real body pass other shares; no figure here foretells sound.
"""


def in_mm(rows: Values) -> Values:
    """Return {name: {column: value}} in thousandths of the unit."""
    return {
        name: {FIGURES.get(key, key): 1e3 * value for key, value in each.items()}
        for name, each in rows.items()
    }


def by_name(corner: str, rows: Values, form: str = '.2f') -> str:
    """Return a table of {name: {column: value}}; values are texts or numbers."""
    cells = [
        (
            f'`{name}`' if name in POLICIES else name.replace('_', ' '),
            *(value if isinstance(value, str) else format(value, form) for value in values.values()),
        )
        for name, values in rows.items()
    ]
    return table((corner, *max(rows.values(), key=len)), cells)
