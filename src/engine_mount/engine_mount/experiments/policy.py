"""Policies side by side: sweep, gap, rack, roads, other engines, idle, wear; and what no policy can beat."""

import math
from itertools import product
from typing import Any

import numpy as np

from engine_mount.experiments.bound import MEASURES
from engine_mount.experiments.harness.closed_loop import run_cases
from engine_mount.experiments.harness.drawing import BLUE, HYDRO_LINE, OFF_LINE, legend_below, new_panels
from engine_mount.experiments.harness.experiment import (
    EVEN,
    PAPER,
    Experiment,
    Findings,
    Order,
    Values,
    claim,
    holds_if,
    numbers_of,
)
from engine_mount.experiments.harness.measures import (
    highest_per_band,
    swept_frequency,
)
from engine_mount.experiments.policy_cases import (
    ABLATIONS,
    BOUND_WEIGHTS,
    COMPARED,
    CONTINUOUS,
    DISTURBANCES,
    ENGINE_ROADS,
    FORESEEN,
    FRONT,
    GAP_TIME,
    HYDRO,
    HYDROMOUNTS,
    KNOWN,
    NAMED,
    NOMINAL,
    OFF,
    POLICIES,
    PREVIEWS,
    PULLS,
    ROADS,
    SHOCKS,
    UNSTABLE,
    Axes,
    Key,
    PolicyParameters,
    cases_of,
    steady,
    windows,
)
from engine_mount.experiments.policy_page import page_of
from engine_mount.reports.drawing.chart import COLOUR_OF
from engine_mount.reports.drive.felt import ACCELERATIONS
from engine_mount.reports.drive.signals import FloatArray
from mount_models.sampling import SAMPLE_TIME

NAME = 'policy'
Found = dict[Key, Values]
_SUPPORTED = (*POLICIES, OFF)
_CLEAR = 0.75  # chosen
_BEFORE, _AFTER = 0.05, 0.8  # s, drawn round the gap
_LINES: dict[str, Values] = {
    CONTINUOUS: {'color': COLOUR_OF[CONTINUOUS]},
    PAPER: {'color': COLOUR_OF[PAPER]},
    HYDRO: HYDRO_LINE,
    OFF: OFF_LINE,
}


def run(order: Order) -> Findings:
    """Run all combinations, and make pictures and a page from the numbers."""
    axes = Axes(
        numbers_of(order, 'road_levels', 1e-3, 1.0),
        numbers_of(order, 'gap_depths', 1e-3, 0.1),
        numbers_of(order, 'rack_frequencies', 1.0, 50.0),
        numbers_of(order, 'engines', 5.0, 12.0),
        numbers_of(order, 'engine_levels', 1e-3, 1.0),
        numbers_of(order, 'engine_frequencies', 10.0, 200.0),
        numbers_of(order, 'engine_forces', 1.0, 2000.0),
        numbers_of(order, 'noise', 0.0, 100.0),
    )
    found = run_cases(order, cases_of(order, axes))
    figures = figures_of(found, order.parameters, axes)
    pictures = {}
    shown = {
        kind: sorted({key[2:] for key, each in found.items() if key[0] == kind and 'displacement' in each})
        for kind in ('sweep', 'gap')
    }
    if shown['sweep']:
        pictures['policy_sweep'] = draw_sweeps(found, [level for level, _ in shown['sweep']])
    if shown['gap']:
        pictures['policy_gap'] = draw_gap(found, *shown['gap'][0])
    if 'bound' in figures:
        pictures['policy_bound'] = draw_bound(figures['bound'])
    pages = {f'{NAME}.md': page_of(figures, pictures.keys())}
    judged = [figures | {'who': who} for who in POLICIES]
    return Findings(figures, pictures, (), pages, *judged)


def figures_of(found: Found, own: PolicyParameters, axes: Axes) -> Values:
    """Return all figures: plain numbers, texts, lists and mappings."""
    idle, seeds = own.idle_amplitude, range(1, own.gap_seeds + 1)

    def over(what: str, kind: str, who: str, *rest: Any, other: str = HYDRO) -> float:
        """Return a figure of one mount over that of the `other` one in the same run."""
        return float(found[kind, who, *rest][what] / found[kind, other, *rest][what])

    def of_gaps(what: str) -> Values:
        return {
            who: {number(1e3 * d): [over(what, 'gap', who, d, seed) for seed in seeds] for d in axes.depths}
            for who in _SUPPORTED
        }

    def high(who: str, level: float, force: float) -> float:
        """Return the rms of the acceleration in the bands above 14 Hz together."""
        bands = [each for each in found['sweep', who, level, force]['rms'] if each is not None]
        return float(np.sqrt(np.sum(np.square(bands)))) if bands else math.nan

    def high_over(who: str, other: str, force: float) -> Values:
        levels = [level for level in axes.levels if not np.isnan(high(OFF, level, force))]
        return {number(level): high(who, level, force) / high(other, level, force) for level in levels}

    def high_ratio(force: float) -> Values:
        return {who: high_over(who, OFF, force) for who in (*POLICIES, HYDRO)}

    def of_road(road: str, who: str) -> Values:
        quiet = found['road', who, road, 0.0]
        return {
            'acceleration': over('acceleration', 'road', who, road, 0.0, other=OFF),
            'acceleration_idling': over('acceleration', 'road', who, road, idle, other=OFF),
            'displacement': over('peak_m', 'road', who, road, 0.0),
            'j_per_km': quiet['wear_j_per_km'],
            'heat_w': quiet['coil_w'],
        }

    roads = {road: {who: of_road(road, who) for who in COMPARED} for road in ROADS}
    figures: Values = {
        'sweep_ratio': {
            who: {number(level): over('peak_m', 'sweep', who, level, 0.0) for level in axes.levels}
            for who in _SUPPORTED
        },
        'gap_peak_ratio': of_gaps('peak_m'),
        'gap_first_extremum_ratio': of_gaps('first_m'),
        'shock': {
            who: {key: [found['shock', who, depth][key] for depth in SHOCKS] for key in ('force_n', 'peak_m')}
            for who in POLICIES
        },
        'thd': {
            who: {number(f): found['rack', who, f]['thd'] for f in axes.frequencies}
            for who in (*POLICIES, HYDRO)
        },
        'high_frequency_ratio': high_ratio(0.0),
        'high_frequency_ratio_idling': high_ratio(idle),
        'roads': roads,
        'bands': {
            road: {
                who: {figure: found['road', who, road, 0.0][figure] for figure in ACCELERATIONS}
                for who in COMPARED
            }
            for road in ROADS
        },
        'pulls': {
            name: {
                who: {
                    'peak': over('peak_m', name, who),
                    'ringing': over('rms_m', name, who, other=OFF),
                    'acceleration': over('acceleration', name, who, other=OFF),
                }
                for who in COMPARED
            }
            for name in PULLS
        },
        'steady': {
            name: {
                who: {
                    'displacement': over('rms_m', 'steady', who, name),
                    'acceleration': found['steady', who, name]['acceleration'],
                }
                for who in COMPARED
            }
            for name in steady()
        },
        'idle_amplitude_n': idle,
    }
    if own.bound:
        figures['bound'] = {name: bound_of(found, name) for name in windows(idle)}
    if not own.thorough:
        return figures
    engines = {f'{frequency:g} Hz by {how}': (how, frequency) for how, frequency in axes.plants}

    def worst(who: str, plant: tuple[str, float], name: str) -> float:
        """Return the highest ratio over the levels."""
        return max(
            found['robust', who, *plant, name, level]['peak_m']
            / found['robust', HYDRO, *plant, 'nominal', level]['peak_m']
            for level in axes.engine_levels
        )

    def over_hydromount(who: str, other: str) -> Values:
        both = zip(*(found['rack', mount, NOMINAL]['harmonics_n'] for mount in (who, other)), strict=True)
        return {
            'displacement': [over('peak_m', 'sweep', who, level, 0.0, other=other) for level in axes.levels],
            'acceleration': [*high_over(who, other, 0.0).values()],
            'acceleration_idling': [*high_over(who, other, idle).values()],
            'lower_harmonics': [order for order, (own, its) in enumerate(both, 1) if own < its],
        }

    def of_engine(who: str, roughness: float) -> Values:
        cases = list(product(axes.engine_frequencies, axes.engine_forces))
        return {
            f'{frequency:g} Hz, {force:g} N': [
                over('acceleration', 'engine', who, roughness, frequency, force, other=OFF),
                over('rms_m', 'engine', who, roughness, frequency, force),
            ]
            for frequency, force in cases
        }

    points = [
        {
            'name': NAMED.get(point, ''),
            **dict(zip(('half_amplitude_m', 'damping_coefficient'), point, strict=True)),
            **variant(found, ('front', *point), axes, idle),
        }
        for point in FRONT
    ]
    costs = ('light_road', 'acceleration', 'acceleration_idling', 'j_per_km')
    for point in points:
        # none is better in ratio, wear and both accelerations
        point['on_front'] = not any(
            other is not point and all(other[cost] <= point[cost] for cost in costs) for other in points
        )
    return figures | {
        'high_bands': {
            f'{key[1]}, {key[2]}': found[key] for key in sorted(key for key in found if key[0] == 'high')
        },
        'robustness': {
            engine: {
                **{name: worst(CONTINUOUS, plant, name) for name in DISTURBANCES},
                PAPER: worst(PAPER, plant, 'nominal'),
            }
            for engine, plant in engines.items()
        },
        'engine': {
            number(1e6 * road): {who: of_engine(who, road) for who in (*COMPARED, KNOWN)}
            for road in ENGINE_ROADS
        },
        'uneven': {
            who: {
                number(frequency): [
                    over('acceleration', 'uneven', who, frequency, other=OFF),
                    over('rms_m', 'uneven', who, frequency),
                ]
                for frequency in axes.engine_frequencies
            }
            for who in (*COMPARED, KNOWN)
        },
        'hydromounts': {
            who: {other: over_hydromount(who, other) for other in HYDROMOUNTS} for who in POLICIES
        },
        'rest': {
            name: {
                key: max(each[key] for of, each in found.items() if of[0] == 'rest' and of[2] == name)
                for key in ('peak_m', 'force_n')
            }
            for name in UNSTABLE
        },
        'noise': {
            f'{road}, {who}': {
                f'{noise:g} um': over('acceleration', 'noise', who, road, noise, other=OFF)
                for noise in axes.noise
            }
            for road in ROADS
            for who in POLICIES
        },
        'ablation': {name: variant(found, ('ablation', name), axes, idle) for name in ABLATIONS},
        'front': points,
    }


def number(value: float) -> str:
    """Return a number as the key of a mapping."""
    return f'{value:g}'


def variant(found: Found, key: Key, axes: Axes, idle: float) -> dict[str, Any]:
    """Return the figures of the continuous law with some of its parameters changed."""
    light, strong = (
        found[*key, CONTINUOUS, level]['peak_m'] / found['sweep', HYDRO, level, 0.0]['peak_m']
        for level in (axes.levels[0], axes.levels[-1])
    )
    quiet, idling = (
        found[*key, CONTINUOUS, 'road', force]['acceleration']
        / found['road', OFF, 'random', force]['acceleration']
        for force in (0.0, idle)
    )
    return {
        'light_road': light,
        'strong_road': strong,
        'acceleration': quiet,
        'acceleration_idling': idling,
        'j_per_km': found[*key, CONTINUOUS, 'road', 0.0]['wear_j_per_km'],
    }


def bound_of(found: Found, name: str) -> Values:
    """Return a window's figures over those without current: of mounts, ideal dampers, the best by weight."""
    without = found['bound', OFF, name]

    def ratios(figures: Values) -> Values:
        wear = {key: figures[key] for key in ('wear_w',) if key in figures}
        return {measure: figures[measure] / without[measure] for measure in MEASURES} | wear

    return {
        'mounts': {who: ratios(found['bound', who, name]) for who in COMPARED},
        'ideal': {damping: ratios(figures) for damping, figures in without['ideal'].items()},
        'late': ratios(found['bound', OFF, name, 0.5]['late']),
        'foreseen': {
            number(preview): ratios(found['bound', OFF, name, 'foreseen', preview])
            for preview in (PREVIEWS if name == FORESEEN else ())
        },
        'best': {number(weight): ratios(found['bound', OFF, name, weight]) for weight in BOUND_WEIGHTS},
    }


def _told(ratios: Values, unit: str) -> str:
    return ', '.join(f'{value:.2f} ({key} {unit})' for key, value in ratios.items())


@claim('Sec. 7', paper='Lower displacements when damping is on.')
def _on_displacement(figures):
    swept = figures['sweep_ratio'][figures['who']]
    gaps = {depth: max(ratios) for depth, ratios in figures['gap_peak_ratio'][figures['who']].items()}
    told = f"""Largest displacement over that of the hydromount: sweep from 3 to 14 Hz by road level,
        {_told(swept, 'm/s')}; over a gap, worst of the roads, {_told(gaps, 'mm')}."""
    return holds_if([ratio < 1.0 for ratio in (*swept.values(), *gaps.values())]), told


@claim(
    'Fig. 14; Secs. 6, 7',
    paper='At higher frequencies, where damping is off, the acceleration of the chassis is lower.',
)
def _on_acceleration(figures):
    found: list[float] = []
    parts = []
    for kind, name in (('', 'road alone'), ('_idling', 'engine idling')):
        both = [figures[f'high_frequency_ratio{kind}'][who] for who in (figures['who'], HYDRO)]
        ratios = {level: own / both[1][level] for level, own in both[0].items()}
        found += ratios.values()
        parts.append(f'{name}, {_told(ratios, "m/s")}')
    told = f'Over that of the hydromount, 14 to 50 Hz by road level: {"; ".join(parts)}.'
    return holds_if([ratio < 1.0 for ratio in found]), told


@claim(
    'Sec. 7',
    paper="""On good roads the advantage is clear; it levels out where the road excites the engine's
    eigenfrequency permanently, as a very bumpy one does.""",
)
def _on_levelling_out(figures):
    ratios = [*figures['sweep_ratio'][figures['who']].values()]
    first, last = ratios[0], ratios[-1]
    told = f"""Largest displacement over that of the hydromount: {first:.2f} on the lightest road,
        {last:.2f} on the roughest. Motion below the level at which a policy begins is undamped, while the
        hydromount always damps; above it friction damps more than the fluid, the more so the longer it is on.
        A ratio below {_CLEAR:g} counts as clear (chosen)."""
    return holds_if([first < _CLEAR, first < last]), told


@claim('Sec. 1', paper='Damping is limited, so the mount does not block in case of shock.')
def _on_shock(figures):
    (force, most), (moved, farthest) = figures['shock'][figures['who']].values()
    told = f"""Over gaps of {' and '.join(f'{1e3 * depth:g} mm' for depth in SHOCKS)} the mount moves
        {1e3 * moved:.1f} and {1e3 * farthest:.1f} mm, and friction reaches {force:.0f} and {most:.0f} N:
        what the magnet presses at its highest current."""
    return most < (1.0 + EVEN) * force and moved < farthest, told


@claim(
    'Sec. 5',
    paper="""Shifting, sudden acceleration and braking excite the engine too; for a short time damping is
    needed.""",
)
def _on_pulls(figures):
    pulls = {name: each[figures['who']] for name, each in figures['pulls'].items()}
    texts = (
        f"""{name}: rms displacement {each['ringing']:.2f} of that without current, acceleration
        {each['acceleration']:.2f}"""
        for name, each in pulls.items()
    )
    told = f"""Force of the engine, for acceleration and for the begin of shifting: {'; '.join(texts)}.
        Braking turns the engine about an axis that the simulated car lacks. Damped is what is
        below {_CLEAR:g} (chosen)."""
    return holds_if([each['ringing'] < _CLEAR for each in pulls.values()]), told


def draw_sweeps(found: Found, levels: list[float]) -> Any:
    """Draw the largest displacement in each half hertz, for all policies and mounts."""
    figure, panels = new_panels(
        'Front wheels on a sweep: largest displacement by policy',
        len(levels),
        1,
        3.2 * len(levels),
        sharex=True,
    )
    panels = np.atleast_1d(panels)
    for panel, level in zip(panels, levels, strict=True):
        for who in COMPARED:
            displacement = found['sweep', who, level, 0.0]['displacement']
            frequency = swept_frequency(displacement.size)
            shown = frequency < 20.0
            middle, highest = highest_per_band(frequency[shown], displacement[shown], 0.5)
            panel.plot(middle, 1e3 * highest, label=who, **_LINES[who])
        panel.set_ylabel('largest displacement (mm)')
        panel.set_title(f'V0 = {level:g} m/s', fontsize='medium')
    panels[0].legend()
    panels[-1].set_xlabel('frequency of the road (Hz)')
    return figure


def draw_gap(found: Found, depth: float, seed: int) -> Any:
    """Draw the displacement over one gap, undamped in grey."""
    figure, panel = new_panels(f'Over a gap of {1e3 * depth:g} mm in the motorway')
    for who in (OFF, HYDRO, PAPER, CONTINUOUS):
        displacement = found['gap', who, depth, seed]['displacement']
        time = SAMPLE_TIME * np.arange(displacement.size) - GAP_TIME
        shown = (time >= -_BEFORE) & (time <= _AFTER)
        width = 1.8 if who == CONTINUOUS else 1.1
        panel.plot(time[shown], 1e3 * displacement[shown], linewidth=width, label=who, **_LINES[who])
    panel.set(xlabel='time from the gap on (s)', ylabel='displacement (mm)')
    panel.legend()
    return figure


def draw_bound(windows: Values) -> Any:
    """Draw acceleration over displacement in each window: mounts, ideal dampers, the best forces."""
    rows = -(-len(windows) // 2)
    figure, panels = new_panels('The best force of the pads: rms over no current', rows, 2, 4.0 * rows)

    def places(points: Values) -> FloatArray:
        return np.sqrt([[point[measure] for measure in MEASURES] for point in points.values()])

    for panel, (name, each) in zip(panels.flat, windows.items(), strict=False):
        for label, points, colour in (
            ('best force, wear in W', each['best'], 'black'),
            ('ideal dampers, N s/m', each['ideal'], BLUE),
        ):
            panel.plot(*places(points).T, 'o-', color=colour, markersize=4, label=label)
            for place, (damping, point) in zip(places(points), points.items(), strict=True):
                text = f'{point["wear_w"]:.2f}' if 'wear_w' in point else damping
                panel.annotate(text, place, (3, 3), textcoords='offset points', fontsize='small')
        for who, place in zip(each['mounts'], places(each['mounts']), strict=True):
            panel.plot(*place, 's', color=_LINES[who]['color'], label=who)
        panel.set_title(name, fontsize='medium')
        panel.set(xlim=(0.0, None), ylim=(0.0, None))
        panel.set(xlabel='displacement, 3 to 14 Hz', ylabel='acceleration, 20 to 200 Hz')
    legend_below(figure, panels.flat[0], 3)
    return figure


EXPERIMENT = Experiment(
    NAME,
    """The paper's switched policy and the continuous law on the same roads, racks and engines, beside the
    hydromount and the mount without current: benefit and cost of each.""",
    PolicyParameters(),
    run,
    policies=POLICIES,
)
