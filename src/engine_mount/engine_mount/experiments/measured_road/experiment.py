"""A measured road under the whole vehicle: each policy, the hydromount and no current, at several speeds."""

from pathlib import Path
from typing import Annotated, Any, NamedTuple

from engine_mount.experiments.harness.closed_loop import settings_of_run
from engine_mount.experiments.harness.contract import (
    Experiment,
    ExperimentError,
    Order,
    Outcome,
    Progress,
    Statement,
    parameters_of,
)
from engine_mount.experiments.harness.judgement import holds_if_lower
from engine_mount.experiments.harness.number_list import numbers_of
from engine_mount.experiments.measured_road import REFERENCE, TITLE
from engine_mount.experiments.measured_road.runs import BANDS, RoadJob, run_road_job
from engine_mount.experiments.sensitivity.grid import run_all
from engine_mount.signals.roads.driving import CONTACT_LENGTH, wheel_height
from engine_mount.signals.roads.iso8608 import unevenness
from engine_mount.signals.roads.profile import RoadProfile
from engine_mount.signals.roads.reading import road_profile
from engine_mount.signals.roads.speed import FASTEST, SLOWEST, speed_of
from mount_control.policy.registry import POLICIES
from mount_models.quantity import Quantity

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
    from engine_mount.experiments.measured_road.page import write_measured_road
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
) -> list[RoadJob]:
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
            jobs.append(RoadJob((speed, who), settings_of_run(order, own, NAME)))
    return jobs


def _mount(who: str) -> str:
    return {OFF: 'friction_off', HYDRO: 'hydro'}.get(who, 'friction')


def _figures(
    profile: RoadProfile,
    parameters: MeasuredRoadParameters,
    speeds: list[float],
    found: dict[tuple[Any, ...], Any],
) -> dict[str, Any]:
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


def statements(figures: dict[str, Any]) -> list[Statement]:
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


def _statement(figures: dict[str, Any], paper: str, what: str, value: Any) -> Statement:
    ratios = {
        f'{who} at {speed} km/h': value(runs[who]) / value(runs[HYDRO])
        for speed, runs in figures['runs'].items()
        for who in POLICIES
    }
    told = ', '.join(f'{name} {ratio:.2f}' for name, ratio in ratios.items())
    return Statement(
        REFERENCE,
        paper,
        f'{what}, over that of the hydromount: {told}',
        holds_if_lower(list(ratios.values())),
    )


EXPERIMENT = Experiment(
    name=NAME,
    title=TITLE,
    reference=REFERENCE,
    summary=(
        'A measured road, height over distance, is driven by the whole vehicle at several speeds with each '
        'policy, with the original hydromount and with the friction mount without current.'
    ),
    defaults=MeasuredRoadParameters(),
    run=run,
    closed_loop=True,
    needs='road',
)
