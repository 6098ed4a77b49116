"""The runs that are compared: which policy or mount, on what, and with which plant."""

from collections.abc import Iterator
from itertools import product
from typing import Annotated, Any, NamedTuple

from engine_mount.experiments.harness.closed_loop import settings_of_run
from engine_mount.experiments.harness.contract import Order
from engine_mount.experiments.policy.runs import PolicyJob
from engine_mount.experiments.sweep.evaluation import FIRST_FREQUENCY, RATE
from mount_control.policy import continuous_viscous
from mount_models.quantity import Quantity
from mount_sim.excitation.scenario import AccelerationScale, RecordedScenario
from mount_sim.plant.vehicle import Elastomer, Vehicle

NAME = 'policy'
PAPER, CONTINUOUS = 'switched_viscous', 'continuous_viscous'
POLICIES = (PAPER, CONTINUOUS)
OFF, HYDRO = 'no current', 'hydromount'
COMPARED = (*POLICIES, OFF, HYDRO)
NOMINAL = 8.0  # Hz
_NOISE, _JITTER = {'electronics.displacement_noise': 1e-5}, {'electronics.sample_jitter': 3e-4}
DISTURBANCES: dict[str, dict[str, float]] = {
    'nominal': {},
    'pads -15 %': {'friction.scale': 0.85},
    'pads +15 %': {'friction.scale': 1.15},
    '10 um noise': _NOISE,
    '0.3 ms jitter': _JITTER,
    'coil at 80 degC': {'electronics.coil_temperature': 80.0},
    'pads -15 %, noise, jitter': {'friction.scale': 0.85, **_NOISE, **_JITTER},
    'pads +15 %, noise, jitter': {'friction.scale': 1.15, **_NOISE, **_JITTER},
}
ABLATIONS: dict[str, dict[str, float]] = {
    'as it is': {},
    'idle line not weighed': {'idle_weight': 0.0},
    'quality 1': {'quality': 1.0},
    'slow tracker': {'position_gain': 0.3},
    'no prediction': {'lead_time': 0.0},
    'opens and closes at once': {'opening_time': 0.001, 'closing_time': 0.003},
    'opens slowly': {'opening_time': 0.04},
    'rounded less': {'rounding_velocity': 0.0001},
    'rounded more': {'rounding_velocity': 0.004},
}
AMPLITUDES = ((0.12e-3, 0.40e-3), (0.20e-3, 0.48e-3), (0.30e-3, 0.60e-3), (0.45e-3, 0.80e-3))  # m
DAMPINGS = (1500.0, 2000.0, 2600.0, 3200.0)  # N s/m
NAMED = {
    'gentle': (0.12e-3, 0.40e-3, 1500.0),
    'default': (0.12e-3, 0.40e-3, 2600.0),
    'sparing': (0.30e-3, 0.60e-3, 1500.0),
}
"""Points of the front that are worth a name: lowest and full amplitude (m), damping coefficient (N s/m)."""
LEARNT_ROADS, LEARNT_SCALES = (2e-6, 16e-6), (0.85, 1.0, 1.15)
_ROUGH, _HELD_OUT_SEED = 16e-6, 101  # m^3: class A of ISO 8608; a road that nothing was tuned on
ROADS = {'random': _ROUGH, 'smooth': 2e-6}
"""Roughness (m^3) of the random roads: class A of ISO 8608, and a good motorway."""
_GAP_TIME, _GAP_SECONDS = 2.0, 4.0  # s
_RACK_AMPLITUDE, _RACK_SECONDS = 1e-3, 3.5  # m, s
_ROAD_SECONDS, SPEED = 12.0, 33.0  # s, m/s
_TIP_IN = 400.0  # N, chosen
_SHOWN_LEVELS, _SHOWN_DEPTH = (0.04, 0.12), 0.02


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
    jobs = Jobs(order, parameters, axes)
    made = [*jobs.sweeps(), *jobs.gaps(), *jobs.rack(), *jobs.roads()]
    return made + (
        [*jobs.robustness(), *jobs.idling(), *jobs.learning(), *jobs.variants()]
        if parameters.thorough
        else []
    )


class Jobs:
    """Makes the runs group by group."""

    def __init__(self, order: Order, parameters: PolicyParameters, axes: Axes):
        self._order, self._parameters, self._axes = order, parameters, axes

    def sweeps(self) -> Iterator[PolicyJob]:
        """Yield the sweeps over all levels, without and with idle force."""
        for level, idle, who in product(self._axes.levels, (0.0, self._parameters.idle_amplitude), COMPARED):
            kept = idle == 0.0 and level in _SHOWN_LEVELS
            last = self._parameters.last_frequency
            yield self._job(('sweep', who, level, idle), _sweep(level, last, idle), 'sweep', kept=kept)

    def gaps(self) -> Iterator[PolicyJob]:
        """Yield the gaps of all depths on several roads."""
        for depth, seed, who in product(
            self._axes.depths, range(1, self._parameters.gap_seeds + 1), COMPARED
        ):
            kept = seed == 1 and depth == _SHOWN_DEPTH
            yield self._job(('gap', who, depth, seed), _gap(depth, 2e-6, seed), 'gap', kept=kept)

    def rack(self) -> Iterator[PolicyJob]:
        """Yield the sines of the rack."""
        own = continuous_viscous.Parameters()
        dampers = {PAPER: (2000.0, 0.004), CONTINUOUS: (own.damping_coefficient, own.rounding_velocity)}
        for frequency, who in product(self._axes.frequencies, (*POLICIES, HYDRO)):
            sim = {
                'scenario': 'bench',
                'bench.frequency': frequency,
                'bench.amplitude': _RACK_AMPLITUDE,
                'timeline.duration': _RACK_SECONDS,
            }
            yield self._job(('rack', who, frequency), sim, 'rack', damper=dampers.get(who, (0.0, 0.0)))

    def roads(self) -> Iterator[PolicyJob]:
        """Yield random roads, a tip-in, and the road behind the recording."""
        for idle, who in product((0.0, self._parameters.idle_amplitude), COMPARED):
            for road, roughness in ROADS.items():
                sim = _motorway(roughness, _HELD_OUT_SEED, _ROAD_SECONDS) | {'idle.amplitude': idle}
                yield self._job(('road', who, road, idle), sim, 'road')
            if self._parameters.recorded is not None:
                sim = {'scenario': 'motorway', 'idle.amplitude': idle}
                recorded = self._parameters.recorded
                yield self._job(('road', who, 'recorded', idle), sim, 'road', recorded=recorded, kept=True)
        for who in COMPARED:
            sim = _motorway(2e-6, _HELD_OUT_SEED, 4.0) | {'tip_in.force': _TIP_IN}
            yield self._job(('tip-in', who), sim, 'road')

    def robustness(self) -> Iterator[PolicyJob]:
        """Yield sweeps with other engines, pads, sensors and temperatures."""
        for plant, (name, changes), level in product(
            self._axes.plants, DISTURBANCES.items(), self._axes.engine_levels
        ):
            sim = _sweep(level, 14.0, 0.0) | _engine(*plant)
            yield self._job(('robust', CONTINUOUS, *plant, name, level), sim | changes, 'sweep')
            if name == 'nominal':
                yield self._job(('robust', HYDRO, *plant, level), sim, 'sweep')
                yield self._job(('robust', PAPER, *plant, name, level), sim, 'sweep')

    def idling(self) -> Iterator[PolicyJob]:
        """Yield roads with an idling engine."""
        for roughness, frequency, force, who in product(
            (2e-6, _ROUGH), self._axes.idle_frequencies, self._axes.idle_forces, COMPARED
        ):
            sim = _motorway(roughness, _HELD_OUT_SEED, 6.0) | {
                'idle.amplitude': force,
                'idle.frequency': frequency,
            }
            yield self._job(('idle', who, roughness, frequency, force), sim, 'road')

    def learning(self) -> Iterator[PolicyJob]:
        """Yield roads with other engines and gaps with other pads, to see what could be learnt of them."""
        for plant, roughness in product(self._axes.plants, LEARNT_ROADS):
            sim = _motorway(roughness, _HELD_OUT_SEED, 10.0) | _engine(*plant)
            yield self._job(('learn', CONTINUOUS, *plant, roughness), sim, 'road')
        seeds = range(1, self._parameters.gap_seeds + 1)
        for scale, roughness, seed in product(LEARNT_SCALES, LEARNT_ROADS, seeds):
            sim = _gap(_SHOWN_DEPTH, roughness, seed) | {'friction.scale': scale}
            yield self._job(('learn', CONTINUOUS, scale, roughness, seed), sim, 'gap')

    def variants(self) -> Iterator[PolicyJob]:
        """Yield the continuous law without each of its parts, and the points of the front."""
        for name, changes in ABLATIONS.items():
            yield from self._variant(('ablation', name), changes)
        for (lowest, full), damping in product(AMPLITUDES, DAMPINGS):
            changes = {'lowest_amplitude': lowest, 'full_amplitude': full, 'damping_coefficient': damping}
            yield from self._variant(('front', lowest, full, damping), changes)

    def _variant(self, key: tuple[Any, ...], changes: dict[str, float]) -> Iterator[PolicyJob]:
        for level in (self._axes.levels[0], self._axes.levels[-1]):
            yield self._job((*key, CONTINUOUS, level), _sweep(level, 14.0, 0.0), 'sweep', changes)
        for idle in (0.0, self._parameters.idle_amplitude):
            sim = _motorway(_ROUGH, _HELD_OUT_SEED, _ROAD_SECONDS) | {'idle.amplitude': idle}
            yield self._job((*key, CONTINUOUS, 'road', idle), sim, 'road', changes)

    def _job(
        self,
        key: tuple[Any, ...],
        sim: dict[str, Any],
        kind: str,
        changes: dict[str, float] | None = None,
        **more: Any,
    ) -> PolicyJob:
        who = next(part for part in key if part in COMPARED)
        policy = who if who in POLICIES else PAPER
        own = {
            'mount_sim': sim | {'mount': {OFF: 'friction_off', HYDRO: 'hydro'}.get(who, 'friction')},
            'mount_control': {'policy': policy, **_named(policy, changes or {})},
        }
        return PolicyJob(key, settings_of_run(self._order, own, NAME), kind, **more)


def _named(policy: str, changes: dict[str, float]) -> dict[str, float]:
    return {f'{policy}.{name}': value for name, value in changes.items()}


def _sweep(level: float, last: float, idle: float) -> dict[str, Any]:
    return {
        'scenario': 'sweep',
        'sweep.velocity_amplitude': level,
        'sweep.first_frequency': FIRST_FREQUENCY,
        'sweep.last_frequency': last,
        'sweep.rate': RATE,
        'idle.amplitude': idle,
    }


def _motorway(roughness: float, seed: int, duration: float) -> dict[str, Any]:
    return {
        'scenario': 'motorway',
        'seed': seed,
        'timeline.duration': duration,
        'motorway.roughness': roughness,
        'motorway.speed': SPEED,
        'motorway.gap_depth': 0.0,
    }


def _gap(depth: float, roughness: float, seed: int) -> dict[str, Any]:
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
