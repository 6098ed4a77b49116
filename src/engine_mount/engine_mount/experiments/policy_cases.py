"""The runs that are compared: which policy or mount, on what, with which plant; and the figures of each."""

import importlib.resources
from collections.abc import Callable, Mapping
from functools import partial
from itertools import product
from types import MappingProxyType
from typing import Annotated, Any, NamedTuple

import numpy as np

from engine_mount.experiments import bound
from engine_mount.experiments.harness.closed_loop import Case, at_each_step, settings_of_run
from engine_mount.experiments.harness.experiment import OURS as CONTINUOUS
from engine_mount.experiments.harness.experiment import PAPER, Order, Values, Workers
from engine_mount.experiments.harness.measures import (
    BELOW_ISOLATION,
    first_extremum,
    peak_and_rms,
    sweep_parameters,
)
from engine_mount.reports.drive.felt import felt
from engine_mount.reports.drive.signals import Truth
from engine_mount.reports.sections.periodic import distortion, faded, harmonics, rms_in_bands, whole_periods
from mount_models.plain_yaml import plain_yaml
from mount_models.quantity import Quantity
from mount_models.sampling import SAMPLE_TIME
from mount_sim.excitation.scenario import STEP_TIME
from mount_sim.parameters import SimParameters
from mount_sim.plant.vehicle import Elastomer, Vehicle

POLICIES = (PAPER, CONTINUOUS)
OFF, HYDRO = 'no current', 'hydromount'
COMPARED = (*POLICIES, OFF, HYDRO)
KNOWN = f'{CONTINUOUS}, speed known'
"""The same where the vehicle sends the speed of its engine."""
NOMINAL = 8.0  # Hz
_CASES = plain_yaml(importlib.resources.files(__package__).joinpath('policy_cases.yaml').read_text('utf-8'))
DISTURBANCES, ABLATIONS = _CASES['disturbances'], _CASES['ablations']
UNSTABLE = {name: DISTURBANCES[name] for name in _CASES['stability']}
HYDROMOUNTS = {
    f'{resistance:.0e} Pa s/m^3, {asymmetry:g}': {
        'mount': 'hydro',
        'hydromount.decoupler_resistance': resistance,
        'hydromount.compliance_asymmetry': asymmetry,
    }
    for resistance, asymmetry in product(_CASES['decoupler_resistances'], _CASES['chamber_asymmetries'])
}
"""Hydromounts that the paper's may have been, of which it gives nothing."""
_MOUNTS: dict[str, Values] = {
    **{policy: {'mount': 'friction'} for policy in POLICIES},
    OFF: {'mount': 'friction_off'},
    HYDRO: {'mount': 'hydro'},
    KNOWN: {'mount': 'friction', 'idle.speed_sent': True},
    **HYDROMOUNTS,
}
FRONT = list(product(_CASES['amplitudes'], _CASES['dampings']))
"""Half amplitudes (m) and damping coefficients (N s/m) that are run."""
NAMED = {tuple(point): name for name, point in _CASES['points'].items()}
"""{point of the front: the name it is worth}."""
ENGINE_ROADS = (5e-7, 2e-6, 16e-6, 64e-6, 256e-6)
"""m^3: a very smooth road, a good motorway, classes A, B and C of ISO 8608."""
_ROUGH, _HELD_OUT_SEED = 16e-6, 101  # m^3: class A of ISO 8608; a road that nothing was tuned on
HIGH_BANDS = ((20.0, 60.0), (60.0, 100.0), (100.0, 200.0), (200.0, 500.0), (500.0, 1000.0), (1000.0, 2000.0))
"""Hz: the first four are in a record at 1 kHz."""
SAMPLED, STEPPED, STRAIGHT = 'sampled at 1 kHz', 'each step of the plant', 'current in straight lines'
FORCE = 'mount force'
_HELD = 0.8  # A, chosen: presses the pads on without a pause
ROADS = {'random': _ROUGH, 'smooth': 2e-6}
"""Roughness (m^3) of the random roads: class A of ISO 8608, and a good motorway."""
GAP_TIME, _GAP_SECONDS = 2.0, 4.0  # s
_RACK = {'scenario': 'bench', 'bench.amplitude': 1e-3, 'timeline.duration': 3.5}
_ROAD_SECONDS, SPEED = 12.0, 33.0  # s, m/s
UNEVEN, UNEVEN_FORCE = 0.3, 100.0  # chosen; N
SHOCKS = (0.06, 0.1)  # m, chosen: depths of gaps beyond any in a road
PULLS = {
    'tip-in': {'tip_in.force': 400.0},
    'lift-off': {'tip_in.force': -400.0},
    'hard tip-in': {'tip_in.force': 800.0, 'tip_in.rise': 0.03},
}
"""N, s, chosen: sudden acceleration; what shifting begins with."""
AMPLITUDES, FREQUENCIES = (0.002, 0.01, 0.03, 0.06), (6.0, 8.0, 11.0)
"""m, Hz, chosen: depths of a gap in a flat road, engines on their mounts: nothing may move a while later."""
_SHOWN_LEVELS, _SHOWN_DEPTH = (0.04, 0.12), 0.02
BOUND_WEIGHTS = (0.2, 0.5, 0.8)  # chosen: of the displacement in J
FORESEEN, PREVIEWS = 'class A', (5, 20, 40)  # ms, chosen
_BOUND_SECONDS = 3.0  # s, chosen: all that the optimum is sought for is known ahead
_SETTLING = 1.0  # s, chosen: a road fades in for so long
_PERIODS = 8  # evaluated on the rack

Key = tuple[Any, ...]
NOTHING: Mapping[str, Any] = MappingProxyType({})


class PolicyParameters(NamedTuple):
    """Values between which all combinations are run, separated by commas."""

    road_levels: str = '0.04, 0.06, 0.08, 0.10, 0.12, 0.16, 0.20'
    last_frequency: Annotated[float, Quantity('Hz', 'end of the sweep', 14.0, 50.0, 'Sec. 6')] = 50.0
    idle_amplitude: Annotated[float, Quantity('N', 'force of the idling engine', 1.0, 2000.0)] = 200.0
    gap_depths: str = '0.010, 0.020, 0.030'
    gap_seeds: Annotated[int, Quantity('1', 'roads with a gap at each depth', 1, 100)] = 10
    rack_frequencies: str = '5, 6, 7, 8, 9, 10, 11, 12'
    engines: str = '6, 7, 9.5, 11'
    engine_levels: str = '0.04, 0.06, 0.12'
    engine_frequencies: str = '20, 26.7, 36, 45, 60, 90, 130, 190'
    engine_forces: str = '60, 100, 300'
    noise: str = '2, 5, 10, 20'
    thorough: Annotated[int, Quantity('1', '1: robustness, idle, ablation, front too', 0, 1)] = 1
    bound: Annotated[int, Quantity('1', '1: the best force of the pads too', 0, 1)] = 1
    workers: Workers = 0


class Axes(NamedTuple):
    """The numbers in the parameters."""

    levels: list[float]
    depths: list[float]
    frequencies: list[float]
    engines: list[float]
    engine_levels: list[float]
    engine_frequencies: list[float]
    engine_forces: list[float]
    noise: list[float]

    @property
    def plants(self) -> list[tuple[str, float]]:
        """The engines: how their frequency (Hz) is reached, and the frequency."""
        return [('mass', NOMINAL), *product(('mass', 'stiffness'), self.engines)]


def cases_of(order: Order, axes: Axes) -> dict[Key, Case]:
    """Return all runs by a key that names policy or mount; `Findings` of the experiment are made of them."""
    own: PolicyParameters = order.parameters
    cases: dict[Key, Case] = {}

    def add(key: Key, sim: Values, figures: Any, changes: Mapping[str, Any] = NOTHING) -> None:
        who = next(part for part in key if part in _MOUNTS)
        policy = CONTINUOUS if who.startswith(CONTINUOUS) else PAPER
        control = {'policy': policy, **{f'{policy}.{name}': value for name, value in changes.items()}}
        cases[key] = Case(settings_of_run(order, {**sim, **_MOUNTS[who]}, control), figures)

    idles, seeds = (0.0, own.idle_amplitude), range(1, own.gap_seeds + 1)
    for level, idle, who in product(axes.levels, idles, COMPARED):
        shown = idle == 0.0 and level in _SHOWN_LEVELS
        figures = partial(with_displacement, peak_and_rms) if shown else peak_and_rms
        add(('sweep', who, level, idle), sweep_parameters(level, own.last_frequency, idle), figures)
    for depth, seed, who in product(axes.depths, seeds, COMPARED):
        shown = seed == 1 and depth == _SHOWN_DEPTH
        figures = partial(with_displacement, of_gap) if shown else of_gap
        add(('gap', who, depth, seed), _gap(depth, 2e-6, seed), figures)
    for depth, who in product(SHOCKS, POLICIES):
        add(('shock', who, depth), _gap(depth, 2e-6, 1), of_gap)
    for frequency, who in product(axes.frequencies, (*POLICIES, HYDRO)):
        add(('rack', who, frequency), {**_RACK, 'bench.frequency': frequency}, of_rack)
    for idle, who in product(idles, COMPARED):
        for road, roughness in ROADS.items():
            add(('road', who, road, idle), _road(roughness, _ROAD_SECONDS, idle), of_road)
    for who, (name, pull) in product(COMPARED, PULLS.items()):
        add((name, who), _road(2e-6, 4.0) | pull, of_road)
    for who, (name, shaken) in product(COMPARED, steady().items()):
        add(('steady', who, name), shaken, of_road)
    for name, sim in windows(own.idle_amplitude).items() if own.bound else ():
        for who in COMPARED:
            add(('bound', who, name), sim, bound.of_ideal if who == OFF else bound.of_run)
        for weight in BOUND_WEIGHTS:
            add(('bound', OFF, name, weight), sim, partial(bound.best, weight))
        if name == FORESEEN:
            for preview in PREVIEWS:
                add(('bound', OFF, name, 'foreseen', preview), sim, partial(bound.foreseen, preview))
    if not own.thorough:
        return cases
    for who in HYDROMOUNTS:
        for level, idle in product(axes.levels, idles):
            add(('sweep', who, level, idle), sweep_parameters(level, own.last_frequency, idle), peak_and_rms)
    for who in (*POLICIES, *HYDROMOUNTS):
        add(('rack', who, NOMINAL), {**_RACK, 'bench.frequency': NOMINAL}, of_rack)
    for who in COMPARED:
        add(('high', who, 'as driven'), {}, of_high_bands)
    for name, changes in _CASES['high frequencies'].items():
        add(('high', CONTINUOUS, name), changes, of_high_bands)
    for depth, frequency, (name, changes) in product(AMPLITUDES, FREQUENCIES, UNSTABLE.items()):
        add(
            ('rest', CONTINUOUS, name, frequency, depth),
            _gap(depth, 0.0, 1) | _engine('mass', frequency) | changes | {'timeline.duration': 8.0},
            of_rest,
        )
    for plant, level in product(axes.plants, axes.engine_levels):
        sim = sweep_parameters(level, 14.0) | _engine(*plant)
        for name, changes in DISTURBANCES.items():
            add(('robust', CONTINUOUS, *plant, name, level), sim | changes, peak_and_rms)
        for who in (PAPER, HYDRO):
            add(('robust', who, *plant, 'nominal', level), sim, peak_and_rms)
    for roughness, frequency, force, who in product(
        ENGINE_ROADS, axes.engine_frequencies, axes.engine_forces, (*COMPARED, KNOWN)
    ):
        sim = _road(roughness, 6.0, force) | {'idle.frequency': frequency}
        add(('engine', who, roughness, frequency, force), sim, of_road)
    for frequency, who in product(axes.engine_frequencies, (*COMPARED, KNOWN)):
        uneven = {'idle.frequency': frequency, 'idle.uneven_share': UNEVEN}
        add(('uneven', who, frequency), _road(_ROUGH, 6.0, UNEVEN_FORCE) | uneven, of_road)
    for (road, roughness), noise, who in product(ROADS.items(), axes.noise, COMPARED):
        sim = _road(roughness, 6.0) | {'electronics.displacement_noise': 1e-6 * noise}
        add(('noise', who, road, noise), sim, of_road)
    variants: dict[Key, Values] = {('ablation', name): changes for name, changes in ABLATIONS.items()}
    for point in FRONT:
        variants['front', *point] = dict(zip(('half_amplitude', 'damping_coefficient'), point, strict=True))
    for key, changes in variants.items():
        for level in (axes.levels[0], axes.levels[-1]):
            add((*key, CONTINUOUS, level), sweep_parameters(level, 14.0), peak_and_rms, changes)
        for idle in idles:
            add((*key, CONTINUOUS, 'road', idle), _road(_ROUGH, _ROAD_SECONDS, idle), of_road, changes)
    return cases


def steady() -> dict[str, Values]:
    """Return steady sines of the road, and half orders of an engine (one for two turns) in the band."""
    road, engine = (4.0, 13.0), (9.0, 12.0)  # Hz, chosen
    lowest = {'sweep.rate': 0.01, 'timeline.duration': 6.0}
    order = {'idle.second_share': 0.0}
    return {
        f'road, {f:g} Hz': sweep_parameters(0.06, f + 0.06) | lowest | {'sweep.first_frequency': f}
        for f in road
    } | {f'half order, {f:g} Hz': _road(2e-6, 6.0, 60.0) | order | {'idle.frequency': f} for f in engine}


def windows(idle: float) -> dict[str, Values]:
    """Return the short drives for which the best force is sought, with an `idle` force (N)."""
    sweep = {'sweep.first_frequency': 4.0, 'sweep.last_frequency': 40.0, 'sweep.rate': 10.0}
    return {
        'idle, class A': _road(_ROUGH, _BOUND_SECONDS, idle),
        'class A': _road(_ROUGH, _BOUND_SECONDS),
        'gap of 20 mm': _road(2e-6, _BOUND_SECONDS)
        | {'motorway.gap_depth': _SHOWN_DEPTH, 'motorway.gap_time': 1.0},
        'sweep, 4 to 40 Hz in 3.6 s': sweep_parameters(0.06, 40.0) | sweep,
        **{
            f'engine {frequency:g} Hz, class A': _road(_ROUGH, _BOUND_SECONDS, 0.5 * idle)
            | {'idle.frequency': frequency}
            for frequency in (45.0, 90.0)
        },
    }


def _road(roughness: float, duration: float, idle: float = 0.0, seed: int = _HELD_OUT_SEED) -> Values:
    return {
        'scenario': 'motorway',
        'seed': seed,
        'timeline.duration': duration,
        'motorway.roughness': roughness,
        'motorway.speed': SPEED,
        'motorway.gap_depth': 0.0,
        'idle.amplitude': idle,
    }


def _gap(depth: float, roughness: float, seed: int) -> Values:
    gap = {'motorway.gap_depth': depth, 'motorway.gap_time': GAP_TIME}
    return _road(roughness, _GAP_SECONDS, seed=seed) | gap


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


def with_displacement(figures: Callable[..., Values], truth: Truth, sim: SimParameters) -> Values:
    """Return figures and the displacement (m) too, for a picture."""
    return {**figures(truth, sim), 'displacement': truth.displacement}


def of_gap(truth: Truth, sim: SimParameters) -> Values:
    """Return largest displacement and first extremum (m) over a gap, and the largest friction (N)."""
    behind = truth.displacement[round(sim.motorway.gap_time / SAMPLE_TIME) :]
    return {
        'peak_m': float(np.max(np.abs(behind))),
        'first_m': first_extremum(behind),
        'force_n': float(np.max(np.abs(truth.friction_force))),
    }


def of_rest(truth: Truth, sim: SimParameters) -> Values:
    """Return the largest displacement (m) and friction (N) in the last second, when nothing excites."""
    last = slice(-round(1.0 / SAMPLE_TIME), None)
    return {
        'peak_m': float(np.max(np.abs(truth.displacement[last]))),
        'force_n': float(np.max(np.abs(truth.friction_force[last]))),
    }


def of_high_bands(truth: Truth, sim: SimParameters) -> Values:
    """Return the rms of the chassis acceleration (m/s^2) in `HIGH_BANDS` by what was changed in the plant.

    The plant alone goes the way of the drive again, so that it can be seen at each of its steps.
    """
    held = np.full(len(truth.time), _HELD)
    stepped = {
        STEPPED: at_each_step(truth.current_setpoint, sim),
        STRAIGHT: at_each_step(truth.current_setpoint, sim, straight=True),
        f'current held at {_HELD:g} A': at_each_step(held, sim),
    }
    rate = 1.0 / STEP_TIME
    found = {SAMPLED: rms_in_bands(faded(truth.chassis_acceleration), HIGH_BANDS[:4])}
    for name, each in stepped.items():
        found[name] = rms_in_bands(faded(each['chassis_acceleration'], rate), HIGH_BANDS, rate)
    found[FORCE] = rms_in_bands(faded(stepped[STEPPED]['mount_force'], rate), HIGH_BANDS, rate)
    return found


def of_rack(truth: Truth, sim: SimParameters) -> Values:
    """Return the harmonics of the mount force (N) and their distortion (%)."""
    frequency = sim.bench.frequency
    part, _ = whole_periods(truth.time, frequency, _PERIODS)
    found = harmonics(truth.time[part], truth.mount_force[part], frequency)
    return {'harmonics_n': found.tolist(), 'thd': 100.0 * distortion(found)}


def of_road(truth: Truth, sim: SimParameters) -> Values:
    """Return what is felt, and the largest displacement (m)."""
    part = slice(round(_SETTLING / SAMPLE_TIME), None)
    displacement, acceleration = truth.displacement[part], truth.chassis_acceleration[part]
    return felt({name: values[part] for name, values in vars(truth).items()}, sim) | {
        'acceleration': rms_in_bands(acceleration - acceleration.mean(), [bound.ACOUSTIC])[0],
        'peak_m': float(np.abs(displacement).max()),
        'rms_m': rms_in_bands(displacement, [BELOW_ISOLATION])[0],
    }
