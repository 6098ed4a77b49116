"""First look at a recording: the zero of its force, and how much of its way the contact slides.

Coulomb friction behind a spring with play is fitted with an unknown zero, F = law(x) + zero. It holds what a
loop can show: sliding, sticking (the spring), and play. The contact may begin with a force of its own: how
far its spring is stretched at the first sample is fitted too.

A force that lingers in the play, or turns within the spring, tells the zero by itself. Of a contact that does
nothing but slide, a zero and friction that differs by direction look alike; there both directions are taken
to be alike within the recording's `direction_spread`; the deviation of the zero says what that leaves open.
"""

import itertools
import math
from dataclasses import dataclass

import numpy as np
from scipy.optimize import OptimizeResult, least_squares

from engine_mount.identification.friction.laws.elastic_play import elastic_play_force
from engine_mount.identification.friction.recording import FloatArray, FrictionRecording, thinned
from engine_mount.identification.single_threaded import single_threaded

LARGEST_DEVIATION = 0.2
"""Share of the force of sliding up to which the deviation of a zero counts as told (chosen)."""
LOOK_SAMPLES = 1200
"""Samples of a recording that the fit sees (chosen)."""
_STIFFNESSES = (5.0, 20.0, 80.0)  # of half the range of force over the stroke, chosen
_PLAYS = (0.002, 0.05, 0.2)  # of the stroke, chosen
_FINISHED = 3  # searches that are carried through, chosen
_WIDE = np.array([3.0, 3.0, 3.0, 0.3, 1.0, 1.0])
"""Deviations of the unknowns beforehand (chosen, wide): what is not told stays this unsure."""
_EXPECTED = np.array([0.0, 0.0, math.log(20.0), 0.0, 0.0, 0.0])
_LOW, _HIGH = np.array([-9.0, -9.0, -3.0, 0.0, -1.0, -2.0]), np.array([5.0, 5.0, 12.0, 0.6, 1.0, 2.0])
_ZERO = 5  # place of the zero among the unknowns


@dataclass(frozen=True)
class FirstLook:
    """What the fit says: the zero of the force with its deviation (N), and shares of the way (sum 1).

    `limits` (N) are the forces of sliding to the positive and the negative side, `stiffness` (N/m) and `play`
    (m, half of it) those of `ElasticPlay`. `explained` is the share of the mean square of the force about its
    zero that the fit explains. `taken` (N) is what was taken away from the recorded force before, `rest` (N)
    what it read at rest before the motion; None where there was no rest.
    """

    zero: float
    deviation: float
    limits: tuple[float, float]
    stiffness: float
    play: float
    explained: float
    sliding: float
    sticking: float
    in_play: float
    taken: float = 0.0
    rest: float | None = None

    @property
    def known(self) -> bool:
        """Whether the loop tells the zero well enough to be used."""
        return self.deviation < LARGEST_DEVIATION * (self.limits[0] + self.limits[1]) / 2.0


@single_threaded
def first_look(recording: FrictionRecording) -> FirstLook:
    """Return the zero of the force and the shares of the way of a recording that moves to and fro."""
    loop = _Loop(thinned(recording, LOOK_SAMPLES))
    starts = sorted(loop.starts(), key=lambda start: float((loop.residuals(start) ** 2).sum()))[:_FINISHED]
    ends = [loop.search(start) for start in starts]
    best = min(ends, key=lambda end: float(end.cost))
    # how much a sample tells is known only now: what is left over hangs together over many samples
    loop.weigh(best.x)
    return loop.look(loop.search(best.x))


class _Loop:
    """One recording as the fit sees it, forces over half their range, ways over the stroke.

    Unknowns: logarithms of both levels and of the stiffness, play, stretch at the first sample (-1 .. 1 of
    what the contact can hold), zero.
    """

    def __init__(self, recording: FrictionRecording):
        self.stroke = float(np.ptp(recording.displacement))
        self.scale = 0.5 * float(np.ptp(recording.force))
        self.x = recording.displacement / self.stroke
        self.force = recording.force / self.scale
        self.pressure = recording.normal_force / recording.normal_force.mean()
        self.direction_spread = recording.direction_spread
        self.weight = 1.0 / (0.1 * np.sqrt(self.force.size))  # until it is known better

    def starts(self) -> list[FloatArray]:
        middle = 0.5 * float(self.force.max() + self.force.min())
        return [
            np.clip([-0.1, -0.1, np.log(stiffness), play, 0.0, zero], _LOW + 1e-6, _HIGH - 1e-6)
            for zero, stiffness, play in itertools.product((0.0, middle), _STIFFNESSES, _PLAYS)
        ]

    def law(self, unknowns: FloatArray) -> FloatArray:
        """Return the force without its zero."""
        mu_p, mu_n, stiffness = np.exp(unknowns[:3])
        play, stretch = unknowns[3:5]
        side = 0 if stretch >= 0.0 else 1
        held = stretch * (play + (mu_p, mu_n)[side] * self.pressure[0, side] / stiffness)
        # a step to the first sample brings the joint to where it begins
        x = np.concatenate([[self.x[0] - held], self.x])
        pressure = np.concatenate([self.pressure[:1], self.pressure])
        return np.asarray(elastic_play_force(mu_p, mu_n, stiffness, play, x, pressure)[1:])

    def residuals(self, unknowns: FloatArray) -> FloatArray:
        left = self.law(unknowns) + unknowns[_ZERO] - self.force
        return np.concatenate(
            [
                self.weight * left,
                (unknowns - _EXPECTED) / _WIDE,
                [(unknowns[0] - unknowns[1]) / self.direction_spread],
            ]
        )

    def search(self, start: FloatArray) -> OptimizeResult:
        return least_squares(
            self.residuals,
            np.clip(start, _LOW + 1e-6, _HIGH - 1e-6),
            bounds=(_LOW, _HIGH),
            x_scale=_WIDE,
            diff_step=1e-4,
            ftol=1e-7,
            xtol=1e-7,
            max_nfev=60,
        )

    def weigh(self, unknowns: FloatArray) -> None:
        left = self.law(unknowns) + unknowns[_ZERO] - self.force
        variance = float(np.mean(left**2)) * _correlated_samples(left)
        self.weight = 1.0 / np.sqrt(max(variance, 1e-12))

    def look(self, end: OptimizeResult) -> FirstLook:
        unknowns, scale = end.x, self.scale
        covariance = np.linalg.inv(end.jac.T @ end.jac)
        law = self.law(unknowns)
        centred = self.force - unknowns[_ZERO]
        levels, pressure = np.exp(unknowns[:2]), self.pressure.mean(axis=0)
        sliding, sticking, in_play = self._shares(law, levels)
        return FirstLook(
            zero=scale * float(unknowns[_ZERO]),
            deviation=scale * float(np.sqrt(covariance[_ZERO, _ZERO])),
            limits=(scale * float(levels[0] * pressure[0]), scale * float(levels[1] * pressure[1])),
            stiffness=float(np.exp(unknowns[2])) * scale / self.stroke,
            play=float(unknowns[3]) * self.stroke,
            explained=float(max(0.0, 1.0 - np.mean((law - centred) ** 2) / np.mean(centred**2))),
            sliding=sliding,
            sticking=sticking,
            in_play=in_play,
        )

    def _shares(self, law: FloatArray, levels: FloatArray) -> tuple[float, float, float]:
        way = np.abs(np.diff(self.x))
        after = law[1:]
        most = np.where(after >= 0.0, *(levels * self.pressure[1:]).T)
        slides, plays = np.abs(after) > (1.0 - 1e-6) * most, after == 0.0
        whole = float(way.sum())
        sliding, in_play = float(way[slides].sum()) / whole, float(way[plays].sum()) / whole
        return sliding, 1.0 - sliding - in_play, in_play


def _correlated_samples(values: FloatArray) -> float:
    """Return how many neighbouring samples say one thing: the sum of their autocorrelation, at least 1."""
    centred = values - values.mean()
    spectrum = np.fft.rfft(centred, 2 * centred.size)
    correlation = np.fft.irfft(np.abs(spectrum) ** 2)[: centred.size]
    if correlation[0] <= 0.0:
        return 1.0
    correlation = correlation / correlation[0]
    ends = np.flatnonzero(correlation < 0.0)
    return float(max(1.0, 2.0 * correlation[: ends[0] if ends.size else None].sum() - 1.0))
