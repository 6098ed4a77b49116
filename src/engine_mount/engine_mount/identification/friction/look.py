"""First look at a recording: the zero of its force, and how much of its way the contact slides.

Coulomb friction behind a spring with play is fitted with an unknown zero, F = law(x) + zero. It holds what a
loop can show: sliding, sticking (the spring), and play. The contact may begin with a force of its own: how
far its spring is stretched at the first sample is fitted too.

A force that stays in the play, or turns within the spring, determines the zero by itself. Of a contact that
does nothing but slide, a zero and friction that differs by direction look alike; there both directions are
taken to be alike within the recording's `direction_spread`; the deviation of the zero shows what that leaves
open. At rest a damper may stick, with a force of its own, so what a cell reads there is not its zero.
"""

import itertools
import math
from dataclasses import dataclass, replace

import numpy as np
from scipy.optimize import OptimizeResult, least_squares

from engine_mount.identification.fitting import FloatArray, IdentificationError, single_threaded
from engine_mount.identification.friction.laws import elastic_play_force
from engine_mount.identification.friction.recording import FrictionRecording, thinned

ZEROS = ('law', 'rest', 'recorded')
"""Sources of the zero: the loop, the mean of the rest before the motion, or the file as it is."""
DOUBTED = 3.0
"""Deviations by which two zeros must differ to be doubted (chosen)."""
LARGEST_DEVIATION = 0.2
"""Share of the force of sliding up to which the deviation of a zero counts as known (chosen)."""
LOOK_SAMPLES = 1200
"""Samples of a recording that the fit sees (chosen)."""
_REST = 0.1  # s at the beginning
_AT_REST = 0.01  # of the range of displacement
_STIFFNESSES = (5.0, 20.0, 80.0)  # of half the range of force over the stroke, chosen
_PLAYS = (0.002, 0.05, 0.2)  # of the stroke, chosen
_FINISHED = 3  # searches that are carried through, chosen
_WIDE = np.array([3.0, 3.0, 3.0, 0.3, 1.0, 1.0])
"""Deviations of the unknowns beforehand (chosen, wide): what the loop does not show stays this unsure."""
_EXPECTED = np.array([0.0, 0.0, math.log(20.0), 0.0, 0.0, 0.0])
_LOW, _HIGH = np.array([-9.0, -9.0, -3.0, 0.0, -1.0, -2.0]), np.array([5.0, 5.0, 12.0, 0.6, 1.0, 2.0])


@dataclass(frozen=True)
class FirstLook:
    """The zero of the force with its deviation (N), and shares of the way (sum 1).

    `limits` (N) are the forces of sliding to the positive and the negative side, `stiffness` (N/m) and `play`
    (m, half of it) those of elastic play. `explained` is the share of the mean square of the force about its
    zero that the fit explains. `taken` (N) was subtracted from the recorded force before, `rest` (N) is what
    it read at rest before the motion; None where there was no rest.
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
        """Whether the loop determines the zero well enough to be used."""
        return self.deviation < LARGEST_DEVIATION * (self.limits[0] + self.limits[1]) / 2.0


def subtract_zero(recording: FrictionRecording, zero_from: str = '') -> tuple[FrictionRecording, FirstLook]:
    """Return the recording without the zero of its force, with a note, and its first look.

    `zero_from` is one of `ZEROS`, or '' for the default of the recording's kind of file. Raises
    `IdentificationError` for another word, and for 'rest' without any.
    """
    source = zero_from or recording.zero_from
    if source not in ZEROS:
        raise IdentificationError(f'--zero {source!r} must be one of {", ".join(ZEROS)}')
    look = first_look(recording)
    quiet, x = recording.time <= _REST, recording.displacement
    moves = np.ptp(x[quiet]) > _AT_REST * np.ptp(x)
    rest = None if moves else float(recording.force[quiet].mean())
    if source == 'rest' and rest is None:
        raise IdentificationError(
            f'{recording.name}: the displacement moves within the first {_REST:g} s, so there is no rest to '
            'take the zero of the force from; choose --zero law or recorded'
        )
    zero, note = _zero(source, look, rest)
    notes = (*recording.notes, *([note] if note else []))
    return (
        replace(recording, force=recording.force - zero, notes=notes),
        replace(look, zero=look.zero - zero, taken=zero, rest=rest),
    )


def _zero(source: str, look: FirstLook, rest: float | None) -> tuple[float, str]:
    """Return the zero (N), and a note on where it comes from and whether it is doubtful."""
    by_loop = f'{look.zero:.0f} +- {look.deviation:.0f} N'
    other = 0.0 if rest is None or source == 'recorded' else rest
    apart = abs(other - look.zero) > DOUBTED * look.deviation
    if source == 'recorded':
        doubt = f'force zero as recorded; doubtful: the loop gives {by_loop}; --zero law subtracts it'
        return 0.0, doubt if look.known and apart else ''
    if source == 'rest':
        note = f'force zero {other:.1f} N, from the {_REST:g} s of rest at the beginning'
        doubt = f'; doubtful: the loop gives {by_loop}, and at rest a contact may stick; --zero law uses it'
        return other, note + doubt if look.known and apart else note
    if not look.known:
        return 0.0, (
            f'force zero as recorded: the loop gives it only to +- {look.deviation:.0f} N, and the reading '
            'at rest may be a force that the contact holds; unclamp the damper once and read the cell then'
        )
    note = f'force zero {by_loop}, from the loop'
    if rest is None:
        return look.zero, note
    if not apart:
        return look.zero, f'{note}; the rest before the motion agrees ({rest:.0f} N)'
    deviations = abs(rest - look.zero) / look.deviation
    return look.zero, (
        f'{note}; the rest before the motion reads {rest:.0f} N, {deviations:.0f} deviations from it: there '
        'the contact may stick with a force of its own, so the rest is not used (--zero rest would)'
    )


@single_threaded()
def first_look(recording: FrictionRecording) -> FirstLook:
    """Return the zero of the force and the shares of the way of a recording that moves to and fro."""
    loop = _Loop(thinned(recording, LOOK_SAMPLES))
    middle = 0.5 * float(loop.force.max() + loop.force.min())
    starts = [
        np.array([-0.1, -0.1, np.log(stiffness), play, 0.0, zero])
        for zero, stiffness, play in itertools.product((0.0, middle), _STIFFNESSES, _PLAYS)
    ]
    starts.sort(key=lambda start: float((loop.residuals(_inside(start)) ** 2).sum()))
    best = min((loop.search(start) for start in starts[:_FINISHED]), key=lambda end: float(end.cost))
    # the weight of a sample is known only now: what is left over hangs together over many samples
    left = loop.law(best.x) + best.x[5] - loop.force
    variance = float(np.mean(left**2)) * _correlated_samples(left)
    loop.weight = 1.0 / np.sqrt(max(variance, 1e-12))
    return loop.look(loop.search(best.x))


def _inside(unknowns: FloatArray) -> FloatArray:
    return np.clip(unknowns, _LOW + 1e-6, _HIGH - 1e-6)


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

    def law(self, unknowns: FloatArray) -> FloatArray:
        """Return the force without its zero."""
        mu_p, mu_n, stiffness = np.exp(unknowns[:3])
        play, stretch = unknowns[3:5]
        side = 0 if stretch >= 0.0 else 1
        held = stretch * (play + (mu_p, mu_n)[side] * self.pressure[0, side] / stiffness)
        # a step to the first sample brings the joint to where it begins
        x = np.concatenate([[self.x[0] - held], self.x])
        pressure = np.concatenate([self.pressure[:1], self.pressure])
        return elastic_play_force(np.array([mu_p, mu_n, stiffness, play]), x, 1.0, pressure)[1:]

    def residuals(self, unknowns: FloatArray) -> FloatArray:
        left = self.law(unknowns) + unknowns[5] - self.force
        sides = (unknowns[0] - unknowns[1]) / self.direction_spread
        return np.concatenate([self.weight * left, (unknowns - _EXPECTED) / _WIDE, [sides]])

    def search(self, start: FloatArray) -> OptimizeResult:
        return least_squares(
            self.residuals, _inside(start), bounds=(_LOW, _HIGH), x_scale=_WIDE, diff_step=1e-4, ftol=1e-7,
            xtol=1e-7, max_nfev=60,
        )  # fmt: skip

    def look(self, end: OptimizeResult) -> FirstLook:
        scale, zero = self.scale, float(end.x[5])
        levels, force, centred = np.exp(end.x[:2]), self.law(end.x), self.force - zero
        way = np.abs(np.diff(self.x))
        most = np.where(force[1:] >= 0.0, *(levels * self.pressure[1:]).T)
        sliding, in_play = (
            float(way[where].sum()) / float(way.sum())
            for where in (np.abs(force[1:]) > (1.0 - 1e-6) * most, force[1:] == 0.0)
        )
        limits = scale * (levels * self.pressure.mean(axis=0))
        return FirstLook(
            zero=scale * zero,
            deviation=scale * float(np.sqrt(np.linalg.inv(end.jac.T @ end.jac)[5, 5])),
            limits=(float(limits[0]), float(limits[1])),
            stiffness=float(np.exp(end.x[2])) * scale / self.stroke,
            play=float(end.x[3]) * self.stroke,
            explained=float(max(0.0, 1.0 - np.mean((force - centred) ** 2) / np.mean(centred**2))),
            sliding=sliding,
            sticking=1.0 - sliding - in_play,
            in_play=in_play,
        )


def _correlated_samples(values: FloatArray) -> float:
    """Return how many neighbouring samples repeat each other: the sum of their autocorrelation."""
    centred = values - values.mean()
    spectrum = np.fft.rfft(centred, 2 * centred.size)
    correlation = np.fft.irfft(np.abs(spectrum) ** 2)[: centred.size]
    if correlation[0] <= 0.0:
        return 1.0
    correlation = correlation / correlation[0]
    ends = np.flatnonzero(correlation < 0.0)
    return float(max(1.0, 2.0 * correlation[: ends[0] if ends.size else None].sum() - 1.0))
