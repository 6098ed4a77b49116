"""What `engine-mount identify friction` does: read, steps 1 to 3, ladder; everything but printing."""

import itertools
import math
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np

from mount_bags.run.place import recording_hash
from mount_identification.friction.coefficient_fit import VARIANTS, CoefficientFit, fit_coefficients
from mount_identification.friction.files import Channel, read_recording
from mount_identification.friction.kind import RAMP, SAWTOOTH, recognised
from mount_identification.friction.ladder import (
    Progress,
    Rung,
    all_laws,
    best_rung,
    fit_ladder,
    law_error,
)
from mount_identification.friction.ramp_hold import RampHoldFit, fit_ramp_hold, mean_contact
from mount_identification.friction.recording import FrictionRecording, IdentificationError
from mount_identification.friction.sawtooth import StrokeLine, stroke_lines
from mount_identification.friction.validation import ModelValidation, pooled_error, validate
from mount_models.friction.coefficient import FrictionCoefficients
from mount_models.friction.contact import FrictionContact

STEPS = ('auto', 'ramp', 'sawtooth', 'ladder')


@dataclass(frozen=True)
class IdentifyOrder:
    """Which recordings train, which are held out, which are tried in all ordered pairs; and how."""

    train: Sequence[Path] = ()
    held_out: Sequence[Path] = ()
    pairs: Sequence[Path] = ()
    step: str = 'auto'
    clamp: str = 'sliding'
    channels: dict[str, Channel] = field(default_factory=dict)
    seed: int = 0
    contact: FrictionContact = field(default_factory=FrictionContact)
    """Taken by step 2 where no ramp and hold tells it."""


@dataclass(frozen=True)
class PairResult:
    """The ladder trained on one recording and asked about another."""

    train: str
    held_out: str
    rungs: list[Rung]
    recording: FrictionRecording


@dataclass
class Identification:
    """All that was found; lists are empty where a step had no recordings."""

    recordings: dict[str, dict[str, Any]] = field(default_factory=dict)
    ramps: list[tuple[FrictionRecording, RampHoldFit]] = field(default_factory=list)
    contact: FrictionContact | None = None
    lines: list[StrokeLine] = field(default_factory=list)
    fits: list[tuple[CoefficientFit, float]] = field(default_factory=list)
    coefficients: FrictionCoefficients | None = None
    validations: list[tuple[FrictionRecording, ModelValidation]] = field(default_factory=list)
    rungs: list[Rung] = field(default_factory=list)
    held_out: list[FrictionRecording] = field(default_factory=list)
    pairs: list[PairResult] = field(default_factory=list)
    notes: list[str] = field(default_factory=list)


def identify(order: IdentifyOrder, progress: Progress | None = None) -> Identification:
    """Return what the recordings tell; raises `IdentificationError` before anything is written."""
    _check_order(order)
    found = Identification()
    if len(order.pairs) == 1:
        _try_halves(found, order, progress)
        return found
    if order.pairs:
        _try_pairs(found, order, progress)
        return found
    train, held_out = (
        _read(found, order.train, 'train', order),
        _read(found, order.held_out, 'held out', order),
    )
    ramps = [each for each, kind in train if kind == RAMP]
    moving = [each for each, kind in train if kind != RAMP]
    sawtooths = [each for each, kind in train if kind == SAWTOOTH]
    found.held_out = [each for each, kind in held_out if kind != RAMP]
    if ramps and order.step != 'ladder':
        found.ramps = [(each, fit_ramp_hold(each)) for each in ramps]
        found.contact = mean_contact([fit for _, fit in found.ramps])
    if sawtooths and order.step in ('auto', 'sawtooth'):
        _coefficients(found, sawtooths, order.contact)
    if order.step in (RAMP, SAWTOOTH) or not moving:
        return found
    known = (
        (found.contact, found.coefficients)
        if found.contact is not None and found.coefficients is not None
        else None
    )
    found.rungs = fit_ladder(
        moving, found.held_out, laws=all_laws(moving, known), progress=progress, seed=order.seed
    )
    if not found.held_out:
        found.notes.append('no recording is held out: training errors alone do not tell which law to take')
    return found


def figures(found: Identification) -> dict[str, Any]:
    """Return everything as plain numbers and texts, for JSON."""
    result: dict[str, Any] = {'recordings': found.recordings, 'notes': found.notes}
    if found.ramps:
        result['step_1'] = [_ramp_figures(fit) for _, fit in found.ramps]
    if found.contact is not None:
        result['contact'] = found.contact._asdict()
    if found.lines:
        result['lines'] = [
            {
                'recording': line.recording, 'velocity': line.velocity, 'normal_force': line.normal_force,
                'a': line.a, 'a_interval': line.a_interval, 'b_per_mm': 1e-3 * line.b,
                'b_interval_per_mm': 1e-3 * line.b_interval,
            }
            for line in found.lines
        ]  # fmt: skip
    if found.coefficients is not None:
        result['coefficients'] = found.coefficients._asdict()
        result['variants'] = {
            fit.variant: {'held_out_error': _known(error), 'a_rms': fit.a_rms, 'b_rms_per_mm': fit.b_rms_mm}
            for fit, error in found.fits
        }
    if found.validations:
        result['validation'] = [
            {
                'recording': each.name,
                'full_error': each.full_error,
                'simplified_error': each.simplified_error,
                'full_macroslip_error': each.full_macroslip,
                'simplified_macroslip_error': each.simplified_macroslip,
            }
            for _, each in found.validations
        ]
    if found.rungs:
        result['ladder'] = _ladder(found.rungs)
        result['best'] = best_rung(found.rungs).law.name
    if found.pairs:
        result['pairs'] = [
            {'train': pair.train, 'held_out': pair.held_out, 'ladder': _ladder(pair.rungs)}
            for pair in found.pairs
        ]
        result['ladder'] = mean_ladder(found.pairs)
        result['best'] = min(result['ladder'], key=lambda name: result['ladder'][name]['held_out_error'])
    return result


def chosen_fit(found: Identification) -> CoefficientFit:
    """Return the fit of the coefficients that the held-out recordings chose; refused where there is none."""
    if found.contact is None or not found.fits:
        raise IdentificationError(
            '--out needs the coefficients (sawtooths at several speeds) and the contact (a ramp and hold, or '
            f'that of --base); the {"ramp" if found.fits else "sawtooth"} is missing: add such recordings to '
            '--train, and leave --step to auto'
        )
    return min(found.fits, key=lambda each: 0.0 if math.isnan(each[1]) else each[1])[0]


def mean_ladder(pairs: Sequence[PairResult]) -> dict[str, dict[str, Any]]:
    """Return each law's mean errors over all pairs and its worst, and the parameters of each training."""
    result: dict[str, dict[str, Any]] = {}
    for place, rung in enumerate(pairs[0].rungs):
        same = [(pair, pair.rungs[place]) for pair in pairs]
        result[rung.law.name] = {
            'train_error': float(np.mean([each.train_error for _, each in same])),
            'held_out_error': float(np.mean([each.held_out_error for _, each in same])),
            'worst_held_out_error': max(each.held_out_error for _, each in same),
            'parameters': {pair.train: each.named_values for pair, each in same},
        }
    return result


def _check_order(order: IdentifyOrder) -> None:
    if order.step not in STEPS:
        raise IdentificationError(f'--step {order.step!r} must be one of {", ".join(STEPS)}')
    if order.pairs and (order.train or order.held_out):
        raise IdentificationError(
            '--file tries all pairs of its files; give it alone, or --train and --held-out'
        )
    if not order.pairs and not order.train:
        raise IdentificationError(
            '0 recordings to train with; give --train FILE..., or --file FILE... for all pairs'
        )
    both = {each.resolve() for each in order.train} & {each.resolve() for each in order.held_out}
    if both:
        raise IdentificationError(
            f'{sorted(both)[0].name} is among --train and --held-out; a held-out recording must be unseen: '
            'leave it out on one side'
        )


def _read(
    found: Identification, paths: Sequence[Path], part: str, order: IdentifyOrder
) -> list[tuple[FrictionRecording, str]]:
    result = []
    for path in paths:
        recording = read_recording(path, order.channels, order.clamp)
        kind = recognised(recording)
        if order.step in (RAMP, SAWTOOTH) and part == 'train':
            _check_kind(recording.name, kind, order.step)
        key = path.name if path.name not in found.recordings else str(path)
        digest = recording_hash(path)
        _check_unseen(found, key, digest)
        found.recordings[key] = {'part': part, 'kind': kind, 'sha256': digest}
        found.notes += [f'{recording.name}: {note}' for note in recording.notes]
        result.append((recording, kind))
    return result


def _check_unseen(found: Identification, key: str, digest: str) -> None:
    for other, entry in found.recordings.items():
        if entry['sha256'] == digest:
            raise IdentificationError(
                f'{key} and {other} ({entry["part"]}) are the same to the bit; a held-out recording must be '
                'unseen, and none counts twice: give each recording once'
            )


def _check_kind(name: str, kind: str, step: str) -> None:
    if kind != step and not (step == SAWTOOTH and kind == RAMP):
        raise IdentificationError(
            f'{name} looks like {kind}, not like {step}; leave --step to auto, or choose another file'
        )


def _coefficients(
    found: Identification, sawtooths: Sequence[FrictionRecording], unless_told: FrictionContact
) -> None:
    """Steps 2 and 3; held-out recordings choose the form of b."""
    contact = found.contact
    if contact is None:
        contact = found.contact = unless_told
        found.notes.append(
            'no ramp and hold among the training: step 2 takes the contact of the base (c_R '
            f'{contact.tangential_stiffness:.3g} N/m, d_R {contact.tangential_damping:.3g} N s/m, c_Re '
            f'{contact.contact_stiffness:.3g} N/m)'
        )
    found.lines = [line for each in sawtooths for line in stroke_lines(each, contact)]
    for variant in VARIANTS if found.held_out else VARIANTS[:1]:
        fit = fit_coefficients(found.lines, variant)
        error = math.nan
        if found.held_out:
            tried = [validate(each, contact, fit.coefficients) for each in found.held_out]
            error = pooled_error(tried, found.held_out)
        found.fits.append((fit, error))
    found.coefficients = chosen_fit(found).coefficients
    found.validations = [(each, validate(each, contact, found.coefficients)) for each in found.held_out]


def _try_halves(found: Identification, order: IdentifyOrder, progress: Progress | None) -> None:
    ((whole, kind),) = _read(found, order.pairs, 'first half train, second half held out', order)
    if kind == RAMP:
        raise IdentificationError(
            f'{whole.name} is a ramp that is held, of which one half tells nothing of the other; give it to '
            '--train, or give --file a recording that moves to and fro'
        )
    middle = whole.force.size // 2
    first, second = (
        replace(
            whole, name=f'{whole.name}, {label} half', displacement=whole.displacement[part],
            force=whole.force[part], normal_force=whole.normal_force[part], desired_displacement=None,
        )
        for label, part in (('first', slice(None, middle)), ('second', slice(middle, None)))
    )  # fmt: skip
    found.held_out = [second]
    found.rungs = fit_ladder([first], [second], progress=progress, seed=order.seed)
    found.notes.append(
        f'one recording: its first half ({first.force.size * first.dt:.3g} s) trains, its second half is '
        'held out; that says less than a recording of another day, speed or load would'
    )


def _try_pairs(found: Identification, order: IdentifyOrder, progress: Progress | None) -> None:
    recordings = [each for each, kind in _read(found, order.pairs, 'both', order) if kind != RAMP]
    if len(recordings) < 2:
        raise IdentificationError(
            f'{len(recordings)} of the recordings move to and fro; the ladder needs at least 2'
        )
    trained = {}
    for number, one in enumerate(recordings):

        def share(law: str, done: float, number: int = number, name: str = one.name) -> None:
            if progress is not None:
                progress(f'{name}: {law}', done)

        trained[number] = fit_ladder([one], [], progress=share, seed=order.seed)
    for one, other in itertools.permutations(range(len(recordings)), 2):
        rungs = [
            Rung(
                each.law, each.values, each.train_error,
                law_error(each.law, each.values, [recordings[other]]), each.seconds, each.out_of_time,
            )
            for each in trained[one]
        ]  # fmt: skip
        found.pairs.append(PairResult(recordings[one].name, recordings[other].name, rungs, recordings[other]))


def _ladder(rungs: Sequence[Rung]) -> dict[str, dict[str, Any]]:
    return {
        each.law.name: {
            'train_error': each.train_error,
            'held_out_error': _known(each.held_out_error),
            'parameters': each.named_values,
            'units': {entry.name: entry.quantity.unit for entry in each.law.parameters},
            'seconds': each.seconds,
            'out_of_time': each.out_of_time,
        }
        for each in rungs
    }


def _ramp_figures(fit: RampHoldFit) -> dict[str, Any]:
    printed = fit.printed
    c_r, d_r, c_re = fit.contact
    return {
        'recording': fit.name,
        'contact': fit.contact._asdict(),
        'deviation': fit.deviation._asdict(),
        'machine_stiffness': fit.machine_stiffness,
        'time_constant': fit.time_constant,
        'kappa': fit.kappa,
        'ramp_start': fit.ramp_start,
        'ramp_time': fit.ramp_time,
        'force_misfit': fit.force_misfit,
        'displacement_misfit': fit.displacement_misfit,
        'printed': {
            'contact_stiffness': _beside(printed.contact_stiffness, c_re),
            'tangential_stiffness_c_xi_with_p': _beside(printed.tangential_stiffness_with_p, c_r),
            'tangential_stiffness_c_xi_without_p': _beside(printed.tangential_stiffness_without_p, c_r),
            'tangential_damping': _beside(printed.tangential_damping, d_r),
        },
    }


def _beside(printed: float, right: float) -> dict[str, float]:
    return {'value': printed, 'error': printed / right - 1.0}


def _known(value: float) -> float | None:
    return None if math.isnan(value) else value
