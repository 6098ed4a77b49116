"""A measured road under the whole vehicle: each policy, the hydromount and no current, at several speeds."""

from pathlib import Path
from typing import Annotated, Any, NamedTuple

import numpy as np

from engine_mount.experiments.harness.closed_loop import Case, run_cases, settings_of_run
from engine_mount.experiments.harness.experiment import (
    Experiment,
    ExperimentError,
    Findings,
    Order,
    Values,
    Verdict,
    Workers,
    claim,
    holds_if_lower,
    numbers_of,
    table,
)
from engine_mount.experiments.harness.measures import rms, rms_in_bands
from engine_mount.experiments.registry import NAMES
from engine_mount.reports.drive.signals import Truth
from engine_mount.signals.roads.driving import CONTACT_LENGTH, FASTEST, SLOWEST, speed_of, wheel_height
from engine_mount.signals.roads.iso8608 import unevenness
from engine_mount.signals.roads.table import road_profile
from mount_control.policy.registry import POLICIES
from mount_models.quantity import Quantity
from mount_models.sampling import SAMPLE_TIME

NAME = 'measured_road'
BANDS = ((0.9, 5.0), (5.0, 12.0), (12.0, 30.0), (30.0, 100.0))
"""Hz, chosen: the car's body, the engine on its mounts, above, and what is heard as rumbling."""
_BAND_NAMES = [f'{low:g} to {high:g} Hz' for low, high in BANDS]
HYDRO, OFF = 'hydromount', 'no current'
_MOUNTS = {**dict.fromkeys(POLICIES, 'friction'), OFF: 'friction_off', HYDRO: 'hydro'}
_SETTLING = 1.0  # s: a road fades in for so long
_CLEAR = 2.0  # %, chosen: two rms count as even within so much of each other


class MeasuredRoadParameters(NamedTuple):
    """Where the road stands, as in `engine-mount drive --road`, and how fast it is driven."""

    road: str = ''
    column: str = ''
    distance: str = ''
    contact_length: Annotated[
        float, Quantity('m', 'on so much of the road the tyre stands', 0.0, 0.5, 'chosen')
    ] = CONTACT_LENGTH
    speeds: str = '30, 60, 120'
    repeat: Annotated[int, Quantity('1', '1: forth and back for 15 s, for a short road', 0, 1)] = 0
    workers: Workers = 0


def run(order: Order) -> Findings:
    """Drive every mount over the road at every speed."""
    from engine_mount.reports.road_picture import draw_road

    own = order.parameters
    if not own.road:
        raise ExperimentError(
            f'{NAME} needs a measured road, a table of height over distance: give --set {NAME}.road=FILE'
        )
    speeds = numbers_of(order, 'speeds', 3.6 * SLOWEST, 3.6 * FASTEST)
    profile = road_profile(own.road, column=own.column, distance=own.distance)
    contact = 0.0 if profile.effective else own.contact_length
    cases = {}
    for speed in speeds:
        metres_per_second = speed_of(f'{speed:g}/3.6')
        over = wheel_height(profile, metres_per_second, contact_length=contact, repeat=bool(own.repeat))
        height = str(over.write(order.out / f'{speed:g}_km_h').absolute())
        for who, mount in _MOUNTS.items():
            sim = {'scenario': 'road', 'mount': mount, 'road.file': height}
            control = {'policy': who} if who in POLICIES else {}
            cases[speed, who] = Case(settings_of_run(order, sim, control), figures_of)
    found = run_cases(order, cases)
    road = unevenness(profile)
    figures = {
        'source': Path(own.road).name,
        'sha256': profile.provenance.sha256,
        'length_m': profile.length,
        'spacing_m': profile.spacing,
        'contact_length_m': contact,
        'road': list(road.sentences()),
        'bands_hz': [list(band) for band in BANDS],
        'runs': {f'{speed:g}': {who: found[speed, who] for who in _MOUNTS} for speed in speeds},
    }
    picture = order.out / f'{NAME}.png'
    draw_road(profile, road, picture)
    return Findings(figures, {NAME: picture}, pages={f'{NAME}.md': page_of(figures)})


def figures_of(truth: Truth, *_: Any) -> Values:
    """Return rms and largest displacement, rms acceleration in bands and the heat of the pads."""
    part = slice(round(_SETTLING / SAMPLE_TIME), None)
    displacement, acceleration = truth.displacement[part], truth.chassis_acceleration[part]
    return {
        'seconds': displacement.size * SAMPLE_TIME,
        'displacement_rms_m': rms(displacement),
        'displacement_peak_m': float(np.abs(displacement).max()),
        'acceleration_band_rms_m_s2': rms_in_bands(acceleration - acceleration.mean(), BANDS),
        'friction_power_w': float(np.mean(np.abs(truth.friction_force[part] * truth.velocity[part]))),
    }


def _over_hydromount(figures: Values, what: str, value: Any) -> Verdict:
    ratios = {
        f'{who} at {speed} km/h': value(runs[who]) / value(runs[HYDRO])
        for speed, runs in figures['runs'].items()
        for who in POLICIES
    }
    told = ', '.join(f'{name} {ratio:.2f}' for name, ratio in ratios.items())
    return holds_if_lower(list(ratios.values())), f'{what}, over that of the hydromount: {told}'


@claim('Sec. 7', paper='Lower displacements when damping is on.')
def _on_displacement(figures):
    return _over_hydromount(figures, 'rms displacement', lambda run: run['displacement_rms_m'])


@claim('Sec. 7', paper='On the chassis the mount is at least as good as the hydromount.')
def _on_acceleration(figures):
    what = f'rms acceleration of the chassis from {BANDS[-1][0]:g} to {BANDS[-1][1]:g} Hz'
    return _over_hydromount(figures, what, lambda run: run['acceleration_band_rms_m_s2'][-1])


def page_of(figures: Values) -> str:
    """Return the page."""
    road = '. '.join(sentence[0].upper() + sentence[1:] for sentence in figures['road'])
    speeds, words = '', ''
    for speed, runs in figures['runs'].items():
        rows = [
            (
                who,
                f'{1e3 * run["displacement_rms_m"]:.3f}',
                f'{1e3 * run["displacement_peak_m"]:.2f}',
                *(f'{value:.3f}' for value in run['acceleration_band_rms_m_s2']),
                f'{run["friction_power_w"]:.2f}',
            )
            for who, run in runs.items()
        ]
        heads = ('mount', 'rms (mm)', 'largest (mm)', *_BAND_NAMES, 'heat of the pads (W)')
        speeds += f"""## {speed} km/h

{runs[HYDRO]['seconds']:.1f} s. Displacement of the mount, rms and largest; acceleration of the chassis, \
rms in m/s²:

{table(heads, rows)}
"""
        least = [f'rms displacement {_least({who: run["displacement_rms_m"] for who, run in runs.items()})}']
        for place, band in enumerate(_BAND_NAMES):
            rivals = {who: run['acceleration_band_rms_m_s2'][place] for who, run in runs.items()}
            least.append(f'acceleration {band} {_least(rivals)}')
        words += f'- At {speed} km/h the least has: {"; ".join(least)}.\n'
    return f"""# A measured road: policies, hydromount, no current

`engine-mount experiment measured_road` writes this page from its numbers; nobody edits it. The blocks are
those of [drive a measured road](../how-to/drive_a_measured_road.md).

`engine-mount experiment measured_road --set measured_road.road={figures['source']}`

Driven: `{figures['source']}`, {figures['length_m']:.0f} m, a height every {1e3 * figures['spacing_m']:.3g} \
mm. {road}.

![The road](figures/{NAME}.png)

{speeds}## In words

{words}
## Limits of this comparison

- **One wheel.** The vehicle model is a quarter of a car: one track, no axle behind, no roll.
- **The tyre is a spring** that feels the mean of the road over {figures['contact_length_m']:g} m. A real \
tyre rolls over stones
  in a way that no mean tells, most of all at low speed.
- **Vehicle, engine and hydromount are chosen**, magnitudes as in the literature ([results.md](results.md)).
- **No engine vibration is added**, so nothing is said of idle.
- Figures begin 1 s after the road, which fades in.
"""


def _least(values: dict[str, float]) -> str:
    """Return who has the least, and by how much less than the next."""
    first, second = sorted(values, key=values.__getitem__)[:2]
    share = 100.0 * (1.0 - values[first] / values[second]) if values[second] else 0.0
    if share < _CLEAR:
        return f'nobody clearly (within {_CLEAR:g} %)'
    return f'{first} ({share:.0f} % less than {second})'


EXPERIMENT = Experiment(
    NAME,
    *NAMES[NAME],
    """A measured road, height over distance, is driven by the whole vehicle at several speeds with each
    policy, with the original hydromount and with the friction mount without current.""",
    MeasuredRoadParameters(),
    run,
    closed_loop=True,
    needs='road',
)
