"""What the comparison with the hydromount depends on: road level, decoupler, chamber, idling engine."""

from itertools import product
from typing import Any

import numpy as np

from engine_mount.drives.bands import BELOW_ISOLATION, ISOLATION_BANDS
from engine_mount.experiments.harness.closed_loop import PAPER, settings_of_run
from engine_mount.experiments.harness.contract import (
    Experiment,
    Holds,
    Order,
    Outcome,
    Progress,
    Statement,
    parameters_of,
)
from engine_mount.experiments.harness.number_list import numbers_of
from engine_mount.experiments.sensitivity import REFERENCE, TITLE
from engine_mount.experiments.sensitivity.grid import Job, run_all, run_job
from engine_mount.experiments.sensitivity.maps import (
    Axes,
    Maps,
    SensitivityParameters,
    share_won,
)
from engine_mount.experiments.sensitivity.reference import DAMPER as THERE
from engine_mount.experiments.sweep.evaluation import FIRST_FREQUENCY, RATE
from engine_mount.reports.drive.signals import FloatArray
from mount_models.damper import damper_curve
from mount_models.quantity import checked
from mount_sim.plant.hydromount import Hydromount

NAME = 'sensitivity'
_BENCH_FREQUENCY, _BENCH_AMPLITUDE, _BENCH_SECONDS = 8.0, 1e-3, 4.75
_HIGHEST_LEVEL = 1.0  # m/s


def run(order: Order, progress: Progress) -> Outcome:
    """Run all combinations, and write maps and a page from the numbers."""
    from engine_mount.experiments.sensitivity import pictures as drawn
    from engine_mount.experiments.sensitivity.page import in_short, write_results

    parameters = parameters_of(order, NAME, SensitivityParameters())
    damper_curve(parameters.damper)  # refuses an unknown one before anything is run
    axes = axes_of(parameters)
    jobs = _jobs(order, parameters, axes)
    found = run_all(
        jobs,
        parameters.workers,
        lambda done: progress(0.97 * done / len(jobs), f'{done} of {len(jobs)} runs'),
        run_job,
    )
    maps = _maps(axes, found)
    progress(0.97, 'pictures')
    folder = order.out / 'figures'
    pictures = [
        drawn.draw_peaks(maps, folder / 'sensitivity_displacement.png'),
        drawn.draw_acceleration(maps, folder / 'sensitivity_acceleration.png'),
    ]
    page = write_results(maps, parameters, len(jobs), pictures, order.out / 'results.md')
    statements = _statements(maps, in_short(maps))
    return Outcome(_figures(maps, parameters, len(jobs)), pictures, [], statements, [page])


def axes_of(parameters: SensitivityParameters) -> Axes:
    """Return the values of the grid; raises `ParameterError` for a text that is no list of such numbers."""
    axes = Axes(
        numbers_of(f'{NAME}.road_levels', parameters.road_levels, 1e-3, _HIGHEST_LEVEL),
        numbers_of(f'{NAME}.decoupler_resistances', parameters.decoupler_resistances, 0.0, 1e10),
        numbers_of(f'{NAME}.chamber_asymmetries', parameters.chamber_asymmetries, 0.0, 0.9),
        numbers_of(f'{NAME}.idle_forces', parameters.idle_forces, 0.0, 2000.0),
    )
    for resistance, asymmetry in product(axes.resistances, axes.asymmetries):
        checked(Hydromount(decoupler_resistance=resistance, compliance_asymmetry=asymmetry))
    return axes


def _jobs(order: Order, parameters: SensitivityParameters, axes: Axes) -> list[Job]:
    damper, jobs = parameters.damper, []
    for level, idle in product(axes.levels, axes.idle_forces):
        jobs.append(
            _job(order, ('friction', level, idle), _sweep(parameters, 'friction', level, idle), damper)
        )
        for resistance, asymmetry in product(axes.resistances, axes.asymmetries):
            sim = _sweep(parameters, 'hydro', level, idle) | _hydromount(resistance, asymmetry)
            jobs.append(_job(order, ('hydro', level, resistance, asymmetry, idle), sim, damper))
    for level in axes.levels:
        sim = _sweep(parameters, 'friction', level, 0.0)
        jobs.append(_job(order, ('friction as there', level), sim, THERE))
    jobs.append(_job(order, ('friction on the rack',), _bench('friction'), damper))
    for resistance, asymmetry in product(axes.resistances, axes.asymmetries):
        sim = _bench('hydro') | _hydromount(resistance, asymmetry)
        jobs.append(_job(order, ('hydro on the rack', resistance, asymmetry), sim, damper))
    return jobs


def _job(order: Order, key: tuple[Any, ...], sim: dict[str, Any], damper: Any) -> Job:
    own = {'mount_sim': sim, 'mount_control': {'policy': PAPER, 'damper': damper}}
    return Job(key, settings_of_run(order, own, NAME))


def _sweep(parameters: SensitivityParameters, mount: str, level: float, idle: float) -> dict[str, Any]:
    return {
        'scenario': 'sweep',
        'mount': mount,
        'sweep.velocity_amplitude': level,
        'sweep.first_frequency': FIRST_FREQUENCY,
        'sweep.last_frequency': parameters.last_frequency,
        'sweep.rate': RATE,
        'idle.amplitude': idle,
    }


def _bench(mount: str) -> dict[str, Any]:
    return {
        'scenario': 'bench',
        'mount': mount,
        'timeline.duration': _BENCH_SECONDS,
        'bench.frequency': _BENCH_FREQUENCY,
        'bench.amplitude': _BENCH_AMPLITUDE,
    }


def _hydromount(resistance: float, asymmetry: float) -> dict[str, Any]:
    return {
        'hydromount.decoupler_resistance': resistance,
        'hydromount.compliance_asymmetry': asymmetry,
    }


def _maps(axes: Axes, found: dict[tuple[Any, ...], Any]) -> Maps:
    shape = tuple(len(values) for values in axes)
    peak, rms = np.full(shape, np.nan), np.full((len(ISOLATION_BANDS), *shape), np.nan)
    friction_peak = np.full((shape[0], shape[3]), np.nan)
    for place in np.ndindex(shape):
        level, resistance, asymmetry, idle = (values[k] for values, k in zip(axes, place, strict=True))
        ours, theirs = found['friction', level, idle], found['hydro', level, resistance, asymmetry, idle]
        peak[place] = ours['peak_m'] / theirs['peak_m']
        friction_peak[place[0], place[3]] = ours['peak_m']
        for band, (a, b) in enumerate(zip(ours['rms'], theirs['rms'], strict=True)):
            if a is not None and b is not None:
                rms[(band, *place)] = a / b
    friction = np.array(found[('friction on the rack',)]['harmonics_n'])
    hydro = {
        key: found[('hydro on the rack', *key)]['harmonics_n']
        for key in product(axes.resistances, axes.asymmetries)
    }
    below = {key: _orders_below(friction, harmonics) for key, harmonics in hydro.items()}
    there = {level: found['friction as there', level]['peak_m'] for level in axes.levels}
    return Maps(axes, peak, rms, friction_peak, below, hydro, there)


def _orders_below(friction: FloatArray, hydro: list[float]) -> list[int]:
    return [k + 1 for k in range(friction.size) if friction[k] < hydro[k]]


def _figures(maps: Maps, parameters: SensitivityParameters, runs: int) -> dict[str, Any]:
    return {
        'runs': runs,
        'damper': parameters.damper,
        'order_of_axes': list(Axes._fields),
        **maps.axes._asdict(),
        'peak_band_hz': list(BELOW_ISOLATION),
        'peak_ratio': maps.peak.tolist(),
        'friction_peak_m': maps.friction_peak.tolist(),
        'isolation_bands_hz': [list(band) for band in ISOLATION_BANDS],
        'acceleration_ratio': [None if np.isnan(part).any() else part.tolist() for part in maps.rms],
        'lower_harmonics': [
            {'decoupler_resistance': key[0], 'chamber_asymmetry': key[1], 'orders': orders}
            for key, orders in maps.below.items()
        ],
    }


def verdict(share: float) -> Holds:
    """Return whether a claim holds that came out in a `share` of the combinations."""
    if np.isnan(share):
        return Holds.NOT_COMPARABLE
    return Holds.YES if share == 1.0 else Holds.NO if share == 0.0 else Holds.PARTLY


def _statements(maps: Maps, told: dict[str, str]) -> list[Statement]:
    full = [len(orders) == 8 for orders in maps.below.values()]
    return [
        Statement(
            'Fig. 14; Sec. 7',
            'With damping on, the displacement is smaller than with the original mount.',
            told['displacement'],
            verdict(share_won(maps.peak)),
        ),
        Statement(
            'Fig. 14; Sec. 7',
            'With damping off, the acceleration of the chassis is lower than with the original mount.',
            told['acceleration'],
            verdict(share_won(maps.rms)),
        ),
        Statement(
            'Fig. 13; Sec. 7',
            'The force is lower up to the 8th harmonic.',
            told['harmonics'],
            verdict(float(np.mean(full))),
        ),
    ]


EXPERIMENT = Experiment(
    name=NAME,
    title=TITLE,
    reference=REFERENCE,
    summary=(
        'The paper gives neither the road level nor whether the engine ran, and nothing of its hydromount. '
        'So the sweep is run with all combinations of road level, resistance of the decoupler, asymmetry of '
        'the upper chamber and idle force, and the rack with those of the hydromount; every run goes through '
        'the same closed loop as a drive, but is not recorded. *partly* means: in some of the combinations.'
    ),
    defaults=SensitivityParameters(),
    run=run,
)
