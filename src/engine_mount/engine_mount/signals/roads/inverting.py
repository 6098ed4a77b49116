"""From a recorded acceleration of the chassis to a road that gives it back, and how well it does."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from engine_mount.signals.even_grid import EvenSignal, evenly_spaced
from engine_mount.signals.excitation import LONGEST_GAP, LOWEST_RATE, acceleration_at
from engine_mount.signals.resampling import resampled
from engine_mount.signals.roads.driving import BAND, STEP_TIME
from engine_mount.signals.roads.inversion import Kept, kept, road_of
from engine_mount.signals.roads.profile import FloatArray, ProfileError
from engine_mount.signals.roads.speed import Speed
from engine_mount.signals.roads.table import EFFECTIVE
from engine_mount.signals.signal import Signal
from mount_sim.excitation.scenario import STEP_TIME as PLANT_STEP
from mount_sim.plant.vehicle import Vehicle, resting_vehicle, ride_without_friction

_SLOWEST = 1.0  # m/s, chosen: slower, many samples fall on one place of the road
_PAUSE = 4.0  # s, chosen: four periods of the body
_DIGITS = 7  # of distance and height in m

UNKNOWN = (
    f'waves below {BAND[0]:g} Hz and above {BAND[1]:g} Hz are not in it',
    'left and right, and the other axle, are one road under one wheel',
    'what engine, gears and brakes did to the chassis within the band is taken for road',
    'the chassis was shaken with the mount that was in that car: its feedback is in the road',
    'vehicle and elastomer are those of the model, not of the recorded car',
)
"""What one recorded acceleration cannot tell, for people."""


@dataclass(frozen=True, eq=False)
class InvertedRoad:
    """Places and heights (n,) in m; what comes of them when they are driven; sentences."""

    distance: FloatArray
    height: FloatArray
    kept: Kept
    notes: tuple[str, ...]

    def write(self, file: Path, source: str) -> Path:
        """Write the profile as CSV, in front what it cannot know; `source` says what it is made of."""
        lines = [f'# road behind {source}, by inverting the vehicle model; effective: behind the tyre']
        lines += [f'# {sentence}' for sentence in (*self.notes, *UNKNOWN)]
        lines.append(f'distance [m],{EFFECTIVE} [m]')
        rows = zip(self.distance, self.height, strict=True)
        lines += [f'{place:.{_DIGITS}f},{height:.{_DIGITS}f}' for place, height in rows]
        file.write_text('\n'.join(lines) + '\n', encoding='utf-8')
        return file


def inverted(signal: Signal, speed: Speed, vehicle: Vehicle | None = None) -> InvertedRoad:
    """Return the road behind an acceleration of the chassis in m/s^2, upwards, recorded at `speed`.

    Raises `ProfileError` or `SignalError`.
    """
    vehicle = vehicle or Vehicle()
    even = evenly_spaced(signal, LONGEST_GAP, LOWEST_RATE)
    acceleration = acceleration_at(even, STEP_TIME)[:]
    # the road is as if repeated for ever: a pause keeps its end from its beginning
    pause = np.zeros(round(_PAUSE / STEP_TIME))
    height = road_of(np.concatenate([acceleration, pause]), STEP_TIME, vehicle)
    places = _places(speed, acceleration.size)
    again = _driven(height, vehicle)[: acceleration.size]
    result = kept(acceleration, again, STEP_TIME)
    notes = [*even.notes, *speed.notes()]
    reached = 0.4 * even.rate
    if reached < BAND[1]:
        notes.append(f'recorded at {even.rate:.4g} Hz: above {reached:.3g} Hz nothing is known')
    notes.append(
        f'driven without friction it gives the acceleration back within {100.0 * result.error:.2g} % rms '
        f'from {BAND[0]:g} to {BAND[1]:g} Hz, where {100.0 * result.share:.3g} % of its rms lie'
    )
    return InvertedRoad(places, height[: acceleration.size], result, tuple(notes))


def _places(speed: Speed, count: int) -> FloatArray:
    """Return where the car is (n,), m, at each step."""
    times = STEP_TIME * np.arange(count)
    if speed.values.size > 1 and speed.times[-1] < times[-1] - 1.0:
        raise ProfileError(
            f'the speed ends at {speed.times[-1]:g} s, the acceleration at {times[-1]:g} s; both must begin '
            'together and be of one length'
        )
    values = np.interp(times, speed.times, speed.values)
    if values.min() < _SLOWEST:
        place = int(np.argmin(values))
        raise ProfileError(
            f'at {times[place]:g} s the car drives {values[place]:.3g} m/s; at less than {_SLOWEST:g} m/s no '
            'road can be told: cut the recording to where it drives'
        )
    return np.concatenate([[0.0], np.cumsum(0.5 * STEP_TIME * (values[1:] + values[:-1]))])


def _driven(height: FloatArray, vehicle: Vehicle) -> FloatArray:
    """Return the chassis acceleration (n,) on the road, driven twice on end: the first time is transient."""
    twice = EvenSignal('the road', STEP_TIME, np.tile(height, 2), 0)
    road = resampled(twice, PLANT_STEP, count=2 * height.size * round(STEP_TIME / PLANT_STEP))[:]
    _, acceleration = ride_without_friction(vehicle, resting_vehicle(), road, np.zeros_like(road), PLANT_STEP)
    return np.asarray(acceleration[:: round(STEP_TIME / PLANT_STEP)][height.size :])
