"""Screening of a recording: the zero of its force, what the contact does, and whether it tells a coefficient.

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
from collections.abc import Mapping
from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np
from scipy.optimize import OptimizeResult, least_squares

from engine_mount.identification.fitting import FloatArray, IdentificationError, single_threaded
from engine_mount.identification.friction.laws import elastic_play_force
from engine_mount.identification.friction.recording import (
    FrictionRecording,
    smoothed_displacement,
    thinned,
)
from mount_models.quantity import nearest

ZEROS = ('law', 'recorded')
"""Sources of the zero: the loop, or the file as it is."""
DOUBTED = 3.0
"""Deviations by which the zero of the loop must differ from 0 to be doubted (chosen)."""
LARGEST_DEVIATION = 0.2
"""Share of the force of sliding up to which the deviation of a zero counts as known (chosen)."""
LOOK_SAMPLES = 1200
"""Samples of a recording that the fit sees (chosen)."""
NEVER = 0.02
"""Share of the way below which a contact does not slide (chosen)."""
MOST = 0.5  # chosen
"""Share of the way above which sticking, or play, is what is seen, and below which sliding is not."""
EXPLAINED = 0.6
"""Share of a force's mean square about its zero that friction with spring and play must explain (chosen)."""
LARGEST_ERROR = 0.35
"""Error, rms over rms, above which no law of the ladder counts (chosen): an eighth of the square."""
EXPECTED_ERROR = 0.25  # chosen
"""Largest error expected of a contact that slides and is clamped (docs/explanation/identification.md)."""
_STIFFNESSES = (5.0, 20.0, 80.0)  # of half the range of force over the stroke, chosen
_PLAYS = (0.002, 0.05, 0.2)  # of the stroke, chosen
_FINISHED = 3  # searches that are carried through, chosen
_WIDE = np.array([3.0, 3.0, 3.0, 0.3, 1.0, 1.0])
"""Deviations of the unknowns beforehand (chosen, wide): what the loop does not show stays this unsure."""
_EXPECTED = np.array([0.0, 0.0, math.log(20.0), 0.0, 0.0, 0.0])
_LOW, _HIGH = np.array([-9.0, -9.0, -3.0, 0.0, -1.0, -2.0]), np.array([5.0, 5.0, 12.0, 0.6, 1.0, 2.0])
_BETTER = 1.0 / 3.0  # of what friction leaves over: so little another motion must leave, chosen
_LONG = 4.0  # so many times the way to and fro that is not sliding makes a stroke, chosen
_REMEDIES = {
    'displacement': 'a spring beside the contact, or the rack itself; measure it unclamped and subtract it',
    'velocity': 'a viscous part; measure it unclamped and subtract it',
    'acceleration': 'the mass between cell and contact; move more slowly, or subtract its force',
}


class FirstLook(NamedTuple):
    """The zero of the force with its deviation (N), and shares of the way (sum 1).

    `limits` (N) are the forces of sliding to the positive and the negative side, `stiffness` (N/m) and `play`
    (m, half of it) those of elastic play. `explained` is the share of the mean square of the force about its
    zero that the fit explains. `taken` (N) was subtracted from the recorded force before.
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

    @property
    def known(self) -> bool:
        """Whether the loop determines the zero well enough to be used."""
        return self.deviation < LARGEST_DEVIATION * self.sliding_force

    @property
    def sliding_force(self) -> float:
        """Mean force of sliding of both sides, N."""
        return (self.limits[0] + self.limits[1]) / 2.0


class Case(NamedTuple):
    """What was seen, in two words, and a sentence with its figures and a remedy."""

    kind: str
    sentence: str


def subtract_zero(recording: FrictionRecording, zero_from: str = '') -> tuple[FrictionRecording, FirstLook]:
    """Return the recording without the zero of its force, with a note, and its first look.

    `zero_from` is one of `ZEROS`, or '' for the default of the recording's kind of file. Raises
    `IdentificationError` for another word.
    """
    source = zero_from or recording.zero_from
    if source not in ZEROS:
        raise IdentificationError(f'--zero {source!r} is unknown; {nearest(source, ZEROS)}')
    look = first_look(recording)
    width = f'+- {look.deviation:.0f} N, {look.deviation / look.sliding_force:.1%} of the force of sliding'
    by_loop, zero, note = f'{look.zero:.0f} N ({width})', 0.0, ''
    if source == 'law' and look.known:
        zero, note = look.zero, f'force zero {by_loop} from the loop'
    elif source == 'law':
        note = (
            f'force zero as recorded: the loop gives it only to {width} (limit {LARGEST_DEVIATION:.0%}); '
            'unclamp the damper once and read the cell then'
        )
    elif look.known and abs(look.zero) > DOUBTED * look.deviation:
        note = f'force zero as recorded; doubtful: the loop gives {by_loop}; --zero law subtracts it'
    notes = (*recording.notes, *([note] if note else []))
    return (
        replace(recording, force=recording.force - zero, notes=notes),
        look._replace(zero=look.zero - zero, taken=zero),
    )


@single_threaded
def first_look(recording: FrictionRecording) -> FirstLook:
    """Return the zero of the force and the shares of the way of a recording that moves to and fro."""
    loop = _Loop(thinned(recording, LOOK_SAMPLES))
    middle = 0.5 * (loop.force.max() + loop.force.min())
    starts = [
        np.array([-0.1, -0.1, np.log(stiffness), play, 0.0, zero])
        for zero, stiffness, play in itertools.product((0.0, middle), _STIFFNESSES, _PLAYS)
    ]
    starts.sort(key=lambda start: (loop.residuals(_inside(start)) ** 2).sum())
    best = min((loop.search(start) for start in starts[:_FINISHED]), key=lambda end: end.cost)
    # the weight of a sample is known only now: what is left over hangs together over many samples
    left = loop.law(best.x) + best.x[5] - loop.force
    variance = np.mean(left**2) * _correlated_samples(left)
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


def case_of(recording: FrictionRecording, look: FirstLook) -> Case | None:
    """Return the case that a recording is, or None where it slides and its force is of friction.

    A contact that never slips, mostly sticks, or mostly crosses a play, and a force that is not of friction:
    no coefficient is written to a specimen from any.
    """
    name, stroke = recording.name, np.ptp(recording.displacement)
    other = _other_cause(recording, look)
    if other:
        return Case(
            'not of friction',
            f'{name}: the force is not of friction: with spring and play it explains {look.explained:.0%} of '
            f'the mean square; {other}',
        )
    shares = (
        f'it slides on {look.sliding:.0%} of its way, sticks on {look.sticking:.0%}, crosses a play of '
        f'{2e3 * look.play:.2g} mm on {look.in_play:.0%}'
    )
    if look.sliding < NEVER:
        most = np.abs(recording.force - look.zero).max()
        return Case(
            'never slips',
            f'{name}: the contact never slips: {shares}; up to {most:.0f} N its spring of '
            f'{look.stiffness:.3g} N/m holds, so friction is larger than that, by an unknown amount; strokes '
            f'longer than {1e3 * stroke:.2g} mm, or a lower clamp, would make it slide',
        )
    idle = 2.0 * look.play + sum(look.limits) / look.stiffness
    longer = (
        f'the coefficient would rest on little; record strokes of {1e3 * _LONG * idle:.2g} mm or more '
        f'({_LONG:g} times the way of spring and play)'
    )
    if look.in_play > MOST:
        return Case('play dominates', f'{name}: play dominates: {shares}; {longer}, or take the play out')
    if look.sticking > MOST:
        return Case('mostly sticks', f'{name}: the contact mostly sticks: {shares}; {longer}')
    if look.sliding < MOST:
        return Case(
            'hardly slides', f'{name}: the contact slides on less than {MOST:.0%}: {shares}; {longer}'
        )
    return None


def _other_cause(recording: FrictionRecording, look: FirstLook) -> str:
    """Return what the force goes with instead of friction, in words; '' where friction explains it."""
    x, force = smoothed_displacement(recording), recording.force - look.zero
    velocity = np.gradient(x, recording.dt)
    motions = {
        'displacement': x - 0.5 * (x.max() + x.min()),
        'velocity': velocity,
        'acceleration': np.gradient(velocity, recording.dt),
    }
    shares = {name: (force @ each) ** 2 / ((each @ each) * (force @ force)) for name, each in motions.items()}
    most = max(shares, key=shares.__getitem__)
    better = 1.0 - shares[most] < _BETTER * (1.0 - look.explained)
    if look.explained >= EXPLAINED and not better:
        return ''
    if shares[most] >= EXPLAINED and better:
        return f'{most} explains {shares[most]:.0%}: {_REMEDIES[most]}'
    return (
        'neither displacement, velocity nor acceleration explains it either: is it the force of this motion, '
        'or noise of a cell that is hardly loaded (a contact that is loosely clamped)? Check both'
    )


def ladder_case(ladder: Mapping[str, Mapping[str, Any]], best: str) -> Case | None:
    """Return the case that a ladder is, by the errors of its best law; None where that one is of use."""
    training, held_out = ladder[best]['train_error'], ladder[best]['held_out_error']
    error = training if held_out is None else held_out
    if error <= EXPECTED_ERROR or (held_out is None and error <= LARGEST_ERROR):
        return None
    if error <= LARGEST_ERROR:
        return Case(
            'poorly predicted',
            f'{best} errs by {error:.1%} of what was held out (expected: up to {EXPECTED_ERROR:.0%}): a '
            'loosely clamped contact does, whose pressure is not that of the clamp, or one that changed in '
            'between; clamp it firmly, or measure the normal force',
        )
    if training > LARGEST_ERROR:
        return Case(
            'not explained',
            f'no law explains the force: the best, {best}, explains {explained(training):.0%} of its mean '
            'square in training already; use none of their parameters, and read above what each recording '
            'shows',
        )
    return Case(
        'not predicted',
        f'no law predicts the force: {best} explains {explained(training):.0%} of its mean square in '
        f'training and {explained(error):.0%} of what was held out; the contact is pressed by another force '
        'than the recorded normal force, or it changed in between: measure the normal force, or use '
        'recordings of one clamping; use none of these parameters',
    )


def explained(error: float) -> float:
    """Return the share of the force's mean square that a law explains, from its error rms over rms."""
    return max(0.0, 1.0 - error**2)
