"""A friction recording as identification needs it: checked, in SI units, on an even time grid."""

import itertools
import math
from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt

from engine_mount.identification.fitting import FloatArray, IdentificationError, rms

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
_CHANNELS = ('displacement', 'friction force', 'normal force', 'normal force', 'desired displacement')


@dataclass(frozen=True)
class FrictionRecording:
    """Displacement x (m), friction force F_F (N), both (n,), and normal force F_N (N, (n, 2)), `dt` s apart.

    The columns of `normal_force` count for sliding to positive and to negative side; of a simple clamp they
    are equal. `desired_displacement` x_d (m) is the command of a rack's position control, where recorded.
    `zero_from` is the default source of the zero of the force (`look.subtract_zero`); `direction_spread` the
    standard deviation of ln(mu_p / mu_n) that is to be expected.
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
        return np.arange(self.force.size) * self.dt

    @property
    def force_rms(self) -> float:
        """Root of the mean square of the force, N: what errors are related to."""
        return rms(self.force)


def checked_recording(
    name: str,
    time: npt.ArrayLike,
    displacement: npt.ArrayLike,
    force: npt.ArrayLike,
    normal_force: npt.ArrayLike,
    desired_displacement: npt.ArrayLike | None = None,
    coefficient_range: tuple[float, float] = COEFFICIENT_RANGE,
) -> FrictionRecording:
    """Return the recording on an even grid, or raise `IdentificationError` with value, limit and remedy.

    `time` in s, displacements in m, forces in N, arrays (n,); `normal_force` (n,), (n, 2) or one number.
    `coefficient_range` is what |F| / F_N may be; wide where the clamp is not the pressure on the contact.
    """
    times, normal = np.asarray(time, float), np.asarray(normal_force, float)
    count = times.size
    if count < FEWEST_SAMPLES:
        raise IdentificationError(
            f'{name} has {count} samples; at least {FEWEST_SAMPLES} are needed: record a whole ramp or stroke'
        )
    sides = normal.T if normal.ndim == 2 else np.broadcast_to(normal, (2, count))
    channels = np.array(
        [displacement, force, *sides, *([] if desired_displacement is None else [desired_displacement])],
        float,
    )
    for channel, values in zip(('time', *_CHANNELS), (times, *channels), strict=False):
        bad = np.flatnonzero(~np.isfinite(values))
        if bad.size:
            raise IdentificationError(
                f'{name}: {channel} is no number at sample {bad[0]} ({bad.size} such of {count}, 0 allowed); '
                'repair or cut the recording there'
            )
    _check_time(name, times)
    _check_motion(name, channels[0], channels[1])
    _check_magnitudes(name, channels[0], channels[1], channels[2:4], coefficient_range)
    dt = float((times[-1] - times[0]) / (count - 1))
    grid = times[0] + dt * np.arange(count)
    if np.abs(grid - times).max() >= 0.01 * dt:
        channels = np.array([np.interp(grid, times, values) for values in channels])
    x, friction, positive, negative, *desired = channels
    return FrictionRecording(
        name, dt, x, friction, np.column_stack([positive, negative]), desired[0] if desired else None
    )


def smoothed_displacement(recording: FrictionRecording) -> FloatArray:
    """Return the displacement (m) with as much smoothing as its own noise makes necessary, and no more.

    Sliding direction is the sign of its difference, so noise must stay well below the motion of one sample.
    The noise is taken from the fourth difference, to which smooth motion does not contribute.
    """
    raw = recording.displacement
    noise = np.median(np.abs(np.diff(raw, 4))) / (0.6745 * math.sqrt(70.0))
    typical_step = rms(np.diff(raw))
    if noise == 0.0 or typical_step == 0.0:
        return raw
    # slope of a line through w noisy samples: sigma sqrt(12 / w^3) per sample
    window = math.ceil((12.0 * (noise / (_NOISE_SHARE * typical_step)) ** 2) ** (1.0 / 3.0))
    window = min(window | 1, _LONGEST_WINDOW, (raw.size - 1) | 1)
    if window < 5:
        return raw
    from scipy.signal import savgol_filter  # loads long

    return savgol_filter(raw, window, 2)


def thinned(recording: FrictionRecording, samples: int) -> FrictionRecording:
    """Return about `samples` means of neighbouring samples, for searches that would take long on all."""
    factor = recording.force.size // samples
    if factor < 2:
        return recording
    count = recording.force.size // factor * factor

    def means(values: FloatArray) -> FloatArray:
        return values[:count].reshape(-1, factor, *values.shape[1:]).mean(axis=1)

    return replace(
        recording,
        dt=recording.dt * factor,
        displacement=means(smoothed_displacement(recording)),
        force=means(recording.force),
        normal_force=means(recording.normal_force),
        desired_displacement=None,
    )


def _check_time(name: str, times: FloatArray) -> None:
    steps = np.diff(times)
    if steps.min() <= 0.0:
        place = int(np.argmax(steps <= 0.0))
        raise IdentificationError(
            f'{name}: time must rise; {times[place]:.6f} s is followed by {times[place + 1]:.6f} s at sample '
            f'{place + 1}: sort the samples or remove repeated ones'
        )
    longest = LONGEST_GAP_STEPS * np.median(steps)
    if steps.max() > longest + 1e-12:
        raise IdentificationError(
            f'{name}: {steps.max():.4f} s without samples at {times[steps.argmax()]:.3f} s; at most '
            f'{LONGEST_GAP_STEPS:g} sample intervals ({longest:.4f} s) are bridged: cut the recording there'
        )


def _check_motion(name: str, displacement: FloatArray, force: FloatArray) -> None:
    channels = (('displacement', displacement), ('friction force', force))
    for channel, values in channels:
        if np.ptp(values) == 0.0:
            raise IdentificationError(
                f'{name}: {channel} is constant ({values[0]:g}); it must change: is its sensor connected and '
                'the right channel chosen?'
            )
    for (channel, values), (other, other_values) in itertools.permutations(channels):
        changes = np.concatenate([[-1], np.flatnonzero(np.diff(values)), [values.size - 1]])
        longest = int(np.argmax(np.diff(changes)))
        first, last = changes[longest] + 1, changes[longest + 1]
        moved = np.abs(np.diff(other_values))
        share = moved[first:last].sum() / moved.sum()
        if share > STUCK_SHARE and np.ptp(other_values[first : last + 1]) > 0.2 * np.ptp(other_values):
            raise IdentificationError(
                f'{name}: {channel} repeats {values[first]:g} for {last - first + 1} samples during '
                f'{share:.0%} of the motion of the {other} (at most {STUCK_SHARE:.0%}): its sensor is stuck '
                'or saturated; check it and record again'
            )


def _check_magnitudes(
    name: str, displacement: FloatArray, force: FloatArray, clamp: FloatArray, limits: tuple[float, float]
) -> None:
    stroke = np.ptp(displacement)
    for words, unit, value, (low, high) in (
        ('displacement spans', 'm', stroke, STROKE_RANGE),
        ('friction force reaches', 'N', np.abs(force).max(), FORCE_RANGE),
    ):
        if not low <= value <= high:
            raise IdentificationError(
                f'{name}: {words} {value:.3g} {unit}; {low:g} .. {high:g} {unit} are plausible: is the unit '
                'of the column right (by a factor of 1000)? Name it'
            )
    if clamp.min() <= 0.0:
        raise IdentificationError(
            f'{name}: normal force falls to {clamp.min():.3g} N; it must stay above 0 N: choose a stretch '
            'with the contact closed, or check sign and zero of the load cell'
        )
    coefficient = np.percentile(np.abs(force), 95) / np.median(clamp)
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
