"""A road under a wheel over time: what the simulator reads, made from a profile and a speed.

The vehicle model stands on one wheel, so there is one track and no second axle. The profile goes without its
long waves, averaged over the length on which a tyre stands, and is faded in as the simulated roads are.
"""

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from engine_mount.signals.even_grid import EvenSignal
from engine_mount.signals.importing.provenance import told_provenance
from engine_mount.signals.resampling import resampled
from engine_mount.signals.roads.iso8608 import unevenness
from engine_mount.signals.roads.long_waves import LONGEST_WAVE, without_long_waves
from engine_mount.signals.roads.profile import FloatArray, ProfileError, RoadProfile
from engine_mount.signals.roads.speed import Speed
from mount_sim.excitation.road import RandomRoad

CONTACT_LENGTH = 0.1
"""m, chosen: on so much of the road a tyre of a passenger car stands."""
STEP_TIME = 1e-3  # s, chosen: frequencies up to 400 Hz are kept
BAND = (0.9, 50.0)
"""Hz: what is to be held of a road, from below the body's frequency to the end of the paper's sweep."""
_ENGINE = 20.0  # Hz: below, the engine moves on its mounts; a road that does not reach it is none for them
_KEPT = 0.4  # of the rate of the places, as `resampled` keeps
_SHORTEST = 1.0  # s, chosen: eight periods of the engine on its mounts
_USUAL = 15.0  # s: of a repeated road, as of the other scenarios
_RAMP_IN = RandomRoad().ramp_in  # s: as the simulated roads


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
    """Return the road under a wheel that rolls over it at `speed`; raises `ProfileError`.

    `contact_length` (m): of the tyre, by default `CONTACT_LENGTH`, none of a road that is effective already.
    `duration` (s): no more than that; `repeat` drives the road forth and back until then.
    """
    contact = (0.0 if profile.effective else CONTACT_LENGTH) if contact_length is None else contact_length
    notes = [*profile.notes, *speed.notes()]
    reached = kept_frequency(profile, speed)
    if reached < _ENGINE:
        raise ProfileError(
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
    if repeat:
        height = _repeated(height, _needed(speed, duration or _USUAL), profile.spacing)
    series = _over_time(height, profile.spacing, speed, contact, duration)
    if series.size * STEP_TIME < _SHORTEST:
        raise ProfileError(
            f'{profile.name}: {profile.length:g} m at {speed.mean:.3g} m/s last '
            f'{series.size * STEP_TIME:.2g} s; at least {_SHORTEST:g} s are needed: drive slower, or forth '
            'and back with --repeat'
        )
    told = _told(profile, speed, contact, repeat=repeat)
    return WheelHeight(
        series * np.minimum(STEP_TIME * np.arange(series.size) / _RAMP_IN, 1.0), told, tuple(notes)
    )


def kept_frequency(profile: RoadProfile, speed: Speed) -> float:
    """Return up to which frequency (Hz) a road holds its unevenness at the mean speed."""
    return _KEPT * min(speed.mean / profile.spacing, 1.0 / STEP_TIME)


def _needed(speed: Speed, duration: float) -> float:
    if speed.values.size == 1:
        return speed.mean * duration
    return float(np.trapezoid(speed.values, speed.times))


def _repeated(height: FloatArray, length: float, spacing: float) -> FloatArray:
    """Return heights driven forth and back until `length` (m) is reached."""
    once = np.concatenate([height, height[-2:0:-1]])
    times = int(np.ceil((length / spacing + 2) / once.size))
    return np.tile(once, max(times, 1))[: int(length / spacing) + 2]


def _over_time(
    height: FloatArray, spacing: float, speed: Speed, contact: float, duration: float
) -> FloatArray:
    """Return the heights every `STEP_TIME`, band-limited to what that step holds."""
    from scipy.interpolate import CubicSpline

    length = spacing * (height.size - 1)
    finer = max(1, int(np.ceil(2.0 * float(speed.values.max()) * STEP_TIME / max(spacing, contact / 4.0))))
    step = STEP_TIME / finer
    places = _places(speed, length, step, duration)
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


def _places(speed: Speed, length: float, step: float, duration: float) -> FloatArray:
    """Return where the wheel is (n,), m, every `step` s, to the end of road, speed or `duration`."""
    longest = duration or np.inf
    if speed.values.size == 1:
        seconds = min(length / speed.mean, longest)
        return speed.mean * step * np.arange(int(seconds / step) + 1)
    times = step * np.arange(int(min(speed.times[-1], longest) / step) + 1)
    values = np.interp(times, speed.times, speed.values)
    places = np.concatenate([[0.0], np.cumsum(0.5 * step * (values[1:] + values[:-1]))])
    return places[: int(np.searchsorted(places, length, side='right'))]


def _told(profile: RoadProfile, speed: Speed, contact: float, *, repeat: bool) -> dict[str, object]:
    found = unevenness(profile)
    return {
        **told_provenance(profile.provenance),
        'length_m': round(profile.length, 3),
        'spacing_m': round(profile.spacing, 6),
        'iso_8608': f'{found.letter}, Gd {1e6 * found.roughness:.3g}e-6 m^3, waviness {found.waviness:.2f}',
        'speed': speed.told,
        'contact_length_m': contact,
        'repeat': repeat,
    }
