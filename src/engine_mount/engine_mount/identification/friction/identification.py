"""Friction from recordings: read, steps 1 to 3, ladder; everything but printing."""

import functools
import itertools
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

from engine_mount.identification.fitting import IdentificationError, Progress, silent
from engine_mount.identification.friction.cases import case_of
from engine_mount.identification.friction.coefficients import VARIANTS, fit_coefficients
from engine_mount.identification.friction.files import read_recording
from engine_mount.identification.friction.ladder import Rung, fit_ladder, law_error
from engine_mount.identification.friction.look import subtract_zero
from engine_mount.identification.friction.pad_law import all_laws
from engine_mount.identification.friction.ramp_hold import fit_ramp_hold, mean_contact
from engine_mount.identification.friction.recording import FrictionRecording
from engine_mount.identification.friction.result import FrictionIdentification, Pair
from engine_mount.identification.friction.sawtooth import RAMP, SAWTOOTH, kind_of_motion, stroke_lines
from engine_mount.identification.friction.validation import pooled_error, validate
from engine_mount.recordings.place import recording_hash
from engine_mount.signals.mapping import Mapping
from mount_models.specimen import Specimen, friction_contact

STEPS = ('auto', RAMP, SAWTOOTH, 'ladder')


def identify_friction(
    base: Specimen,
    train: Sequence[Path] = (),
    held_out: Sequence[Path] = (),
    files: Sequence[Path] = (),
    step: str = 'auto',
    clamp: str = 'sliding',
    zero: str = '',
    mapping: Mapping | None = None,
    seed: int = 0,
    progress: Progress = silent,
) -> FrictionIdentification:
    """Return what the recordings show; see `engine_mount.identification.identify.friction`."""
    _check_order(train, held_out, files, step)
    result = FrictionIdentification(base)
    read = functools.partial(_read, result, step=step, clamp=clamp, zero=zero, mapping=mapping)
    if len(files) == 1:
        (recording,) = read(files, 'first half train, second half held out')
        _try_halves(result, recording, progress, seed)
        return result
    if files:
        _try_pairs(result, _moving(read(files, 'both')), progress, seed)
        return result
    training = read(train, 'train')
    result.held_out = _moving(read(held_out, 'held out'))
    ramps = [each for each, kind in training if kind == RAMP]
    sawtooths = [each for each, kind in training if kind == SAWTOOTH]
    if step != 'ladder':
        result.ramps = [fit_ramp_hold(each) for each in ramps]
        if ramps:
            result.contact, _ = mean_contact(result.ramps)
        if sawtooths and step != RAMP:
            _fit_coefficients(result, sawtooths)
    moving = _moving(training)
    if step in (RAMP, SAWTOOTH) or not moving:
        return result
    coefs, contact = result.coefficients, result.contact
    known = (contact, coefs) if contact is not None and coefs is not None else None
    result.rungs = fit_ladder(all_laws(moving, known), moving, result.held_out, progress, seed)
    if not result.held_out:
        result.notes.append('no recording is held out: training errors alone do not show which law to use')
    return result


def _check_order(train: Sequence[Path], held_out: Sequence[Path], files: Sequence[Path], step: str) -> None:
    """Raise `IdentificationError` for arguments that contradict each other."""
    if step not in STEPS:
        raise IdentificationError(f'--step {step!r} must be one of {", ".join(STEPS)}')
    if files and (train or held_out):
        raise IdentificationError(
            '--file tries all pairs of its files; give it alone, or --train and --held-out'
        )
    if not files and not train:
        raise IdentificationError(
            '0 recordings to train with; give --train FILE..., or --file FILE... for all pairs'
        )
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
) -> list[tuple[FrictionRecording, str]]:
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


def _moving(recordings: Sequence[tuple[FrictionRecording, str]]) -> list[FrictionRecording]:
    return [each for each, kind in recordings if kind != RAMP]


def _fit_coefficients(result: FrictionIdentification, sawtooths: Sequence[FrictionRecording]) -> None:
    """Steps 2 and 3; held-out recordings choose the form of b."""
    contact = result.contact
    if contact is None:
        contact = result.contact = friction_contact(result.base.friction)
        result.notes.append(
            'no ramp and hold among the training: step 2 uses the contact of the base (c_R '
            f'{contact.tangential_stiffness:.3g} N/m, d_R {contact.tangential_damping:.3g} N s/m, c_Re '
            f'{contact.contact_stiffness:.3g} N/m)'
        )
    result.lines = [line for each in sawtooths for line in stroke_lines(each, contact)]
    tried = []
    for variant in VARIANTS if result.held_out else VARIANTS[:1]:
        fit = fit_coefficients(result.lines, variant)
        tried.append([validate(each, contact, fit.coefficients) for each in result.held_out])
        if result.held_out:
            fit = replace(fit, held_out_error=pooled_error(tried[-1]))
        result.fits.append(fit)
        if result.fit is fit:
            result.validations = tried[-1]


def _try_halves(
    result: FrictionIdentification, recording: tuple[FrictionRecording, str], progress: Progress, seed: int
) -> None:
    whole, kind = recording
    if kind == RAMP:
        raise IdentificationError(
            f'{whole.name} is a ramp that is held, of which one half shows nothing of the other; give it to '
            '--train, or give --file a recording that moves to and fro'
        )
    middle = whole.force.size // 2
    first, second = (
        replace(
            whole,
            name=f'{whole.name}, {label} half',
            displacement=whole.displacement[part],
            force=whole.force[part],
            normal_force=whole.normal_force[part],
            desired_displacement=None,
        )
        for label, part in (('first', slice(None, middle)), ('second', slice(middle, None)))
    )
    result.held_out = [second]
    result.rungs = fit_ladder(all_laws([first]), [first], [second], progress, seed)
    result.notes.append(
        f'one recording: its first half ({first.force.size * first.dt:.3g} s) trains, its second half is '
        'held out; that shows less than a recording of another day, speed or load would'
    )


def _try_pairs(
    result: FrictionIdentification, recordings: list[FrictionRecording], progress: Progress, seed: int
) -> None:
    if len(recordings) < 2:
        raise IdentificationError(
            f'{len(recordings)} of the recordings move to and fro; the ladder needs at least 2'
        )

    def fit(one: FrictionRecording) -> list[Rung]:
        def named(share: float, law: str) -> None:
            progress(share, f'{one.name}: {law}')

        return fit_ladder(all_laws([one]), [one], [], named, seed)

    ladders = [fit(each) for each in recordings]
    for (one, ladder), (other, _) in itertools.permutations(zip(recordings, ladders, strict=True), 2):
        rungs = [replace(each, held_out_error=law_error(each.law, each.values, [other])) for each in ladder]
        result.pairs.append(Pair(one.name, other, rungs))
