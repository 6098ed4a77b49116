"""The runs that are compared: which policy or mount, on what, and with which plant."""

import importlib.resources
from collections.abc import Callable, Iterator, Mapping
from functools import partial
from itertools import product
from types import MappingProxyType
from typing import Annotated, Any, NamedTuple

from engine_mount.experiments.harness.closed_loop import settings_of_run
from engine_mount.experiments.harness.contract import Order, Values
from engine_mount.experiments.harness.measures import sweep_parameters
from engine_mount.experiments.policy_runs import PolicyJob
from mount_control.policy import continuous_viscous
from mount_models.plain_yaml import plain_yaml
from mount_models.quantity import Quantity
from mount_sim.excitation.scenario import AccelerationScale, RecordedScenario
from mount_sim.plant.vehicle import Elastomer, Vehicle

NAME = 'policy'
PAPER, CONTINUOUS = 'switched_viscous', 'continuous_viscous'
POLICIES = (PAPER, CONTINUOUS)
OFF, HYDRO = 'no current', 'hydromount'
COMPARED = (*POLICIES, OFF, HYDRO)
NOMINAL = 8.0  # Hz
_CASES = plain_yaml(importlib.resources.files(__package__).joinpath('policy_cases.yaml').read_text('utf-8'))
DISTURBANCES, ABLATIONS, DAMPINGS = _CASES['disturbances'], _CASES['ablations'], _CASES['dampings']
AMPLITUDES = tuple(map(tuple, _CASES['amplitudes']))
NAMED = {tuple(point): name for name, point in _CASES['points'].items()}
"""{lowest and full amplitude (m), damping coefficient (N s/m): name}: points of the front worth one."""
LEARNT_ROADS, LEARNT_SCALES = (2e-6, 16e-6), (0.85, 1.0, 1.15)
_ROUGH, _HELD_OUT_SEED = 16e-6, 101  # m^3: class A of ISO 8608; a road that nothing was tuned on
ROADS = {'random': _ROUGH, 'smooth': 2e-6}
"""Roughness (m^3) of the random roads: class A of ISO 8608, and a good motorway."""
_GAP_TIME, _GAP_SECONDS = 2.0, 4.0  # s
_RACK_AMPLITUDE, _RACK_SECONDS = 1e-3, 3.5  # m, s
_ROAD_SECONDS, SPEED = 12.0, 33.0  # s, m/s
_TIP_IN = 400.0  # N, chosen
_SHOWN_LEVELS, _SHOWN_DEPTH = (0.04, 0.12), 0.02


Make = Callable[..., PolicyJob]
"""Makes a run from its key, the parameters of the simulator and the kind of its figures."""


class PolicyParameters(NamedTuple):
    """Values between which all combinations are run, separated by commas, and a recorded drive."""

    road_levels: str = '0.04, 0.06, 0.08, 0.10, 0.12, 0.16, 0.20'
    last_frequency: Annotated[float, Quantity('Hz', 'end of the sweep', 14.0, 50.0, 'Sec. 6')] = 50.0
    idle_amplitude: Annotated[float, Quantity('N', 'force of the idling engine', 1.0, 2000.0)] = 200.0
    gap_depths: str = '0.010, 0.020, 0.030'
    gap_seeds: Annotated[int, Quantity('1', 'roads with a gap at each depth', 1, 100)] = 10
    rack_frequencies: str = '5, 6, 7, 8, 9, 10, 11, 12'
    engines: str = '6, 7, 9.5, 11'
    engine_levels: str = '0.04, 0.06, 0.12'
    idle_frequencies: str = '20, 23, 26.7, 30, 33'
    idle_forces: str = '80, 200, 400'
    thorough: Annotated[int, Quantity('1', '1: robustness, idle, ablation, front too', 0, 1)] = 1
    recording: str = ''
    column: str = ''
    scale: AccelerationScale = 1.0
    recorded_speed: Annotated[
        float, Quantity('m/s', 'mean speed of the recorded drive', 0.1, 90.0, 'its own')
    ] = 16.7
    workers: Annotated[int, Quantity('1', 'processes; 0: one for each core', 0, 256)] = 0

    @property
    def recorded(self) -> RecordedScenario | None:
        """The recorded drive, None without one."""
        if not self.recording:
            return None
        return RecordedScenario(file=self.recording, column=self.column, scale=self.scale)


class Axes(NamedTuple):
    """The numbers in the parameters."""

    levels: list[float]
    depths: list[float]
    frequencies: list[float]
    engines: list[float]
    engine_levels: list[float]
    idle_frequencies: list[float]
    idle_forces: list[float]

    @property
    def plants(self) -> list[tuple[str, float]]:
        """The engines: how their frequency (Hz) is reached, and the frequency."""
        return [('mass', NOMINAL), *product(('mass', 'stiffness'), self.engines)]


def jobs_of(order: Order, parameters: PolicyParameters, axes: Axes) -> list[PolicyJob]:
    """Return all runs."""
    make = partial(_job, order)
    jobs = [*_roads_and_rack(make, parameters, axes)]
    if parameters.thorough:
        jobs += [*_robustness(make, axes), *_idling(make, axes), *_learning(make, parameters, axes)]
        for name, changes in ABLATIONS.items():
            jobs += _variant(make, parameters, axes, ('ablation', name), changes)
        for (lowest, full), damping in product(AMPLITUDES, DAMPINGS):
            changes = {'lowest_amplitude': lowest, 'full_amplitude': full, 'damping_coefficient': damping}
            jobs += _variant(make, parameters, axes, ('front', lowest, full, damping), changes)
    return jobs


def _roads_and_rack(make: Make, parameters: PolicyParameters, axes: Axes) -> Iterator[PolicyJob]:
    """Yield sweeps, gaps of all depths on several roads, sines of the rack, roads and a tip-in."""
    idles = (0.0, parameters.idle_amplitude)
    for level, idle, who in product(axes.levels, idles, COMPARED):
        kept = idle == 0.0 and level in _SHOWN_LEVELS
        sim = sweep_parameters(level, parameters.last_frequency, idle)
        yield make(('sweep', who, level, idle), sim, 'sweep', kept=kept)
    for depth, seed, who in product(axes.depths, range(1, parameters.gap_seeds + 1), COMPARED):
        kept = seed == 1 and depth == _SHOWN_DEPTH
        yield make(('gap', who, depth, seed), _gap(depth, 2e-6, seed), 'gap', kept=kept)
    own = continuous_viscous.Parameters()
    dampers = {PAPER: (2000.0, 0.004), CONTINUOUS: (own.damping_coefficient, own.rounding_velocity)}
    for frequency, who in product(axes.frequencies, (*POLICIES, HYDRO)):
        sim = {
            'scenario': 'bench',
            'bench.frequency': frequency,
            'bench.amplitude': _RACK_AMPLITUDE,
            'timeline.duration': _RACK_SECONDS,
        }
        yield make(('rack', who, frequency), sim, 'rack', damper=dampers.get(who, (0.0, 0.0)))
    for idle, who in product(idles, COMPARED):
        for road, roughness in ROADS.items():
            sim = _motorway(roughness, _HELD_OUT_SEED, _ROAD_SECONDS) | {'idle.amplitude': idle}
            yield make(('road', who, road, idle), sim, 'road')
        if parameters.recorded is not None:
            sim = {'scenario': 'motorway', 'idle.amplitude': idle}
            key = ('road', who, 'recorded', idle)
            yield make(key, sim, 'road', recorded=parameters.recorded, kept=True)
    for who in COMPARED:
        sim = _motorway(2e-6, _HELD_OUT_SEED, 4.0) | {'tip_in.force': _TIP_IN}
        yield make(('tip-in', who), sim, 'road')


def _robustness(make: Make, axes: Axes) -> Iterator[PolicyJob]:
    """Yield sweeps with other engines, pads, sensors and temperatures."""
    for plant, (name, changes), level in product(axes.plants, DISTURBANCES.items(), axes.engine_levels):
        sim = sweep_parameters(level, 14.0) | _engine(*plant)
        yield make(('robust', CONTINUOUS, *plant, name, level), sim | changes, 'sweep')
        if name == 'nominal':
            yield make(('robust', HYDRO, *plant, level), sim, 'sweep')
            yield make(('robust', PAPER, *plant, name, level), sim, 'sweep')


def _idling(make: Make, axes: Axes) -> Iterator[PolicyJob]:
    """Yield roads with an idling engine."""
    for roughness, frequency, force, who in product(
        (2e-6, _ROUGH), axes.idle_frequencies, axes.idle_forces, COMPARED
    ):
        idle = {'idle.amplitude': force, 'idle.frequency': frequency}
        sim = _motorway(roughness, _HELD_OUT_SEED, 6.0) | idle
        yield make(('idle', who, roughness, frequency, force), sim, 'road')


def _learning(make: Make, parameters: PolicyParameters, axes: Axes) -> Iterator[PolicyJob]:
    """Yield roads with other engines and gaps with other pads, to see what could be learnt of them."""
    for plant, roughness in product(axes.plants, LEARNT_ROADS):
        sim = _motorway(roughness, _HELD_OUT_SEED, 10.0) | _engine(*plant)
        yield make(('learn', CONTINUOUS, *plant, roughness), sim, 'road')
    seeds = range(1, parameters.gap_seeds + 1)
    for scale, roughness, seed in product(LEARNT_SCALES, LEARNT_ROADS, seeds):
        sim = _gap(_SHOWN_DEPTH, roughness, seed) | {'friction.scale': scale}
        yield make(('learn', CONTINUOUS, scale, roughness, seed), sim, 'gap')


def _variant(
    make: Make, parameters: PolicyParameters, axes: Axes, key: tuple[Any, ...], changes: dict[str, float]
) -> Iterator[PolicyJob]:
    """Yield the runs of the continuous law with some of its parameters changed."""
    for level in (axes.levels[0], axes.levels[-1]):
        yield make((*key, CONTINUOUS, level), sweep_parameters(level, 14.0), 'sweep', changes)
    for idle in (0.0, parameters.idle_amplitude):
        sim = _motorway(_ROUGH, _HELD_OUT_SEED, _ROAD_SECONDS) | {'idle.amplitude': idle}
        yield make((*key, CONTINUOUS, 'road', idle), sim, 'road', changes)


def _job(
    order: Order,
    key: tuple[Any, ...],
    sim: Values,
    kind: str,
    changes: Mapping[str, float] = MappingProxyType({}),
    **more: Any,
) -> PolicyJob:
    who = next(part for part in key if part in COMPARED)
    policy = who if who in POLICIES else PAPER
    changed = {f'{policy}.{name}': value for name, value in changes.items()}
    own = {
        'mount_sim': sim | {'mount': {OFF: 'friction_off', HYDRO: 'hydro'}.get(who, 'friction')},
        'mount_control': {'policy': policy, **changed},
    }
    return PolicyJob(key, settings_of_run(order, own, NAME), kind, **more)


def _motorway(roughness: float, seed: int, duration: float) -> Values:
    return {
        'scenario': 'motorway',
        'seed': seed,
        'timeline.duration': duration,
        'motorway.roughness': roughness,
        'motorway.speed': SPEED,
        'motorway.gap_depth': 0.0,
    }


def _gap(depth: float, roughness: float, seed: int) -> Values:
    return {
        **_motorway(roughness, seed, _GAP_SECONDS),
        'motorway.gap_depth': depth,
        'motorway.gap_time': _GAP_TIME,
    }


def _engine(how: str, frequency: float) -> dict[str, float]:
    """Return the parameters of a plant whose engine shakes at `frequency` (Hz), by mass or stiffness."""
    ratio = (frequency / NOMINAL) ** 2
    if how == 'mass':
        return {'vehicle.engine_mass': Vehicle().engine_mass / ratio}
    return {
        f'vehicle.elastomer.{name}': ratio * value
        for name, value in Elastomer()._asdict().items()
        if name.endswith('stiffness')
    }
