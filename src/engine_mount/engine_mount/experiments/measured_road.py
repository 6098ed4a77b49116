"""A measured road under the whole vehicle: each policy, the hydromount and no current, at several speeds."""

from collections.abc import Sequence
from pathlib import Path
from typing import Annotated, Any, NamedTuple

import numpy as np

from engine_mount.drives.loop.run import run_core_into
from engine_mount.experiments.harness.closed_loop import settings_of_run
from engine_mount.experiments.harness.contract import (
    Experiment,
    ExperimentError,
    Order,
    Outcome,
    Progress,
    Statement,
    Values,
    holds_if_lower,
    numbers_of,
    parameters_of,
    write_page,
)
from engine_mount.experiments.harness.many_runs import Found, Job, TruthOnly, run_all
from engine_mount.experiments.harness.measures import rms_in_bands
from engine_mount.experiments.registry import NAMES
from engine_mount.signals.roads.driving import CONTACT_LENGTH, FASTEST, SLOWEST, speed_of, wheel_height
from engine_mount.signals.roads.iso8608 import RoadProfile, unevenness
from engine_mount.signals.roads.table import road_profile
from mount_control.policy.registry import POLICIES
from mount_models.quantity import Quantity
from mount_models.sampling import SAMPLE_TIME

BANDS = ((0.9, 5.0), (5.0, 12.0), (12.0, 30.0), (30.0, 100.0))
"""Hz, chosen: the car's body, the engine on its mounts, above, and what is heard as rumbling."""
_FIELDS = ('displacement', 'velocity', 'friction_force', 'chassis_acceleration')
_SETTLING = 1.0  # s: a road fades in for so long


def run_road_job(job: Job) -> tuple[tuple[Any, ...], Values]:
    """Drive through the same closed loop as every drive in core; return key and figures."""
    truth = TruthOnly(_FIELDS)
    outcome = run_core_into(truth, job.parameters)
    signals = dict(zip(_FIELDS, truth.signals(outcome.excitation_start), strict=True))
    moved = {name: values[round(_SETTLING / SAMPLE_TIME) :] for name, values in signals.items()}
    acceleration = moved['chassis_acceleration'] - moved['chassis_acceleration'].mean()
    return job.key, {
        'seconds': moved['displacement'].size * SAMPLE_TIME,
        'displacement_rms_m': float(np.sqrt(np.mean(moved['displacement'] ** 2))),
        'displacement_peak_m': float(np.abs(moved['displacement']).max()),
        'acceleration_band_rms_m_s2': rms_in_bands(acceleration, BANDS),
        'friction_power_w': float(np.mean(np.abs(moved['friction_force'] * moved['velocity']))),
    }


NAME = 'measured_road'
HYDRO, OFF = 'hydromount', 'no current'
COMPARED = (*POLICIES, OFF, HYDRO)
_ENGINE = 1  # of `BANDS`


class MeasuredRoadParameters(NamedTuple):
    """Where the road stands, as in `engine-mount drive --road`, and how fast it is driven."""

    road: str = ''
    column: str = ''
    distance: str = ''
    lateral: Annotated[float, Quantity('m', 'track of an OpenCRG file', -50.0, 50.0)] = 0.0
    contact_length: Annotated[
        float, Quantity('m', 'on so much of the road the tyre stands', 0.0, 0.5, 'chosen')
    ] = CONTACT_LENGTH
    speeds: str = '30, 60, 120'
    repeat: Annotated[int, Quantity('1', '1: forth and back for 15 s, for a short road', 0, 1)] = 0
    workers: Annotated[int, Quantity('1', 'processes; 0: one for each core', 0, 256)] = 0


def run(order: Order, progress: Progress) -> Outcome:
    """Drive every mount over the road at every speed, and write a page from the numbers."""
    from engine_mount.reports.road_picture import draw_road

    parameters = parameters_of(order, NAME, MeasuredRoadParameters())
    if not parameters.road:
        raise ExperimentError(
            f'{NAME} needs a measured road, height over distance (CSV or OpenCRG): give --set '
            f'{NAME}.road=FILE'
        )
    speeds = numbers_of(f'{NAME}.speeds', parameters.speeds, 3.6 * SLOWEST, 3.6 * FASTEST)
    profile = road_profile(
        parameters.road,
        lateral=parameters.lateral,
        column=parameters.column,
        distance=parameters.distance,
    )
    jobs = _jobs(order, parameters, profile, speeds)
    found = run_all(
        jobs,
        parameters.workers,
        lambda done: progress(0.95 * done / len(jobs), f'{done} of {len(jobs)} drives'),
        run_road_job,
    )
    figures = _figures(profile, parameters, speeds, found)
    picture = order.out / 'measured_road.png'
    draw_road(profile, unevenness(profile), picture)
    page = write_measured_road(figures, [picture], order.out / f'{NAME}.md')
    return Outcome(figures, [picture], [], statements(figures), [page])


def _jobs(
    order: Order, parameters: MeasuredRoadParameters, profile: RoadProfile, speeds: list[float]
) -> list[Job]:
    jobs = []
    for speed in speeds:
        folder = order.out / f'{speed:g}_km_h'
        over = wheel_height(
            profile,
            speed_of(f'{speed:g}/3.6'),
            contact_length=0.0 if profile.effective else parameters.contact_length,
            repeat=bool(parameters.repeat),
        )
        road = {'road.file': str(over.write(folder).absolute())}
        for who in COMPARED:
            own = {
                'mount_sim': {'scenario': 'road', 'mount': _mount(who), **road},
                'mount_control': {'policy': who} if who in POLICIES else {},
            }
            jobs.append(Job((speed, who), settings_of_run(order, own, NAME)))
    return jobs


def _mount(who: str) -> str:
    return {OFF: 'friction_off', HYDRO: 'hydro'}.get(who, 'friction')


def _figures(
    profile: RoadProfile,
    parameters: MeasuredRoadParameters,
    speeds: list[float],
    found: Found,
) -> Values:
    road = unevenness(profile)
    return {
        'source': Path(parameters.road).name,
        'lateral_m': parameters.lateral,
        'sha256': profile.provenance.sha256,
        'length_m': profile.length,
        'spacing_m': profile.spacing,
        'contact_length_m': 0.0 if profile.effective else parameters.contact_length,
        'road': list(road.sentences()),
        'bands_hz': [list(band) for band in BANDS],
        'runs': {f'{speed:g}': {who: found[speed, who] for who in COMPARED} for speed in speeds},
    }


def statements(figures: Values) -> list[Statement]:
    """Return what the paper says of friction mount and hydromount, each with what came out here."""
    return [
        _statement(
            figures,
            'Lower displacements when damping is on.',
            'rms displacement',
            lambda run: run['displacement_rms_m'],
        ),
        _statement(
            figures,
            'On the chassis the mount is at least as good as the hydromount.',
            f'rms acceleration of the chassis from {BANDS[-1][0]:g} to {BANDS[-1][1]:g} Hz',
            lambda run: run['acceleration_band_rms_m_s2'][-1],
        ),
    ]


def _statement(figures: Values, paper: str, what: str, value: Any) -> Statement:
    ratios = {
        f'{who} at {speed} km/h': value(runs[who]) / value(runs[HYDRO])
        for speed, runs in figures['runs'].items()
        for who in POLICIES
    }
    told = ', '.join(f'{name} {ratio:.2f}' for name, ratio in ratios.items())
    return Statement(
        'Sec. 7',
        paper,
        f'{what}, over that of the hydromount: {told}',
        holds_if_lower(list(ratios.values())),
    )


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


def write_measured_road(figures: Values, pictures: Sequence[Path], file: Path) -> Path:
    """Write the page to `file` and return it; its pictures are expected in `figures/`."""
    parts = [_HEAD, _road(figures), f'![The road](figures/{pictures[0].name})\n']
    parts += [_table(speed, runs, figures['bands_hz']) for speed, runs in figures['runs'].items()]
    parts += [_in_words(figures), _LIMITS.format(contact=figures['contact_length_m'])]
    return write_page(parts, file)


def _road(figures: Values) -> str:
    told = '. '.join(sentence[0].upper() + sentence[1:] for sentence in figures['road'])
    command = f'engine-mount experiment measured_road --set measured_road.road={figures["source"]}'
    lateral = f' --set measured_road.lateral={figures["lateral_m"]:g}' if figures['lateral_m'] else ''
    return (
        f'`{command}{lateral}`\n\nDriven: `{figures["source"]}`, {figures["length_m"]:.0f} m, a height every '
        f'{1e3 * figures["spacing_m"]:.3g} mm. {told}.\n'
    )


def _table(speed: str, runs: Values, bands: list[list[float]]) -> str:
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


def _in_words(figures: Values) -> str:
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


def _least(runs: Values, value: Any) -> str:
    """Return who has the least, and by how much less than the next."""
    first, second = sorted(runs, key=lambda who: value(runs[who]))[:2]
    share = 100.0 * (1.0 - value(runs[first]) / value(runs[second])) if value(runs[second]) else 0.0
    if share < _CLEAR:
        return f'nobody clearly (within {_CLEAR:g} %)'
    return f'{first} ({share:.0f} % less than {second})'


EXPERIMENT = Experiment(
    NAME,
    *NAMES[NAME],
    (
        'A measured road, height over distance, is driven by the whole vehicle at several speeds with each '
        'policy, with the original hydromount and with the friction mount without current.'
    ),
    MeasuredRoadParameters(),
    run,
    closed_loop=True,
    needs='road',
)
