"""The figures of the comparison, from those of the runs."""

from itertools import product
from typing import Any, NamedTuple

import numpy as np

from engine_mount.drives.bands import BELOW_ISOLATION
from engine_mount.experiments.harness.contract import Values
from engine_mount.experiments.harness.many_runs import Found
from engine_mount.experiments.harness.measures import FIRST_FREQUENCY, RATE, first_extremum, peak_in
from engine_mount.experiments.policy_cases import (
    ABLATIONS,
    AMPLITUDES,
    COMPARED,
    CONTINUOUS,
    DAMPINGS,
    DISTURBANCES,
    HYDRO,
    LEARNT_ROADS,
    LEARNT_SCALES,
    NAMED,
    OFF,
    PAPER,
    POLICIES,
    ROADS,
    SPEED,
    Axes,
    PolicyParameters,
)
from engine_mount.reports.drive.signals import FloatArray
from mount_models.arithmetic.compiled import compiled
from mount_models.sampling import SAMPLE_TIME
from mount_sim.excitation.road import Gap, gap_in_road, sweep_road
from mount_sim.excitation.scenario import STEP_TIME, SweepScenario
from mount_sim.plant.vehicle import Vehicle, resting_vehicle, vehicle_step

_STEPS = round(SAMPLE_TIME / STEP_TIME)
_SPEED, _GAP_LENGTH, _GAP_SECONDS = 33.0, 1.0, 1.0  # m/s, m, s
_SWEEP_SECONDS = (BELOW_ISOLATION[1] - FIRST_FREQUENCY) / RATE


class GapLimit(NamedTuple):
    """Largest displacement and first extremum (m) over a gap."""

    peak_m: float
    first_m: float


@compiled
def _damped(vehicle, state, road, damping, first, dt, displacement, every):
    """Fill `displacement` (m) at each `every`-th step; the damper (N s/m) is on from step `first` on."""
    velocity = 0.0
    for k in range(road.size):
        force = damping * velocity if k >= first else 0.0
        motion = vehicle_step(vehicle, state[0], road[k], 0.0, force, dt)
        velocity = motion.velocity
        if k % every == 0:
            displacement[k // every] = motion.displacement


def damped(road: FloatArray, damping: float, first: int = 0) -> FloatArray:
    """Return the displacement (m) at 1 kHz over a road (m) at the plant's step."""
    displacement = np.zeros(-(-road.size // _STEPS))
    _damped(Vehicle(), resting_vehicle(), road, damping, first, STEP_TIME, displacement, _STEPS)
    return displacement


def sweep_limit(level: float, damping: float) -> float:
    """Return the largest displacement (m) from 3 to 14 Hz with an ideal damper always on."""
    time = STEP_TIME * np.arange(round(_SWEEP_SECONDS / STEP_TIME))
    displacement = damped(sweep_road(time, SweepScenario(velocity_amplitude=level)), damping)
    frequency = FIRST_FREQUENCY + RATE * SAMPLE_TIME * np.arange(displacement.size)
    return peak_in(frequency, displacement, BELOW_ISOLATION) or float('nan')


def gap_limit(depth: float, damping: float, delay: float) -> GapLimit:
    """Return what a damper leaves that is on `delay` s after the wheel meets the gap, on a smooth road."""
    time = STEP_TIME * np.arange(round(_GAP_SECONDS / STEP_TIME))
    road = gap_in_road(time, Gap(depth=depth, position=0.0, length=_GAP_LENGTH, speed=_SPEED))
    displacement = damped(road, damping, round(delay / STEP_TIME))
    return GapLimit(float(np.abs(displacement).max()), first_extremum(displacement))


_LIMIT_DAMPINGS = (910.0, 1100.0, 2000.0, 2600.0, 3000.0)  # N s/m
_LIMIT_DELAYS = (0.0, 0.04, 0.065, 0.1, 0.15)  # s
_LIMIT_DEPTH, _LIMIT_DAMPING = 0.02, 2000.0
_SUPPORTED = (*POLICIES, OFF)


def figures_of(found: Found, parameters: PolicyParameters, axes: Axes) -> Values:
    """Return all figures: plain numbers, texts, lists and mappings."""
    idle, seeds = parameters.idle_amplitude, range(1, parameters.gap_seeds + 1)

    def over(what: str, kind: str, who: str, *rest: Any, other: str = HYDRO) -> float:
        """Return a figure of one mount over that of the `other` one in the same run."""
        return float(found[kind, who, *rest][what] / found[kind, other, *rest][what])

    def of_gaps(what: str) -> Values:
        return {
            who: {number(1e3 * d): [over(what, 'gap', who, d, seed) for seed in seeds] for d in axes.depths}
            for who in _SUPPORTED
        }

    def of_rack(what: str, *mounts: str) -> Values:
        return {who: {number(f): found['rack', who, f][what] for f in axes.frequencies} for who in mounts}

    def of_road(road: str, speed: float, who: str) -> Values:
        return {
            'acceleration': over('acceleration', 'road', who, road, 0.0, other=OFF),
            'acceleration_idling': over('acceleration', 'road', who, road, idle, other=OFF),
            'displacement': over('peak_m', 'road', who, road, 0.0),
            'j_per_km': 1e3 * found['road', who, road, 0.0]['power_w'] / speed,
            'heat_w': found['road', who, road, 0.0]['heat_w'],
        }

    roads = dict.fromkeys(ROADS, SPEED)
    if parameters.recorded is not None:
        roads['recorded'] = parameters.recorded_speed
    energy_road = 'random' if parameters.recorded is None else 'recorded'
    told: Values = {
        'sweep_ratio': {
            who: {number(level): over('peak_m', 'sweep', who, level, 0.0) for level in axes.levels}
            for who in _SUPPORTED
        },
        'gap_peak_ratio': of_gaps('peak_m'),
        'gap_first_extremum_ratio': of_gaps('first_m'),
        'thd': of_rack('thd', *POLICIES, HYDRO),
        'tracking': of_rack('tracking', *POLICIES),
        'high_frequency_ratio': _high(found, axes, 0.0),
        'high_frequency_ratio_idling': _high(found, axes, idle),
        'roads': {
            road: {who: of_road(road, speed, who) for who in COMPARED} for road, speed in roads.items()
        },
        'tip_in': {
            who: {
                'peak': over('peak_m', 'tip-in', who),
                'acceleration': over('acceleration', 'tip-in', who, other=OFF),
            }
            for who in _SUPPORTED
        },
        'limits': _limits(found, axes),
        'idle_amplitude_n': idle,
        'energy_road': energy_road,
    }
    told['energy_j_per_km'] = {who: told['roads'][energy_road][who]['j_per_km'] for who in POLICIES}
    if not parameters.thorough:
        return told
    engines = {f'{frequency:g} Hz by {how}': (how, frequency) for how, frequency in axes.plants}

    def worst(who: str, plant: tuple[str, float], name: str) -> float:
        """Return the highest ratio over the levels."""
        return max(
            found['robust', who, *plant, name, level]['peak_m']
            / found['robust', HYDRO, *plant, level]['peak_m']
            for level in axes.engine_levels
        )

    return told | {
        'robustness': {
            engine: {
                **{name: worst(CONTINUOUS, plant, name) for name in DISTURBANCES},
                PAPER: worst(PAPER, plant, 'nominal'),
            }
            for engine, plant in engines.items()
        },
        'idling': {
            number(1e6 * roughness): {
                who: {
                    f'{frequency:g} Hz, {force:g} N': [
                        over('acceleration', 'idle', who, roughness, frequency, force, other=OFF),
                        over('rms_m', 'idle', who, roughness, frequency, force),
                    ]
                    for frequency, force in product(axes.idle_frequencies, axes.idle_forces)
                }
                for who in COMPARED
            }
            for roughness in sorted({key[2] for key in found if key[0] == 'idle'})
        },
        # what estimators from displacement alone say of engines and pads that are known here
        'learnt': {
            'frequency_hz': {
                engine: {
                    number(1e6 * road): found['learn', CONTINUOUS, *plant, road]['frequency_hz']
                    for road in LEARNT_ROADS
                }
                for engine, plant in engines.items()
            },
            'friction_scale': {
                number(scale): {
                    number(1e6 * road): [
                        found['learn', CONTINUOUS, scale, road, seed]['friction_scale'] for seed in seeds
                    ]
                    for road in LEARNT_ROADS
                }
                for scale in LEARNT_SCALES
            },
        },
        'ablation': {name: _variant(found, ('ablation', name), axes) for name in ABLATIONS},
        'front': _front(found, axes),
    }


def number(value: float) -> str:
    """Return a number as the key of a mapping."""
    return f'{value:g}'


def _high(found: Found, axes: Axes, idle: float) -> dict[str, dict[str, float]]:
    """Return the rms of the acceleration in the bands above 14 Hz together, over that without current."""

    def rms(who: str, level: float) -> float:
        bands = [each for each in found['sweep', who, level, idle]['rms'] if each is not None]
        return float(np.sqrt(np.sum(np.square(bands)))) if bands else float('nan')

    levels = [level for level in axes.levels if not np.isnan(rms(OFF, level))]
    return {
        who: {number(level): rms(who, level) / rms(OFF, level) for level in levels}
        for who in (*POLICIES, HYDRO)
    }


def _variant(found: Found, key: tuple[Any, ...], axes: Axes) -> dict[str, float]:
    idle = max(each[-1] for each in found if each[: len(key)] == key and each[-2] == 'road')
    low, high = axes.levels[0], axes.levels[-1]
    road = found[*key, CONTINUOUS, 'road', 0.0]
    idling = found[*key, CONTINUOUS, 'road', idle]
    return {
        'light_road': found[*key, CONTINUOUS, low]['peak_m'] / found['sweep', HYDRO, low, 0.0]['peak_m'],
        'strong_road': found[*key, CONTINUOUS, high]['peak_m'] / found['sweep', HYDRO, high, 0.0]['peak_m'],
        'acceleration': road['acceleration'] / found['road', OFF, 'random', 0.0]['acceleration'],
        'acceleration_idling': idling['acceleration'] / found['road', OFF, 'random', idle]['acceleration'],
        'j_per_km': 1e3 * road['power_w'] / SPEED,
    }


def _front(found: Found, axes: Axes) -> list[Values]:
    """Return all points, each with whether another one is better in ratio, wear and both accelerations."""
    points = []
    for lowest, full in AMPLITUDES:
        for damping in DAMPINGS:
            figures = _variant(found, ('front', lowest, full, damping), axes)
            points.append(
                {
                    'name': NAMED.get((lowest, full, damping), ''),
                    'lowest_amplitude_m': lowest,
                    'full_amplitude_m': full,
                    'damping_coefficient': damping,
                    **figures,
                }
            )
    costs = ('light_road', 'acceleration', 'acceleration_idling', 'j_per_km')
    for point in points:
        point['on_front'] = not any(
            other is not point and all(other[cost] <= point[cost] for cost in costs) for other in points
        )
    return points


def _limits(found: Found, axes: Axes) -> Values:
    """Return what an ideal damper leaves: always on in the sweep, on after some delay over a gap."""
    always, free = gap_limit(_LIMIT_DEPTH, _LIMIT_DAMPING, 0.0), gap_limit(_LIMIT_DEPTH, 0.0, 0.0)
    return {
        'sweep_always_on': {
            number(damping): {
                number(level): sweep_limit(level, damping) / found['sweep', HYDRO, level, 0.0]['peak_m']
                for level in axes.levels
            }
            for damping in _LIMIT_DAMPINGS
        },
        'gap_after_delay': {
            number(1e3 * delay): gap_limit(_LIMIT_DEPTH, _LIMIT_DAMPING, delay).peak_m / free.peak_m
            for delay in _LIMIT_DELAYS
        },
        'gap_first_extremum_always_on': always.first_m / free.first_m,
        'gap_damping': _LIMIT_DAMPING,
        'gap_depth_m': _LIMIT_DEPTH,
    }
