"""Where the zero of a force sensor is taken from, and doubts about it in words.

At rest a damper may stick, with a force of its own, so what a cell reads there is not its zero. The loop
tells it (`first_look`): that is 'law'. 'rest' is the mean of the rest before the motion, 'recorded' leaves
it alone.
"""

from dataclasses import replace

import numpy as np

from engine_mount.identification.friction.looks.first_look import FirstLook, first_look
from engine_mount.identification.friction.recording import FrictionRecording, IdentificationError

ZEROS = ('law', 'rest', 'recorded')
DOUBTED = 3.0
"""Deviations by which two zeros must differ to be doubted (chosen)."""
_REST = 0.1  # s at the beginning
_AT_REST = 0.01  # of the range of displacement


def zeroed(recording: FrictionRecording, zero_from: str = '') -> tuple[FrictionRecording, FirstLook]:
    """Return the recording with the zero of its force taken away, said in a note; and its first look.

    `zero_from` is one of `ZEROS`, or '' for what the recording's kind of file takes. Raises
    `IdentificationError` for another word, and for 'rest' without any.
    """
    wanted = zero_from or recording.zero_from
    if wanted not in ZEROS:
        raise IdentificationError(f'--zero {wanted!r} must be one of {", ".join(ZEROS)}')
    look = first_look(recording)
    rest = rest_force(recording)
    if wanted == 'rest':
        if rest is None:
            raise IdentificationError(
                f'{recording.name}: the displacement moves within the first {_REST:g} s, so there is no '
                'rest to '
                'take the zero of the force from; choose --zero law or recorded'
            )
        zero, note = rest, _of_rest(rest, look)
    elif wanted == 'law':
        zero, note = (look.zero, _of_law(look, rest)) if look.known else (0.0, _untold(look))
    else:
        zero, note = 0.0, _of_recorded(look)
    notes = (*recording.notes, *([note] if note else []))
    return (
        replace(recording, force=recording.force - zero, notes=notes),
        replace(look, zero=look.zero - zero, taken=zero, rest=rest),
    )


def rest_force(recording: FrictionRecording) -> float | None:
    """Return the mean force (N) of the rest at the beginning; None where there is none."""
    quiet = recording.time <= _REST
    x = recording.displacement
    if np.ptp(x[quiet]) > _AT_REST * np.ptp(x):
        return None
    return float(recording.force[quiet].mean())


def _of_law(look: FirstLook, rest: float | None) -> str:
    told = f'force zero {_told(look)}, from the loop'
    if rest is None:
        return told
    if abs(rest - look.zero) <= DOUBTED * look.deviation:
        return f'{told}; the rest before the motion agrees ({rest:.0f} N)'
    return (
        f'{told}; the rest before the motion reads {rest:.0f} N, '
        f'{abs(rest - look.zero) / look.deviation:.0f} '
        'deviations from it: there the contact may stick with a force of its own, so the rest is not taken '
        '(--zero rest would)'
    )


def _of_rest(rest: float, look: FirstLook) -> str:
    told = f'force zero {rest:.1f} N, from the {_REST:g} s of rest at the beginning'
    if look.known and abs(rest - look.zero) > DOUBTED * look.deviation:
        told += (
            f'; doubtful: the loop says {_told(look)}, and at rest a contact may stick; --zero law takes that'
        )
    return told


def _of_recorded(look: FirstLook) -> str:
    if not look.known or abs(look.zero) <= DOUBTED * look.deviation:
        return ''
    return (
        f'force zero as recorded; doubtful: by the loop it is off by {_told(look)}; --zero law takes it away'
    )


def _untold(look: FirstLook) -> str:
    return (
        f'force zero as recorded: the loop tells it only to +- {look.deviation:.0f} N, and what is read '
        'at rest '
        'may be a force that the contact holds; unclamp the damper once and read the cell then'
    )


def _told(look: FirstLook) -> str:
    return f'{look.zero:.0f} +- {look.deviation:.0f} N'
