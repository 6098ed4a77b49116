"""Step 2: mu over the deflection u at constant speeds and normal force (Figs. 8, 9, Eq 12).

The measured force drives the linear part, xi' = (F_F - c_R xi) / d_R; u = sign(F_F) xi. In every stroke
between two turning points mu = |F_F| / F_N is a straight line over u: mu = a + b u.
"""

from dataclasses import dataclass
from itertools import pairwise
from typing import NamedTuple

import numpy as np
import numpy.typing as npt
from scipy.stats import linregress
from scipy.stats import t as student

from engine_mount.identification.fitting import FloatArray, IdentificationError, rms
from engine_mount.identification.friction.recording import FrictionRecording, smoothed_displacement
from mount_models.arithmetic.compiled import compiled
from mount_models.friction.contact import FrictionContact
from mount_models.friction.simplified import FADED_BELOW

RAMP, SAWTOOTH, OTHER = 'ramp', 'sawtooth', 'other motion'
CONFIDENCE = 0.95
SHORTEST_WINDOW = 0.05
"""Part of a stroke after which mu over u is taken as settled, at least this long in s (chosen)."""
_SETTLING = 0.03  # s after a turning point: reversal in microslip is over
_SETTLING_TRAVEL = 2.5  # in travels that unload and load the spring c_Re
_EDGE = 0.01  # s before the next turning point, which noise and smoothing may blur
_LEAST_STROKE = 0.2  # of the largest stroke
_HELD = 0.4  # of the recording within a quarter of the range of its end
_STRAIGHT = 0.015  # of a stroke: rms distance from a line; an arc of a sine has 0.05

BoolArray = npt.NDArray[np.bool_]


@dataclass(frozen=True)
class StrokeLine:
    """mu = a + b u of one stroke: a (1) and b (1/m) with the half widths of their confidence intervals.

    `velocity` (m/s, with sign) is that of the slider, to which a and b belong, `displacement_velocity` that
    of the rack. `window` are the samples of `u` (m) and `mu`, a part of the whole `stroke`.
    """

    recording: str
    velocity: float
    normal_force: float
    a: float
    b: float
    a_interval: float
    b_interval: float
    a_deviation: float
    b_deviation: float
    u: FloatArray
    mu: FloatArray
    displacement_velocity: float
    stroke: slice
    window: slice

    @property
    def residual(self) -> float:
        """Rms of what the line leaves of mu."""
        return rms(self.mu - self.a - self.b * self.u)

    @property
    def fall(self) -> float:
        """By how much mu falls along the line, from its first to its last sample."""
        return float(self.b * (self.u[0] - self.u[-1]))


class SlipRegions(NamedTuple):
    """Which samples (n,) are microslip, which macroslip, and which slide too slowly for the simplified model.

    The last 10 ms before a turning point are none of them: noise and smoothing may blur it.
    """

    micro: BoolArray
    macro: BoolArray
    faded: BoolArray


def kind_of_motion(recording: FrictionRecording) -> str:
    """Return 'ramp', 'sawtooth' or 'other motion'; a motion to one side only that is no ramp is refused."""
    time, raw, x = recording.time, recording.displacement, smoothed_displacement(recording)
    span = np.ptp(x)
    if not turning_points(x):
        held = np.abs(x - x[-max(1, x.size // 20) :].mean()) < 0.25 * span
        if held.mean() > _HELD:
            return RAMP
        side = 'positive' if x[-1] > x[0] else 'negative'
        raise IdentificationError(
            f'{recording.name} moves to the {side} side only (0 turning points in {1e3 * span:.3g} mm); at '
            'least 1 is needed: record strokes to and fro, or a ramp that is held'
        )
    straight = []
    for first, last, _ in strokes(recording):
        if np.ptp(raw[first:last]) > 0.5 * np.ptp(raw):
            edge = (last - first) // 10
            t, way = time[first + edge : last - edge], raw[first + edge : last - edge]
            off = way - np.polyval(np.polyfit(t, way, 1), t)
            straight.append(np.std(off) < _STRAIGHT * np.ptp(way))
    return SAWTOOTH if len(straight) >= 2 and np.mean(straight) > 0.8 else OTHER


def stroke_lines(recording: FrictionRecording, contact: FrictionContact) -> list[StrokeLine]:
    """Return the line of every stroke of a sawtooth recording, in the order of time."""
    xi = deflection_from_force(
        recording.force, recording.dt, contact.tangential_stiffness, contact.tangential_damping
    )
    lines = [
        line for stroke in strokes(recording) if (line := _line(recording, contact, xi, *stroke)) is not None
    ]
    if not lines:
        raise IdentificationError(
            f'{recording.name}: no stroke slides for {SHORTEST_WINDOW:g} s or more at constant speed; use '
            'longer strokes or lower speeds'
        )
    return lines


def strokes(recording: FrictionRecording) -> list[tuple[int, int, float]]:
    """Return (first sample, last sample, velocity m/s) of all strokes, incomplete and short ones too."""
    x, time = smoothed_displacement(recording), recording.time
    found = []
    for first, last in pairwise([0, *turning_points(x), x.size - 1]):
        if last - first >= 8:
            edge = (last - first) // 10
            inner = slice(first + edge, last - edge)
            velocity = np.polyfit(time[inner] - time[first], recording.displacement[inner], 1)[0]
            found.append((first, last, float(velocity)))
    return found


def slip_regions(recording: FrictionRecording, contact: FrictionContact) -> SlipRegions:
    """Return the regions; macroslip is the window of step 2, at `FADED_BELOW` or faster."""
    regions = SlipRegions(*np.zeros((3, recording.force.size), bool))
    for first, last, velocity in strokes(recording):
        window = _sliding_window(recording, contact, first, last, velocity)
        regions.micro[first : min(window.start, last)] = True
        (regions.faded if abs(velocity) < FADED_BELOW else regions.macro)[window] = True
    return regions


def turning_points(displacement: FloatArray) -> list[int]:
    """Return the samples at which the displacement turns, with strokes of at least a fifth of its range."""
    least = _LEAST_STROKE * np.ptp(displacement)
    turns: list[int] = []
    low = high = 0
    direction = 0
    for k, x in enumerate(displacement):
        high = k if x > displacement[high] else high
        low = k if x < displacement[low] else low
        if direction >= 0 and displacement[high] - x > least:
            if direction > 0 or displacement[high] - displacement[0] > 0.5 * least:
                turns.append(high)
            direction, low, high = -1, k, k
        elif direction <= 0 and x - displacement[low] > least:
            if direction < 0 or displacement[0] - displacement[low] > 0.5 * least:
                turns.append(low)
            direction, low, high = 1, k, k
    return turns


@compiled
def deflection_from_force(force, dt, tangential_stiffness, tangential_damping):
    """Return xi (m) of the linear part, from rest, for a `force` (N), (n,), straight between samples."""
    xi = np.zeros(force.size)
    z = tangential_stiffness * dt / tangential_damping
    fade = np.exp(-z)
    mean = -np.expm1(-z) / z
    for k in range(1, force.size):
        old, new = force[k - 1] / tangential_stiffness, force[k] / tangential_stiffness
        xi[k] = fade * xi[k - 1] + (mean - fade) * old + (1.0 - mean) * new
    return xi


def _sliding_window(
    recording: FrictionRecording, contact: FrictionContact, first: int, last: int, velocity: float
) -> slice:
    """Return the samples of a stroke at which all of the contact slides; empty where it is too short.

    Behind the turning point the contact first unloads and loads the spring c_Re.
    """
    swing = 2.0 * np.median(np.abs(recording.force[first : last + 1]))
    travel = _SETTLING_TRAVEL * swing / contact.contact_stiffness
    settled = first + round(max(_SETTLING, travel / max(abs(velocity), 1e-9)) / recording.dt)
    return slice(settled, max(last - round(_EDGE / recording.dt), settled))


def _line(
    recording: FrictionRecording,
    contact: FrictionContact,
    xi: FloatArray,
    first: int,
    last: int,
    velocity: float,
) -> StrokeLine | None:
    dt, force = recording.dt, recording.force
    window = _sliding_window(recording, contact, first, last, velocity)
    settled, end = window.start, window.stop
    if (end - settled) * dt < SHORTEST_WINDOW or end - settled < 20:
        return None
    side, sign = (0, 1.0) if velocity >= 0.0 else (1, -1.0)
    clamp = float(recording.normal_force[window, side].mean())
    u = sign * xi[window]
    mu = sign * force[window] / clamp
    # the slider moves by what the displacement moves, less what xi and the spring c_Re take of it
    third = max(1, (end - settled) // 3)
    span = (end - settled - third) * dt
    creep, rise = (
        float(values[end - third : end].mean() - values[settled : settled + third].mean())
        for values in (xi, force)
    )
    relief = rise / (span * contact.contact_stiffness)
    line, factor = linregress(u, mu), float(student.ppf(0.5 + 0.5 * CONFIDENCE, u.size - 2))
    deviations = float(line.intercept_stderr), float(line.stderr)
    return StrokeLine(
        recording.name, velocity - creep / span - relief, clamp, float(line.intercept), float(line.slope),
        factor * deviations[0], factor * deviations[1], *deviations, u, mu,
        velocity, slice(first, last), window,
    )  # fmt: skip
