"""A road under a wheel over time: what the simulator reads, made from a profile and a speed.

The vehicle model stands on one wheel, so there is one track and no second axle. The profile goes without its
long waves, averaged over the length on which a tyre stands, and is faded in as the simulated roads are.
"""

import math
import re
from dataclasses import dataclass
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from engine_mount.signals.even_grid import EvenSignal
from engine_mount.signals.importing.provenance import told_provenance
from engine_mount.signals.mapping import Mapping
from engine_mount.signals.quantities import Quantity, by_name
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
from engine_mount.signals.selection import name_of, select_rows
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
_LONGEST_GAP = 1.0  # s, chosen: a car's speed between two values so far apart is near the line through them
_NUMBER = re.compile(r'([\d.]+)(?:/([\d.]+))?\s*(m/s|km/h|kmh|kph|mph)?')
_SPEED = by_name(
    Quantity(
        'speed', 'velocity', 'speed of the vehicle', SLOWEST, FASTEST,
        ('v', 'velocity', 'vehicle_speed', 'geschwindigkeit'), by_size=True,
    )
)  # fmt: skip
_ENGINE = 20.0  # Hz: below, the engine moves on its mounts; a road that does not reach it is none for them
_KEPT = 0.4  # of the rate of the places, as `resampled` keeps
_SHORTEST = 1.0  # s, chosen: eight periods of the engine on its mounts
_USUAL = 15.0  # s: of a repeated road, as of the other scenarios
_RAMP_IN = RandomRoad().ramp_in  # s: as the simulated roads


class Speed(NamedTuple):
    """Speeds (n,) in m/s at times (n,) in s, straight between them; a constant one has a single value."""

    times: FloatArray
    values: FloatArray
    told: str

    @property
    def mean(self) -> float:
        """Mean over the time, m/s."""
        if self.values.size == 1:
            return float(self.values[0])
        return float(np.trapezoid(self.values, self.times) / (self.times[-1] - self.times[0]))

    def notes(self) -> tuple[str, ...]:
        """Return what is to be doubted about it."""
        top = float(self.values.max())
        if top <= _DOUBTED:
            return ()
        return (
            f'{top:g} m/s are {3.6 * top:.0f} km/h; if {top:g} km/h are meant, write --speed {top:g}/3.6',
        )

    def places(self, step: float, seconds: float) -> FloatArray:
        """Return where the car is (n,), m, every `step` s for so many `seconds`."""
        times = step * np.arange(int(seconds / step) + 1)
        values = np.interp(times, self.times, self.values)
        return np.concatenate([[0.0], np.cumsum(0.5 * step * (values[1:] + values[:-1]))])


def speed_of(text: str) -> Speed:
    """Return the speed that `text` tells: m/s as in 60/3.6, with a unit as in 60km/h, or a file over time.

    Raises `SignalError` or `SourceError`.
    """
    match = _NUMBER.fullmatch(text.strip())
    if match is None:
        return recorded_speed(text)
    number = float(match[1]) / float(match[2] or 1.0) * unit_of(match[3] or 'm/s').factor
    if not SLOWEST <= number <= FASTEST:
        guess = f'; is it in km/h? Write {text}/3.6' if SLOWEST <= number / 3.6 <= FASTEST else ''
        raise SignalError(
            f'--speed {text} is {number:g} m/s; it must lie within {SLOWEST:g} .. {FASTEST:g} m/s{guess}'
        )
    return Speed(np.zeros(1), np.array([number]), f'{number:.4g} m/s ({3.6 * number:.4g} km/h)')


def recorded_speed(file: str | Path) -> Speed:
    """Return the speed over time in a file of any format; raises `SignalError` or `SourceError`."""
    option = 'the title of its column as {column} [{unit}]'
    rows = select_rows(file, Mapping(option=option), _SPEED, _SPEED, timed=True, slowest=0.1)
    times, values, name = rows['time'], rows['speed'], name_of(str(file))
    steps = np.diff(times)
    bad = np.flatnonzero((steps <= 0.0) | (steps > _LONGEST_GAP))
    if bad.size or values.min() < 0.0:
        place = int(bad[0]) if bad.size else int(values.argmin())
        raise SignalError(
            f'{name}: behind {times[place]:g} s ({values[place]:g} m/s) times must rise by '
            f'{_LONGEST_GAP:g} s at most, and speeds be 0 m/s or more'
        )
    return Speed(times, values, f'{values.min():.3g} .. {values.max():.3g} m/s as in {name}')


@dataclass(frozen=True, eq=False)
class WheelHeight:
    """Heights (n,) in m under the wheel every `STEP_TIME`, and what is to be told of them.

    `told` is plain data for the session: where the road came from, its class, the speed. `notes` are
    sentences.
    """

    height: FloatArray
    told: dict[str, object]
    notes: tuple[str, ...]

    def write(self, folder: Path) -> Path:
        """Write `road_value.npy` with its times beside it, which the simulator reads; return its path."""
        folder.mkdir(parents=True, exist_ok=True)
        np.save(folder / 'road_t.npy', STEP_TIME * np.arange(self.height.size))
        np.save(folder / 'road_value.npy', self.height)
        return folder / 'road_value.npy'


def wheel_height(
    profile: RoadProfile,
    speed: Speed,
    *,
    contact_length: float | None = None,
    duration: float = 0.0,
    repeat: bool = False,
) -> WheelHeight:
    """Return the road under a wheel that rolls over it at `speed`; raises `SignalError`.

    `contact_length` (m): of the tyre, by default `CONTACT_LENGTH`, none of a road that is effective already.
    `duration` (s): no more than that; `repeat` drives the road forth and back until then.
    """
    contact = (0.0 if profile.effective else CONTACT_LENGTH) if contact_length is None else contact_length
    notes = [*profile.notes, *speed.notes()]
    reached = kept_frequency(profile, speed)
    if reached < _ENGINE:
        raise SignalError(
            f'{profile.name}: places {profile.spacing:g} m apart at {speed.mean:.3g} m/s hold {reached:.2g} '
            f'Hz; at least {_ENGINE:g} Hz are needed, that is {_KEPT * speed.mean / _ENGINE:.2g} m or finer'
        )
    if reached < BAND[1]:
        notes.append(
            f'{profile.spacing:g} m apart: the road holds no more than {reached:.3g} Hz at this speed'
        )
    height = without_long_waves(profile.height, profile.spacing)
    notes.append(f'the line through the heights and waves longer than {LONGEST_WAVE:g} m are taken out')
    if contact > 0.0:
        notes.append(f'averaged over {contact:g} m on which the tyre stands')
    seconds = float(speed.times[-1]) or duration or (_USUAL if repeat else np.inf)
    if repeat:
        once = np.concatenate([height, height[-2:0:-1]])
        height = np.resize(once, int(speed.mean * seconds / profile.spacing) + 2)
    seconds = min(seconds, duration or np.inf)
    series = _over_time(height, profile.spacing, speed, contact, seconds)
    if series.size * STEP_TIME < _SHORTEST:
        raise SignalError(
            f'{profile.name}: {profile.length:g} m at {speed.mean:.3g} m/s last '
            f'{series.size * STEP_TIME:.2g} s; at least {_SHORTEST:g} s are needed: drive slower, or forth '
            'and back with --repeat'
        )
    found = unevenness(profile)
    told: dict[str, object] = {
        **told_provenance(profile.provenance),
        'length_m': round(profile.length, 3),
        'spacing_m': round(profile.spacing, 6),
        'iso_8608': f'{found.letter}, Gd {1e6 * found.roughness:.3g}e-6 m^3, waviness {found.waviness:.2f}',
        'speed': speed.told,
        'contact_length_m': contact,
        'repeat': repeat,
    }
    fade = np.minimum(STEP_TIME * np.arange(series.size) / _RAMP_IN, 1.0)
    return WheelHeight(series * fade, told, tuple(notes))


def kept_frequency(profile: RoadProfile, speed: Speed) -> float:
    """Return up to which frequency (Hz) a road holds its unevenness at the mean speed."""
    return _KEPT * min(speed.mean / profile.spacing, 1.0 / STEP_TIME)


@dataclass(frozen=True, eq=False)
class Road:
    """A measured road: its profile, what that is by ISO 8608, and a speed at which it is driven."""

    profile: RoadProfile
    unevenness: Unevenness
    speed: Speed | None = None

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
        rows += [
            ('comes again', f'every {period.wavelength:.3g} m, {1e3 * period.amplitude:.2g} mm')
            for period in found.periods
        ]
        if speed is not None:
            lowest, highest = speed.mean / min(profile.length, LONGEST_WAVE), kept_frequency(profile, speed)
            rows.append(
                (
                    f'at {3.6 * speed.mean:.4g} km/h',
                    f'{profile.length / speed.mean:.1f} s; {lowest:.2g} .. {highest:.4g} Hz',
                )
            )
            rows += [
                ('', f'{period.wavelength:.3g} m are met at {speed.mean / period.wavelength:.3g} Hz')
                for period in found.periods
            ]
        return rows

    @property
    def figures(self) -> dict[str, Any]:
        """The figures in SI units as plain data."""
        profile, found = self.profile, self.unevenness
        return {
            'uri': profile.provenance.uri,
            'sha256': profile.provenance.sha256,
            'format': profile.provenance.format,
            'length_m': profile.length,
            'spacing_m': profile.spacing,
            'rms_m': root_mean_square(profile),
            'class': found.letter,
            'roughness_m3': found.roughness,
            'waviness': found.waviness,
            'fitted_cycles_per_m': [found.lowest, found.highest],
            'class_is_a_guess': found.beyond,
            'periods': [period._asdict() for period in found.periods],
            'notes': list(profile.notes),
        }


def road(
    file: str | Path, *, lateral: float = 0.0, column: str = '', distance: str = '', speed: str = ''
) -> Road:
    """Return the road in an OpenCRG file or a table of height over distance, path or URI.

    `lateral` (m, left of the reference line) chooses the track of an OpenCRG file; `column` and `distance`
    are `NAME[:UNIT]`, the distance may be that between two heights (m). `speed`: see `speed_of`. Raises
    `SignalError` or `SourceError`.
    """
    spacing = float(distance) if re.fullmatch(r'[\d.]+(e-?\d+)?', distance) else math.nan
    named = '' if math.isfinite(spacing) else distance
    profile = road_profile(file, lateral=lateral, column=column, distance=named, spacing=spacing)
    return Road(profile, unevenness(profile), speed_of(speed) if speed else None)


def _over_time(
    height: FloatArray, spacing: float, speed: Speed, contact: float, seconds: float
) -> FloatArray:
    """Return the heights every `STEP_TIME`, band-limited to what that step holds."""
    from scipy.interpolate import CubicSpline

    length = spacing * (height.size - 1)
    finer = max(1, int(np.ceil(2.0 * float(speed.values.max()) * STEP_TIME / max(spacing, contact / 4.0))))
    step = STEP_TIME / finer
    if speed.values.size == 1:
        places = speed.mean * step * np.arange(int(min(length / speed.mean, seconds) / step) + 1)
    else:
        places = speed.places(step, seconds)
        places = places[: int(np.searchsorted(places, length, side='right'))]
    curve = CubicSpline(spacing * np.arange(height.size), height)
    if contact > 0.0:
        whole, half = curve.antiderivative(), 0.5 * contact
        low, high = np.clip(places - half, 0.0, length), np.clip(places + half, 0.0, length)
        values = (whole(high) - whole(low)) / (high - low)
    else:
        values = curve(places)
    if finer == 1:
        return np.asarray(values, np.float64)
    return resampled(EvenSignal('the road', step, np.asarray(values, np.float64), 0), STEP_TIME)[:]
