"""Recordings that determine no coefficient of friction, named in words: what was seen, and what to do.

A contact that never slips, mostly sticks, or mostly crosses a play; a force that is not of friction; a ladder
none of whose laws explains, or predicts, the force. No coefficient is written to a specimen from any.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from engine_mount.identification.friction.look import FirstLook
from engine_mount.identification.friction.recording import FrictionRecording, smoothed_displacement

NEVER = 0.02
"""Share of the way below which a contact does not slide (chosen)."""
MOST = 0.5
"""Share of the way above which sticking, or play, is what is seen (chosen)."""
EXPLAINED = 0.6
"""Share of a force's mean square about its zero that friction with spring and play must explain (chosen)."""
LARGEST_ERROR = 0.35
"""Error, rms over rms, above which no law of the ladder counts (chosen): an eighth of the square."""
_BETTER = 1.0 / 3.0  # of what friction leaves over: so little another motion must leave, chosen
_LONG = 4.0  # so many times the way to and fro that is not sliding makes a stroke, chosen
_REMEDIES = {
    'displacement': 'a spring beside the contact, or the rack itself; measure it unclamped and subtract it',
    'velocity': 'a viscous part; measure it unclamped and subtract it',
    'acceleration': 'the mass between cell and contact; move more slowly, or subtract its force',
}


@dataclass(frozen=True)
class Case:
    """What was seen, in two words, and a sentence with its figures and a remedy."""

    kind: str
    sentence: str


def case_of(recording: FrictionRecording, look: FirstLook) -> Case | None:
    """Return the case that a recording is, or None where it slides and its force is of friction."""
    name, stroke = recording.name, float(np.ptp(recording.displacement))
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
        most = float(np.abs(recording.force - look.zero).max())
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
    return None


def ladder_case(ladder: Mapping[str, Mapping[str, Any]]) -> Case | None:
    """Return the case that a ladder is, by the errors of its best law; None where that one is of use."""
    if not ladder:
        return None
    held_out = all(entry['held_out_error'] is not None for entry in ladder.values())
    judged = 'held_out_error' if held_out else 'train_error'
    name = min(ladder, key=lambda each: float(ladder[each][judged]))
    training, error = float(ladder[name]['train_error']), float(ladder[name][judged])
    if error <= LARGEST_ERROR:
        return None
    if training > LARGEST_ERROR:
        return Case(
            'not explained',
            f'no law explains the force: the best, {name}, explains {explained(training):.0%} of its mean '
            'square in training already; use none of their parameters, and read above what each recording '
            'shows',
        )
    return Case(
        'not predicted',
        f'no law predicts the force: {name} explains {explained(training):.0%} of its mean square in '
        f'training and {explained(error):.0%} of what was held out; the contact is pressed by another force '
        'than the recorded normal force, or it changed in between: measure the normal force, or use '
        'recordings of one clamping; use none of these parameters',
    )


def explained(error: float) -> float:
    """Return the share of the force's mean square that a law explains, from its error rms over rms."""
    return max(0.0, 1.0 - error**2)


def _other_cause(recording: FrictionRecording, look: FirstLook) -> str:
    """Return what the force goes with instead of friction, in words; '' where friction explains it."""
    x, force = smoothed_displacement(recording), recording.force - look.zero
    velocity = np.gradient(x, recording.dt)
    motions = {
        'displacement': x - 0.5 * (x.max() + x.min()),
        'velocity': velocity,
        'acceleration': np.gradient(velocity, recording.dt),
    }
    shares = {
        name: float(force @ each) ** 2 / (float(each @ each) * float(force @ force))
        for name, each in motions.items()
    }
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
