"""A road under a wheel over time: what the simulator reads, made from a profile and a speed.

The vehicle model stands on one wheel, so there is one track and no second axle. The profile goes without its
long waves, averaged over the length on which a tyre stands, and is faded in as the simulated roads are.
"""

import re
from pathlib import Path
from typing import NamedTuple

import numpy as np

from engine_mount.signals.even_grid import EvenSignal
from engine_mount.signals.resampling import resampled
from engine_mount.signals.roads.iso8608 import (
    LONGEST_WAVE,
    RoadProfile,
    Unevenness,
    root_mean_square,
    unevenness,
    without_long_waves,
)
from engine_mount.signals.roads.table import road_profile
from engine_mount.signals.signal import FloatArray, SignalError
from engine_mount.signals.units import unit_of
from mount_sim.excitation.road import RandomRoad

CONTACT_LENGTH = 0.1
"""m, chosen: on so much of the road a tyre of a passenger car stands."""
STEP_TIME = 1e-3  # s, chosen: frequencies up to 400 Hz are kept
BAND = (0.9, 50.0)
"""Hz: what is to be held of a road, from below the body's frequency to the end of the paper's sweep."""
SLOWEST, FASTEST = 0.5, 90.0
"""m/s, chosen: below, no wave within the body's and the engine's range is met; above, km/h are meant."""
_DOUBTED = 45.0  # m/s, chosen: above 162 km/h a number in km/h is as likely
_NUMBER = re.compile(r'([\d.]+)(?:/([\d.]+))?\s*(m/s|km/h|kmh|kph|mph)?')
_ENGINE = 20.0  # Hz: below, the engine moves on its mounts; a road that does not reach it is none for them
_KEPT = 0.4  # of the rate of the places, as `resampled` keeps
_SHORTEST = 1.0  # s, chosen: eight periods of the engine on its mounts
_USUAL = 15.0  # s: of a repeated road, as of the other scenarios
_RAMP_IN = RandomRoad().ramp_in  # s: as the simulated roads


def speed_of(text: str) -> float:
    """Return the speed (m/s) in `text`, as in 60/3.6, or with a unit as in 60km/h; raises `SignalError`."""
    match = _NUMBER.fullmatch(text.strip())
    if match is None:
        raise SignalError(f'--speed {text} is no speed; write it in m/s, as in 60/3.6, or as in 60km/h')
    speed = float(match[1]) / float(match[2] or 1.0) * unit_of(match[3] or 'm/s').factor
    if not SLOWEST <= speed <= FASTEST:
        guess = f'; is it in km/h? Write {text}/3.6' if SLOWEST <= speed / 3.6 <= FASTEST else ''
        raise SignalError(
            f'--speed {text} is {speed:g} m/s; it must lie within {SLOWEST:g} .. {FASTEST:g} m/s{guess}'
        )
    return speed


def doubts_of_speed(speed: float) -> list[str]:
    """Return what is to be doubted about a speed in m/s."""
    if speed <= _DOUBTED:
        return []
    return [
        f'{speed:g} m/s are {3.6 * speed:.0f} km/h; if {speed:g} km/h are meant, write --speed {speed:g}/3.6'
    ]


class WheelHeight(NamedTuple):
    """Heights (n,) in m under the wheel every `STEP_TIME`, and what is to be told of them.

    `told` is plain data for the session: where the road came from, its class, the speed. `notes` are
    sentences.
    """

    height: FloatArray
    told: dict[str, object]
    notes: tuple[str, ...]


def wheel_height(
    profile: RoadProfile,
    speed: float,
    *,
    contact_length: float | None = None,
    duration: float = 0.0,
    repeat: bool = False,
) -> WheelHeight:
    """Return the road under a wheel that rolls over it at `speed` (m/s); raises `SignalError`.

    `contact_length` (m): of the tyre, by default `CONTACT_LENGTH`, none of a road that is effective already.
    `duration` (s): no more than that; `repeat` drives the road forth and back until then.
    """
    contact = (0.0 if profile.effective else CONTACT_LENGTH) if contact_length is None else contact_length
    notes = [*profile.notes, *doubts_of_speed(speed)]
    reached = kept_frequency(profile, speed)
    if reached < _ENGINE:
        raise SignalError(
            f'{profile.name}: places {profile.spacing:g} m apart at {speed:.3g} m/s hold {reached:.2g} '
            f'Hz; at least {_ENGINE:g} Hz are needed, that is {_KEPT * speed / _ENGINE:.2g} m or finer'
        )
    if reached < BAND[1]:
        notes.append(
            f'{profile.spacing:g} m apart: the road holds no more than {reached:.3g} Hz at this speed'
        )
    height = without_long_waves(profile.height, profile.spacing)
    notes.append(f'the line through the heights and waves longer than {LONGEST_WAVE:g} m are taken out')
    if contact > 0.0:
        notes.append(f'averaged over {contact:g} m on which the tyre stands')
    seconds = duration or (_USUAL if repeat else np.inf)
    if repeat:
        once = np.concatenate([height, height[-2:0:-1]])
        height = np.resize(once, int(speed * seconds / profile.spacing) + 2)
    series = _over_time(height, profile.spacing, speed, contact, seconds)
    if series.size * STEP_TIME < _SHORTEST:
        raise SignalError(
            f'{profile.name}: {profile.length:g} m at {speed:.3g} m/s last '
            f'{series.size * STEP_TIME:.2g} s; at least {_SHORTEST:g} s are needed: drive slower, or forth '
            'and back with --repeat'
        )
    found = unevenness(profile)
    told: dict[str, object] = {
        **profile.provenance.for_session(),
        'length_m': round(profile.length, 3),
        'spacing_m': round(profile.spacing, 6),
        'iso_8608': f'{found.letter}, Gd {1e6 * found.roughness:.3g}e-6 m^3, waviness {found.waviness:.2f}',
        'speed': f'{speed:.4g} m/s ({3.6 * speed:.4g} km/h)',
        'contact_length_m': contact,
        'repeat': repeat,
    }
    fade = np.minimum(STEP_TIME * np.arange(series.size) / _RAMP_IN, 1.0)
    return WheelHeight(series * fade, told, tuple(notes))


def kept_frequency(profile: RoadProfile, speed: float) -> float:
    """Return up to which frequency (Hz) a road holds its unevenness at a speed (m/s)."""
    return _KEPT * min(speed / profile.spacing, 1.0 / STEP_TIME)


class Road(NamedTuple):
    """A measured road: its profile, what that is by ISO 8608, and a speed (m/s) at which it is driven."""

    profile: RoadProfile
    unevenness: Unevenness
    speed: float | None = None

    def rows(self) -> list[tuple[str, str]]:
        """Return name and text of each figure, and at the speed which frequencies the road holds."""
        profile, found, speed = self.profile, self.unevenness, self.speed
        short = without_long_waves(profile.height, profile.spacing)
        rows = [
            ('format', profile.provenance.format),
            ('length', f'{profile.length:.1f} m, a height every {1e3 * profile.spacing:.4g} mm'),
            ('heights', f'{np.ptp(profile.height):.3g} m from the lowest to the highest'),
            (
                f'up to {LONGEST_WAVE:g} m',
                f'{1e3 * root_mean_square(profile):.3g} mm rms, {1e3 * np.ptp(short):.3g} mm in all',
            ),
            ('ISO 8608', f'class {found.letter}{" (a guess)" if found.beyond else ""}'),
            ('Gd(0.1 cycles/m)', f'{1e6 * found.roughness:.3g}e-6 m^3'),
            ('waviness', f'{found.waviness:.2f}'),
        ]
        if speed is not None:
            lowest, highest = speed / min(profile.length, LONGEST_WAVE), kept_frequency(profile, speed)
            figures = f'{profile.length / speed:.1f} s; {lowest:.2g} .. {highest:.4g} Hz'
            rows.append((f'at {3.6 * speed:.4g} km/h', figures))
        return rows


def road(
    file: str | Path, *, lateral: float = 0.0, column: str = '', distance: str = '', speed: str = ''
) -> Road:
    """Return the road in an OpenCRG file or a table of height over distance, path or URI.

    `lateral`, `column` and `distance` as of `road_profile`, `speed` as of `speed_of`. Raises `SignalError`
    or `SourceError`.
    """
    profile = road_profile(file, lateral=lateral, column=column, distance=distance)
    return Road(profile, unevenness(profile), speed_of(speed) if speed else None)


def _over_time(
    height: FloatArray, spacing: float, speed: float, contact: float, seconds: float
) -> FloatArray:
    """Return the heights every `STEP_TIME`, band-limited to what that step holds."""
    from scipy.interpolate import CubicSpline

    length = spacing * (height.size - 1)
    finer = max(1, int(np.ceil(2.0 * speed * STEP_TIME / max(spacing, contact / 4.0))))
    step = STEP_TIME / finer
    places = speed * step * np.arange(int(min(length / speed, seconds) / step) + 1)
    curve = CubicSpline(spacing * np.arange(height.size), height)
    if contact > 0.0:
        whole, half = curve.antiderivative(), 0.5 * contact
        low, high = np.clip(places - half, 0.0, length), np.clip(places + half, 0.0, length)
        values = (whole(high) - whole(low)) / (high - low)
    else:
        values = curve(places)
    values = np.asarray(values, np.float64)
    return values if finer == 1 else resampled(EvenSignal('the road', step, values, 0), STEP_TIME)[:]
