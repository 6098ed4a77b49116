"""Eq (10) by itself: the exponential of a contact that is held, as the authors fitted it (Fig. 7).

`ramp_hold` fits ramp and hold of all channels at once, and needs no time from which on to look.
"""

from dataclasses import dataclass

import numpy as np
from scipy.optimize import least_squares

from engine_mount.identification.friction.recording import FloatArray


@dataclass(frozen=True)
class Relaxation:
    """x(t) = asymptote - amplitude exp(-t/T), t from the start of the ramp; m, m, s."""

    asymptote: float
    amplitude: float
    time_constant: float

    def at(self, time: FloatArray) -> FloatArray:
        """Return the displacement (m) at `time` (s)."""
        return self.asymptote - self.amplitude * np.exp(-time / self.time_constant)

    def kappa(self, ramp_time: float) -> float:
        """Return T_v / T of a ramp of `ramp_time` (s).

        A ramp leaves a larger amplitude than the step that Eq (10) is about, whose ramp time is 0 (derived).
        """
        share = self.amplitude / self.asymptote
        if ramp_time > 0.0:
            ratio = ramp_time / self.time_constant
            share *= float(ratio / np.expm1(ratio))
        return 1.0 - share


def fit_relaxation(time: FloatArray, displacement: FloatArray, fit_from: float) -> Relaxation:
    """Return the relaxation that meets `displacement` (m) best from `fit_from` (s) on, arrays (n,)."""
    shown = time >= fit_from
    t, x = time[shown], displacement[shown]
    scale = abs(x[-1])

    def error(unknown: FloatArray) -> FloatArray:
        return np.asarray(unknown[0] - unknown[1] * np.exp(-t / unknown[2]) - x / scale, np.float64)

    found = least_squares(error, (1.0, 0.2, 0.2 * t[-1]), bounds=((-10, -10, 1e-3), (10, 10, 100))).x
    return Relaxation(float(found[0]) * scale, float(found[1]) * scale, float(found[2]))
