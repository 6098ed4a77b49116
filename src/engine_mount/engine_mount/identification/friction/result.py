"""What an identification of friction found: figures, tables, picture, and the specimen made of it."""

from collections.abc import Sequence
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from engine_mount.identification.fitting import IdentificationError
from engine_mount.identification.friction.cases import Case, explained, ladder_case
from engine_mount.identification.friction.coefficients import CoefficientFit
from engine_mount.identification.friction.ladder import Rung
from engine_mount.identification.friction.look import FirstLook
from engine_mount.identification.friction.ramp_hold import RampHoldFit, mean_contact
from engine_mount.identification.friction.recording import FrictionRecording
from engine_mount.identification.friction.sawtooth import StrokeLine
from engine_mount.identification.friction.validation import ModelValidation
from engine_mount.identification.specimen import rounded, with_part
from engine_mount.recordings.screen import Screen, Table
from mount_models.friction.coefficient import FrictionCoefficients
from mount_models.friction.contact import FrictionContact
from mount_models.specimen import Specimen


@dataclass(frozen=True)
class Pair:
    """The ladder trained on one recording and tried on another."""

    train: str
    recording: FrictionRecording
    rungs: list[Rung]


@dataclass
class FrictionIdentification:
    """All that was found; lists are empty where a step had no recordings.

    `recordings` holds part, kind and SHA-256 of each, `looks` go by recording too. `fits` are the forms of b.
    `cases` keep a coefficient of friction from being written. `contact` is that of the `base` where no ramp
    was recorded.
    """

    base: Specimen
    recordings: dict[str, dict[str, Any]] = field(default_factory=dict)
    ramps: list[RampHoldFit] = field(default_factory=list)
    contact: FrictionContact | None = None
    lines: list[StrokeLine] = field(default_factory=list)
    fits: list[CoefficientFit] = field(default_factory=list)
    validations: list[ModelValidation] = field(default_factory=list)
    rungs: list[Rung] = field(default_factory=list)
    held_out: list[FrictionRecording] = field(default_factory=list)
    pairs: list[Pair] = field(default_factory=list)
    looks: dict[str, FirstLook] = field(default_factory=dict)
    cases: list[Case] = field(default_factory=list)
    notes: list[str] = field(default_factory=list)

    @property
    def fit(self) -> CoefficientFit | None:
        """The fit of the coefficients that the held-out recordings chose."""
        return min(self.fits, key=lambda each: np.nan_to_num(each.held_out_error), default=None)

    @property
    def coefficients(self) -> FrictionCoefficients | None:
        """The coefficients of that fit."""
        return self.fit.coefficients if self.fit else None

    def ladder(self) -> dict[str, dict[str, Any]]:
        """Return the errors and parameters of each law; over pairs the mean errors, and the worst."""
        if not self.pairs:
            return _ladder_figures(self.rungs)
        result = {}
        for same in zip(*(pair.rungs for pair in self.pairs), strict=True):
            held_out = [each.held_out_error for each in same]
            result[same[0].law.name] = {
                'train_error': float(np.mean([each.train_error for each in same])),
                'held_out_error': float(np.mean(held_out)),
                'worst_held_out_error': max(held_out),
                'explained': float(np.mean([explained(error) for error in held_out])),
                'parameters': {
                    pair.train: each.parameters for pair, each in zip(self.pairs, same, strict=True)
                },
            }
        return result

    def figures(self) -> dict[str, Any]:
        """Return everything as plain numbers and texts, for JSON; SI units but where the name has another."""
        result: dict[str, Any] = {'recordings': self.recordings, 'notes': self.notes}
        if self.looks:
            result['looks'] = {name: asdict(look) for name, look in self.looks.items()}
        if self.ramps:
            result['step_1'] = [_ramp_figures(fit) for fit in self.ramps]
        if self.contact is not None:
            result['contact'] = self.contact._asdict()
        if self.lines:
            names = ('recording', 'velocity', 'normal_force', 'a', 'a_interval')
            result['lines'] = [
                {name: getattr(line, name) for name in names}
                | {'b_per_mm': 1e-3 * line.b, 'b_interval_per_mm': 1e-3 * line.b_interval}
                for line in self.lines
            ]
        if self.coefficients is not None:
            result['coefficients'] = self.coefficients._asdict()
            result['variants'] = {
                fit.variant: {
                    'held_out_error': _known(fit.held_out_error),
                    'a_rms': fit.a_rms,
                    'b_rms_per_mm': fit.b_rms_mm,
                }
                for fit in self.fits
            }
        if self.validations:
            result['validation'] = [
                {'recording': each.recording.name}
                | {name: value for name, value in vars(each).items() if name.endswith('_error')}
                for each in self.validations
            ]
        ladder = self.ladder()
        if ladder:
            result['ladder'] = ladder
            judged = 'train_error' if self.rungs and not self.held_out else 'held_out_error'
            result['best'] = min(ladder, key=lambda name: ladder[name][judged])
        if self.pairs:
            result['pairs'] = [
                {
                    'train': pair.train,
                    'held_out': pair.recording.name,
                    'ladder': _ladder_figures(pair.rungs),
                }
                for pair in self.pairs
            ]
        case = ladder_case(ladder)
        result['cases'] = [asdict(each) for each in (*self.cases, *([case] if case else []))]
        return result

    def report(self, screen: Screen) -> None:
        """Show notes, steps, ladder and what keeps a coefficient from being written."""
        for sentence in self.notes:
            screen.note(sentence)
        result, fit = self.figures(), self.fit
        if self.ramps:
            rows = [
                (
                    each.recording.name,
                    *(
                        f'{value:.4g} ± {std:.1g}'
                        for value, std in zip(each.contact, each.deviation, strict=True)
                    ),
                    f'{each.response.machine_stiffness:.4g}',
                    f'{each.response.time_constant:.4f}',
                )
                for each in self.ramps
            ]
            heads = ('step 1', 'c_R (N/m)', 'd_R (N s/m)', 'c_Re (N/m)', 'p (N/m)', 'T (s)')
            screen.table(Table('', 'lrrrrr', rows, heads))
        if fit is not None:
            screen.say(
                f'steps 2, 3: {len(self.lines)} strokes; Eqs (13), (14) meet them within {fit.a_rms:.4f} (a) '
                f'and {fit.b_rms_mm:.2f} 1/mm (b) rms'
            )
            for each in self.fits if self.held_out else []:
                screen.say(f'  form of b: {each.variant}: {_percent(each.held_out_error)} held out')
        for validation in self.validations:
            screen.say(
                f'held out {validation.recording.name}: full model {_percent(validation.full_error)}, '
                f'simplified {_percent(validation.simplified_error)}; macroslip '
                f'{_percent(validation.full_macroslip_error)}, '
                f'{_percent(validation.simplified_macroslip_error)}'
            )
        if self.pairs:
            screen.table(self._pair_table())
        if 'ladder' in result:
            screen.table(_ladder_table(result['ladder']))
            screen.say(f'best: {result["best"]}')
        for case in result['cases']:
            screen.note(case['sentence'], 'warning')

    def specimen(self, name: str = '') -> Specimen:
        """Return the base under `name` with the identified contact and coefficients.

        Raises `IdentificationError` where the recordings did not give both, or one of them is a case, and
        `SpecimenError`.
        """
        fit, contact = self.fit, self.contact
        if fit is None or contact is None:
            raise IdentificationError(
                '--out needs the coefficients (sawtooths at several speeds) and the contact (a ramp and '
                f'hold, or that of --base); the {"ramp" if fit else "sawtooth"} is missing: add such '
                'recordings to --train, and leave --step to auto'
            )
        if self.cases:
            raise IdentificationError(
                'no coefficient of friction is written: ' + '; '.join(case.sentence for case in self.cases)
            )
        speeds = [abs(line.velocity) for line in self.lines]
        coefs = fit.coefficients
        covariance = {', '.join(names): rounded(values) for names, values in fit.covariances.items()}
        if self.ramps:
            covariance[', '.join(contact._fields)] = rounded(mean_contact(self.ramps)[1])
        origin = {
            'valid': {
                'normal_force': [coefs.lowest_normal_force, coefs.highest_normal_force],
                'speed': rounded([min(speeds), max(speeds)]),
            },
            'form_of_b': fit.variant,
            'contact': 'identified' if self.ramps else 'that of the base',
            'residuals': {
                'a_rms': rounded(fit.a_rms),
                'b_rms_per_mm': rounded(fit.b_rms_mm),
                'held_out': {each.recording.name: rounded(each.full_error) for each in self.validations},
            },
            'covariance': covariance,
        }
        recordings = [{'file': file, **entry} for file, entry in self.recordings.items()]
        friction = {**coefs._asdict(), **contact._asdict()}
        return with_part(self.base, name, 'friction', recordings, origin, friction=friction)

    def draw(self, file: Path) -> None:
        """Write the picture of every step to `file` (PNG)."""
        from engine_mount.identification.pictures import draw_friction

        draw_friction(self, file)

    def _pair_table(self) -> Table:
        names = list(dict.fromkeys(pair.train for pair in self.pairs))
        rows = [
            (
                f'{names.index(pair.train) + 1} -> {names.index(pair.recording.name) + 1}',
                *(_percent(each.held_out_error) for each in pair.rungs),
            )
            for pair in self.pairs
        ]
        heads = ('held-out error', *(each.law.name for each in self.pairs[0].rungs))
        caption = ', '.join(f'{number}: {name}' for number, name in enumerate(names, 1))
        return Table('', 'l' + 'r' * (len(heads) - 1), rows, heads, caption)


def _known(value: float) -> float | None:
    return None if np.isnan(value) else value


def _ladder_figures(rungs: Sequence[Rung]) -> dict[str, dict[str, Any]]:
    return {
        each.law.name: {
            'train_error': each.train_error,
            'held_out_error': _known(each.held_out_error),
            'explained': explained(each.error),
            'parameters': each.parameters,
            'units': {parameter.name: parameter.unit for parameter in each.law.parameters},
            'seconds': each.seconds,
            'out_of_time': each.out_of_time,
        }
        for each in rungs
    }


def _ramp_figures(fit: RampHoldFit) -> dict[str, Any]:
    response = fit.response._asdict()
    del response['asymptote'], response['desired']
    return {
        'recording': fit.recording.name,
        'contact': fit.contact._asdict(),
        'deviation': fit.deviation._asdict(),
        **response,
        'force_misfit': fit.force_misfit,
        'displacement_misfit': fit.displacement_misfit,
    }


def _ladder_table(ladder: dict[str, dict[str, Any]]) -> Table:
    rows = []
    for name, entry in ladder.items():
        parameters = next(iter(entry['parameters'].values()))
        count = len(parameters if isinstance(parameters, dict) else entry['parameters'])
        shares = (_percent(entry[key]) for key in ('held_out_error', 'train_error', 'explained'))
        rows.append((name, *shares, str(count)))
    caption = 'errors: rms over rms; explains: share of the mean square of the force'
    return Table('', 'lrrrr', rows, ('law', 'held out', 'training', 'explains', 'parameters'), caption)


def _percent(value: float | None) -> str:
    return '-' if value is None else f'{100 * value:.1f} %'
