"""A friction recording as identification wants it: checked, in SI units, on an even time grid."""

import math
from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt

FloatArray = npt.NDArray[np.float64]

FEWEST_SAMPLES = 50
LONGEST_GAP_STEPS = 5.0
"""Gaps in time of up to so many sample intervals are bridged by straight lines (chosen)."""
STUCK_SHARE = 0.3
"""A channel that repeats one value for this share of the motion, while the other moves, is stuck (chosen)."""
STROKE_RANGE = (1e-6, 1.0)
FORCE_RANGE = (0.05, 1e7)
COEFFICIENT_RANGE = (0.02, 10.0)
"""Plausible largest |F| / F_N (chosen): a brake lining has 0.2 .. 2.5, a wrapped band more."""
DIRECTION_SPREAD = 0.3
"""Standard deviation of ln(mu_p / mu_n), chosen: of the paper's pads it is -0.43 to -0.58 (Eq 14)."""
_NOISE_SHARE = 0.05  # of the rms speed, chosen: as much velocity noise as smoothing may leave
_LONGEST_WINDOW = 61  # samples


class IdentificationError(ValueError):
    """Recordings do not tell what is asked of them; the text says value, limit and remedy."""


@dataclass(frozen=True)
class FrictionRecording:
    """Displacement x (m), friction force F_F (N), both (n,), and normal force F_N (N, (n, 2)), `dt` s apart.

    The columns of `normal_force` count for sliding to positive and to negative side; of a simple clamp they
    are equal. `desired_displacement` x_d (m) is what a rack's position control was asked for, where recorded.
    `zero_from` is where the zero of the force is to be had where nobody says (see `looks/force_zero.py`);
    `direction_spread` the standard deviation of ln(mu_p / mu_n) that is to be expected.
    """

    name: str
    dt: float
    displacement: FloatArray
    force: FloatArray
    normal_force: FloatArray
    desired_displacement: FloatArray | None = None
    notes: tuple[str, ...] = ()
    zero_from: str = 'recorded'
    direction_spread: float = DIRECTION_SPREAD

    @property
    def time(self) -> FloatArray:
        """Time from the first sample, s."""
        return np.asarray(np.arange(self.force.size) * self.dt, np.float64)

    @property
    def force_rms(self) -> float:
        """Root of the mean square of the force, N: what errors are related to."""
        return float(np.sqrt(np.mean(self.force**2)))


def checked_recording(
    name: str,
    time: npt.ArrayLike,
    displacement: npt.ArrayLike,
    force: npt.ArrayLike,
    normal_force: npt.ArrayLike,
    desired_displacement: npt.ArrayLike | None = None,
    notes: tuple[str, ...] = (),
    coefficient_range: tuple[float, float] = COEFFICIENT_RANGE,
) -> FrictionRecording:
    """Return the recording on an even grid, or raise `IdentificationError` with value, limit and remedy.

    `time` in s, displacements in m, forces in N, arrays (n,); `normal_force` (n,), (n, 2) or one number.
    `coefficient_range` is what |F| / F_N may be; wide where the clamp is not the pressure on the contact.
    """
    times = np.asarray(time, float)
    count = times.size
    if count < FEWEST_SAMPLES:
        raise IdentificationError(
            f'{name} has {count} samples; at least {FEWEST_SAMPLES} are needed: record a whole ramp or stroke'
        )
    clamp = (
        np.broadcast_to(np.asarray(normal_force, float).reshape(-1, 1), (count, 2)).copy()
        if (np.ndim(normal_force) < 2)
        else np.array(normal_force, float)
    )
    channels = {
        'time': times,
        'displacement': np.asarray(displacement, float),
        'friction force': np.asarray(force, float),
        'normal force': clamp,
    }
    if desired_displacement is not None:
        channels['desired displacement'] = np.asarray(desired_displacement, float)
    for channel, values in channels.items():
        _check_numbers(name, channel, values, count)
    _check_time(name, times)
    _check_motion(name, channels['displacement'], channels['friction force'])
    _check_magnitudes(name, channels['displacement'], channels['friction force'], clamp, coefficient_range)
    return _evenly(name, channels, notes)


def smoothed_displacement(recording: FrictionRecording) -> FloatArray:
    """Return the displacement (m) with as much smoothing as its own noise makes necessary, and no more.

    Sliding direction is the sign of its difference, so noise must stay well below the motion of one sample.
    The noise is taken from the fourth difference, to which smooth motion does not contribute.
    """
    raw = recording.displacement
    noise = float(np.median(np.abs(np.diff(raw, 4)))) / (0.6745 * math.sqrt(70.0))
    typical_step = float(np.sqrt(np.mean(np.diff(raw, axis=0) ** 2)))
    if noise == 0.0 or typical_step == 0.0:
        return raw
    # slope of a line through w noisy samples: sigma sqrt(12 / w^3) per sample
    window = math.ceil((12.0 * (noise / (_NOISE_SHARE * typical_step)) ** 2) ** (1.0 / 3.0))
    window = min(window | 1, _LONGEST_WINDOW, (raw.size - 1) | 1)
    if window < 5:
        return raw
    from scipy.signal import savgol_filter  # loads long

    return np.asarray(savgol_filter(raw, window, 2), float)


def thinned(recording: FrictionRecording, samples: int) -> FrictionRecording:
    """Return about `samples` means of neighbouring samples, for searches that would take long on all."""
    factor = recording.force.size // samples
    if factor < 2:
        return recording
    count = recording.force.size // factor * factor

    def means(values: FloatArray) -> FloatArray:
        return np.asarray(values[:count].reshape(-1, factor, *values.shape[1:]).mean(axis=1))

    desired = recording.desired_displacement
    return replace(
        recording,
        dt=recording.dt * factor,
        displacement=means(smoothed_displacement(recording)),
        force=means(recording.force),
        normal_force=means(recording.normal_force),
        desired_displacement=None if desired is None else means(desired),
    )


def _check_numbers(name: str, channel: str, values: FloatArray, count: int) -> None:
    if values.shape[0] != count:
        raise IdentificationError(
            f'{name}: {channel} has {values.shape[0]} samples, time has {count}; both must be of equal length'
        )
    bad = np.flatnonzero(~np.isfinite(values.reshape(count, -1)).all(axis=1))
    if bad.size:
        raise IdentificationError(
            f'{name}: {channel} is no number at sample {bad[0]} ({bad.size} such of {count}, 0 allowed); '
            'repair or cut the recording there'
        )


def _check_time(name: str, times: FloatArray) -> None:
    steps = np.diff(times)
    if steps.min() <= 0.0:
        place = int(np.argmax(steps <= 0.0))
        raise IdentificationError(
            f'{name}: time must rise; {times[place]:.6f} s is followed by {times[place + 1]:.6f} s at sample '
            f'{place + 1}: sort the samples or remove repeated ones'
        )
    usual = float(np.median(steps))
    if steps.max() > LONGEST_GAP_STEPS * usual + 1e-12:
        place = int(steps.argmax())
        raise IdentificationError(
            f'{name}: {steps.max():.4f} s without samples at {times[place]:.3f} s; at most '
            f'{LONGEST_GAP_STEPS:g} sample intervals ({LONGEST_GAP_STEPS * usual:.4f} s) are bridged: '
            'cut the recording there'
        )


def _check_motion(name: str, displacement: FloatArray, force: FloatArray) -> None:
    for channel, values in (('displacement', displacement), ('friction force', force)):
        if np.ptp(values) == 0.0:
            raise IdentificationError(
                f'{name}: {channel} is constant ({values[0]:g}); it must change: is its sensor connected and '
                'the right channel chosen?'
            )
    for channel, values, other, other_values in (
        ('displacement', displacement, 'friction force', force),
        ('friction force', force, 'displacement', displacement),
    ):
        first, last = _longest_repeat(values)
        moved = np.abs(np.diff(other_values))
        share = float(moved[first:last].sum() / moved.sum())
        travel = float(np.ptp(other_values[first : last + 1]))
        if share > STUCK_SHARE and travel > 0.2 * np.ptp(other_values):
            raise IdentificationError(
                f'{name}: {channel} repeats {values[first]:g} for {last - first + 1} samples during '
                f'{100 * share:.0f} % of the motion of the {other} (at most {100 * STUCK_SHARE:.0f} %): '
                'its sensor is stuck or saturated; check it and record again'
            )


def _longest_repeat(values: FloatArray) -> tuple[int, int]:
    changes = np.concatenate([[-1], np.flatnonzero(np.diff(values)), [values.size - 1]])
    longest = int(np.argmax(np.diff(changes)))
    return int(changes[longest] + 1), int(changes[longest + 1])


def _check_magnitudes(
    name: str, displacement: FloatArray, force: FloatArray, clamp: FloatArray, limits: tuple[float, float]
) -> None:
    stroke = float(np.ptp(displacement))
    if not STROKE_RANGE[0] <= stroke <= STROKE_RANGE[1]:
        guess = _unit_guess(stroke, STROKE_RANGE, 'm')
        raise IdentificationError(
            f'{name}: displacement spans {stroke:.3g} m; {STROKE_RANGE[0]:g} .. {STROKE_RANGE[1]:g} m are '
            f'plausible{guess}'
        )
    largest = float(np.abs(force).max())
    if not FORCE_RANGE[0] <= largest <= FORCE_RANGE[1]:
        guess = _unit_guess(largest, FORCE_RANGE, 'N')
        raise IdentificationError(
            f'{name}: friction force reaches {largest:.3g} N; {FORCE_RANGE[0]:g} .. {FORCE_RANGE[1]:g} N are '
            f'plausible{guess}'
        )
    if clamp.min() <= 0.0:
        raise IdentificationError(
            f'{name}: normal force falls to {clamp.min():.3g} N; it must stay above 0 N: choose a stretch '
            'with the contact closed, or check sign and zero of the load cell'
        )
    coefficient = float(np.percentile(np.abs(force), 95) / np.median(clamp))
    low, high = limits
    if coefficient > high:
        raise IdentificationError(
            f'{name}: friction force over normal force reaches {coefficient:.3g}; at most {high:g} is '
            'plausible: is the normal force in kN, or the friction force in mN? Name the units of the columns'
        )
    # A contact that only creeps may stay far below sliding; a thousandth of it is no contact at all.
    if coefficient < low / 20.0 or (coefficient < low and stroke > 1e-4):
        raise IdentificationError(
            f'{name}: friction force over normal force stays at {coefficient:.3g}; at least {low:g} is '
            'plausible: is the friction force in kN, or the normal force in mN? Name the units of the columns'
        )


def _unit_guess(value: float, limits: tuple[float, float], unit: str) -> str:
    for factor in (1e3, 1e-3):
        if limits[0] <= value * factor <= limits[1]:
            if unit == 'm':
                guess = 'metres under a heading in mm' if factor > 1.0 else 'mm under a heading in m'
            else:
                guess = 'kN under a heading in N' if factor > 1.0 else 'mN under a heading in N'
            return f': does the file hold {guess}? Name the unit of the column'
    return ': name the unit of the column'


def _evenly(name: str, channels: dict[str, FloatArray], notes: tuple[str, ...]) -> FrictionRecording:
    times = channels['time']
    dt = float((times[-1] - times[0]) / (times.size - 1))
    grid = times[0] + dt * np.arange(times.size)

    def at_grid(values: FloatArray) -> FloatArray:
        if np.abs(grid - times).max() < 0.01 * dt:
            return values
        if values.ndim == 2:
            return np.column_stack([np.interp(grid, times, column) for column in values.T])
        return np.interp(grid, times, values)

    desired = channels.get('desired displacement')
    return FrictionRecording(
        name,
        dt,
        at_grid(channels['displacement']),
        at_grid(channels['friction force']),
        at_grid(channels['normal force']),
        None if desired is None else at_grid(desired),
        notes,
    )
