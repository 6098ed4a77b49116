"""Identify from recordings: `friction` of the pads on a rack, `pads` of a car over its life.

Each returns a result with `figures()` in SI units, `report(screen)` for people and `draw(file)`,
that of `friction` a `specimen(name)` too. Its laws and its checks: `engine_mount.identification.friction`.
"""

import functools
import os
from collections.abc import Sequence
from pathlib import Path

from engine_mount.identification.fitting import IdentificationError, Progress, silent
from engine_mount.identification.friction.coefficients import fit_coefficients
from engine_mount.identification.friction.files import friction_mapping, read_recording
from engine_mount.identification.friction.ladder import fit_ladder
from engine_mount.identification.friction.laws import all_laws
from engine_mount.identification.friction.ramp_hold import fit_ramp_hold, mean_contact
from engine_mount.identification.friction.recording import FrictionRecording
from engine_mount.identification.friction.result import FrictionIdentification, validate
from engine_mount.identification.friction.sawtooth import RAMP, SAWTOOTH, kind_of_motion, stroke_lines
from engine_mount.identification.friction.screening import case_of, subtract_zero
from engine_mount.identification.pads import pads as pads
from engine_mount.recordings.recording import recording_hash
from engine_mount.signals.mapping import Mapping
from mount_models.quantity import nearest
from mount_models.specimen import chosen_specimen, friction_contact

STEPS = ('auto', RAMP, SAWTOOTH, 'ladder')
_Place = str | os.PathLike[str]
_Recordings = list[tuple[FrictionRecording, str]]


def friction(
    train: Sequence[_Place] = (),
    held_out: Sequence[_Place] = (),
    *,
    step: str = 'auto',
    clamp: str = 'sliding',
    zero: str = '',
    columns: Mapping | dict[str, str] | None = None,
    seed: int = 0,
    base: _Place = '',
    progress: Progress = silent,
) -> FrictionIdentification:
    """Return the friction contact in recordings, and which law is worth its parameters.

    Laws are fitted to `train` and judged by `held_out`. `step` is auto, or only ramp (step 1), sawtooth or
    ladder; `clamp` is the normal force of a damper's JSON (sliding, rest, none), `zero` the source of the
    zero of the force (law, recorded; '' for the default of each kind of file). `columns` is {quantity:
    'COLUMN:UNIT'}. `base` is the specimen file that gives all other values, the shipped one without. Raises
    `IdentificationError` and the readers' errors.
    """
    if isinstance(columns, dict):
        columns = friction_mapping([f'{name}={text}' for name, text in columns.items()])
    seen, unseen = ([Path(place) for place in places] for places in (train, held_out))
    _check_order(seen, unseen, step)
    result = FrictionIdentification(chosen_specimen(str(base)))
    read = functools.partial(_read, result, step=step, clamp=clamp, zero=zero, mapping=columns)
    training = read(seen, 'train')
    result.held_out = _moving(read(unseen, 'held out'))
    sawtooths = [each for each, kind in training if kind == SAWTOOTH]
    if step != 'ladder':
        result.ramps = [fit_ramp_hold(each) for each, kind in training if kind == RAMP]
        if result.ramps:
            result.contact, _ = mean_contact(result.ramps)
        if sawtooths and step != RAMP:
            _fit_coefficients(result, sawtooths)
    moving = _moving(training)
    if step in (RAMP, SAWTOOTH) or not moving:
        return result
    known = (result.contact, result.fit.coefficients) if result.contact and result.fit else None
    result.rungs = fit_ladder(all_laws(moving, known), moving, result.held_out, progress, seed)
    if not result.held_out:
        result.notes.append('no recording is held out: training errors alone do not show which law to use')
    return result


def _check_order(train: Sequence[Path], held_out: Sequence[Path], step: str) -> None:
    """Raise `IdentificationError` for arguments that contradict each other."""
    if step not in STEPS:
        raise IdentificationError(f'--step {step!r} is unknown; {nearest(step, STEPS)}')
    if not train:
        raise IdentificationError('0 recordings to train with; give --train FILE...')
    both = {each.resolve() for each in train} & {each.resolve() for each in held_out}
    if both:
        raise IdentificationError(
            f'{min(both).name} is among --train and --held-out; a held-out recording must be unseen: leave '
            'it out on one side'
        )


def _read(
    result: FrictionIdentification,
    paths: Sequence[Path],
    part: str,
    step: str,
    clamp: str,
    zero: str,
    mapping: Mapping | None,
) -> _Recordings:
    """Return the recordings with their kinds; hash, first look, cases and notes go into `result`."""
    recordings = []
    for path in paths:
        recording = read_recording(path, mapping, clamp)
        kind = kind_of_motion(recording)
        # a ramp among sawtooths gives their contact
        if part == 'train' and kind != step and step in (RAMP, SAWTOOTH) and (step, kind) != (SAWTOOTH, RAMP):
            raise IdentificationError(
                f'{recording.name} looks like {kind}, not like {step}; leave --step to auto, or choose '
                'another file'
            )
        key = path.name if path.name not in result.recordings else str(path)
        digest = recording_hash(path)
        for other, entry in result.recordings.items():
            if entry['sha256'] == digest:
                raise IdentificationError(
                    f'{key} and {other} ({entry["part"]}) are the same to the bit; a held-out recording must '
                    'be unseen, and none counts twice: give each recording once'
                )
        result.recordings[key] = {'part': part, 'kind': kind, 'sha256': digest}
        if kind != RAMP:
            recording, result.looks[key] = subtract_zero(recording, zero)
            case = case_of(recording, result.looks[key])
            result.cases += [case] if case else []
        result.notes += [f'{recording.name}: {note}' for note in recording.notes]
        recordings.append((recording, kind))
    return recordings


def _moving(recordings: _Recordings) -> list[FrictionRecording]:
    return [each for each, kind in recordings if kind != RAMP]


def _fit_coefficients(result: FrictionIdentification, sawtooths: Sequence[FrictionRecording]) -> None:
    """Steps 2 and 3, and their validation on held-out recordings."""
    contact = result.contact
    if contact is None:
        contact = result.contact = friction_contact(result.base.friction)
        result.notes.append(
            'no ramp and hold among the training: step 2 uses the contact of the base (c_R '
            f'{contact.tangential_stiffness:.3g} N/m, d_R {contact.tangential_damping:.3g} N s/m, c_Re '
            f'{contact.contact_stiffness:.3g} N/m)'
        )
    result.lines = [line for each in sawtooths for line in stroke_lines(each, contact)]
    result.fit = fit_coefficients(result.lines)
    result.validations = [validate(each, contact, result.fit.coefficients) for each in result.held_out]
