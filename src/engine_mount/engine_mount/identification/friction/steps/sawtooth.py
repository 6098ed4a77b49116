"""Step 2: mu over the deflection u at constant speeds and normal force (Figs. 8, 9, Eq 12).

The measured force drives the linear part, xi' = (F_F - c_R xi) / d_R; u = sign(F_F) xi. In every stroke
between two turning points mu = |F_F| / F_N is a straight line over u: mu = a + b u.
"""

from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from scipy.stats import t as student

from engine_mount.identification.friction.recording import (
    FloatArray,
    FrictionRecording,
    IdentificationError,
    smoothed_displacement,
)
from mount_models.arithmetic.compiled import compiled
from mount_models.friction.contact import FrictionContact

CONFIDENCE = 0.95
SHORTEST_WINDOW = 0.05
"""Part of a stroke after which mu over u is taken as settled, at least this long in s (chosen)."""
_SETTLING = 0.03  # s after a turning point: reversal in microslip is over
_SETTLING_TRAVEL = 2.5  # in travels that unload and load the spring c_Re
_EDGE = 0.01  # s before the next turning point, which noise and smoothing may blur
_LEAST_STROKE = 0.2  # of the largest stroke


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
        return float(np.sqrt(np.mean((self.mu - self.a - self.b * self.u) ** 2)))

    @property
    def fall(self) -> float:
        """By how much mu falls along the line, from its first to its last sample."""
        return float(self.b * (self.u[0] - self.u[-1]))


def stroke_lines(recording: FrictionRecording, contact: FrictionContact) -> list[StrokeLine]:
    """Return the line of every stroke of a sawtooth recording, in the order of time."""
    lines = []
    xi = deflection_from_force(
        recording.force, recording.dt, contact.tangential_stiffness, contact.tangential_damping
    )
    for first, last, velocity in strokes(recording):
        line = _line(recording, contact, xi, first, last, velocity)
        if line is not None:
            lines.append(line)
    if not lines:
        raise IdentificationError(
            f'{recording.name}: no stroke slides for {SHORTEST_WINDOW:g} s or more at constant speed; use '
            'longer strokes or lower speeds'
        )
    return lines


def strokes(recording: FrictionRecording) -> list[tuple[int, int, float]]:
    """Return (first sample, last sample, velocity m/s) of all strokes, incomplete and short ones too."""
    x = smoothed_displacement(recording)
    turns = [0, *turning_points(x), x.size - 1]
    found = []
    time = recording.time
    for first, last in pairwise(turns):
        if last - first < 8:
            continue
        inner = slice(first + (last - first) // 10, last - (last - first) // 10)
        velocity = float(np.polyfit(time[inner] - time[first], recording.displacement[inner], 1)[0])
        found.append((first, last, velocity))
    return found


def sliding_window(
    recording: FrictionRecording, contact: FrictionContact, first: int, last: int, velocity: float
) -> slice:
    """Return the samples of a stroke at which all of the contact slides; empty where it is too short.

    Behind the turning point the contact first unloads and loads the spring c_Re.
    """
    swing = 2.0 * float(np.median(np.abs(recording.force[first : last + 1])))
    travel = _SETTLING_TRAVEL * swing / contact.contact_stiffness
    settled = first + round(max(_SETTLING, travel / max(abs(velocity), 1e-9)) / recording.dt)
    return slice(settled, max(last - round(_EDGE / recording.dt), settled))


def turning_points(displacement: FloatArray) -> list[int]:
    """Return the samples at which the displacement turns, with strokes of at least a fifth of its range."""
    least = _LEAST_STROKE * float(np.ptp(displacement))
    turns: list[int] = []
    low = high = 0
    direction = 0
    for k in range(displacement.size):
        if displacement[k] > displacement[high]:
            high = k
        if displacement[k] < displacement[low]:
            low = k
        if direction >= 0 and displacement[high] - displacement[k] > least:
            if direction > 0 or displacement[high] - displacement[0] > 0.5 * least:
                turns.append(high)
            direction, low = -1, k
            high = k
        elif direction <= 0 and displacement[k] - displacement[low] > least:
            if direction < 0 or displacement[0] - displacement[low] > 0.5 * least:
                turns.append(low)
            direction, high = 1, k
            low = k
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


def _line(
    recording: FrictionRecording,
    contact: FrictionContact,
    xi: FloatArray,
    first: int,
    last: int,
    velocity: float,
) -> StrokeLine | None:
    dt = recording.dt
    side = 0 if velocity >= 0.0 else 1
    window = sliding_window(recording, contact, first, last, velocity)
    settled, end = window.start, window.stop
    if (end - settled) * dt < SHORTEST_WINDOW or end - settled < 20:
        return None
    sign = 1.0 if velocity >= 0.0 else -1.0
    clamp = float(recording.normal_force[window, side].mean())
    u = sign * xi[window]
    mu = sign * recording.force[window] / clamp
    # the slider moves by what the displacement moves, less what xi and the spring c_Re take of it
    third = max(1, (end - settled) // 3)
    span = (end - settled - third) * dt
    creep = float(xi[end - third : end].mean() - xi[settled : settled + third].mean()) / span
    relief = float(
        recording.force[end - third : end].mean() - recording.force[settled : settled + third].mean()
    ) / (span * contact.contact_stiffness)
    a, b, a_deviation, b_deviation = _fitted(u, mu)
    factor = float(student.ppf(0.5 + 0.5 * CONFIDENCE, max(u.size - 2, 1)))
    return StrokeLine(
        recording.name, velocity - creep - relief, clamp, a, b, factor * a_deviation, factor * b_deviation,
        a_deviation, b_deviation, u, mu, velocity, slice(first, last), window,
    )  # fmt: skip


def _fitted(u: FloatArray, mu: FloatArray) -> tuple[float, float, float, float]:
    """Return a and b of the line through mu over u, and their standard deviations."""
    centre = float(u.mean())
    matrix = np.column_stack([np.ones_like(u), u - centre])
    (level, slope), *_ = np.linalg.lstsq(matrix, mu, rcond=None)
    residual = mu - matrix @ np.array([level, slope])
    freedom = max(u.size - 2, 1)
    variance = float(residual @ residual) / freedom
    slope_variance = variance / max(float(((u - centre) ** 2).sum()), 1e-300)
    a_deviation = float(np.sqrt(variance / u.size + centre**2 * slope_variance))
    b_deviation = float(np.sqrt(slope_variance))
    return float(level - slope * centre), float(slope), a_deviation, b_deviation
