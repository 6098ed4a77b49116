"""What an identification of friction found: validation, figures, tables, picture, and the specimen of it."""

import functools
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from scipy.signal import savgol_filter

from engine_mount.identification.fitting import FloatArray, IdentificationError, rms
from engine_mount.identification.friction.coefficients import CoefficientFit
from engine_mount.identification.friction.ladder import Rung, best_rung
from engine_mount.identification.friction.laws import pad_force
from engine_mount.identification.friction.ramp_hold import RampHoldFit, mean_contact
from engine_mount.identification.friction.recording import FrictionRecording, smoothed_displacement
from engine_mount.identification.friction.sawtooth import StrokeLine, slip_regions
from engine_mount.identification.friction.screening import Case, FirstLook, ladder_case
from engine_mount.identification.specimen import rounded, with_part
from engine_mount.recordings.screen import Screen, Table
from mount_models.friction.coefficient import FrictionCoefficients
from mount_models.friction.contact import FrictionContact
from mount_models.friction.simplified import simplified_response
from mount_models.specimen import Specimen


class ModelValidation(NamedTuple):
    """Error of both models on one unseen recording, rms over rms of the measured force (Fig. 11).

    `*_macroslip_error` leaves out what follows a turning point, where the simplified model is not defined,
    and strokes so slow that it fades mu (see `slip_regions`). `full`, `simplified` are the predicted forces
    (N, (n,)).
    """

    recording: FrictionRecording
    full: FloatArray
    simplified: FloatArray
    full_error: float
    simplified_error: float
    full_macroslip_error: float
    simplified_macroslip_error: float


def validate(
    recording: FrictionRecording, contact: FrictionContact, coefs: FrictionCoefficients
) -> ModelValidation:
    """Return how full and simplified model predict `recording` from its displacement and normal force."""
    dt, x, measured = recording.dt, smoothed_displacement(recording), recording.force
    full = pad_force(contact, coefs, x, dt, recording.normal_force)
    window = max(3, round(0.02 / dt) | 1)  # 20 ms, chosen: less than the 30 ms or more that are left out
    short = x.size <= window
    velocity = np.gradient(x, dt) if short else savgol_filter(x, window, 1, deriv=1, delta=dt)
    clamp = np.where(velocity >= 0.0, *recording.normal_force.T)
    simplified, _ = simplified_response(contact, coefs, velocity, clamp, dt)
    sliding = slip_regions(recording, contact).macro
    parts = slice(None), sliding if sliding.any() else slice(None)
    errors = (
        rms((force - measured)[part]) / rms(measured[part]) for part in parts for force in (full, simplified)
    )
    return ModelValidation(recording, full, simplified, *errors)


@dataclass
class FrictionIdentification:
    """All that was found; lists are empty where a step had no recordings.

    `recordings` holds part, kind and SHA-256 of each, `looks` go by recording too. `cases` keep a coefficient
    of friction from being written. `contact` is that of the `base` where no ramp was recorded.
    """

    base: Specimen
    recordings: dict[str, dict[str, Any]] = field(default_factory=dict)
    ramps: list[RampHoldFit] = field(default_factory=list)
    contact: FrictionContact | None = None
    lines: list[StrokeLine] = field(default_factory=list)
    fit: CoefficientFit | None = None
    validations: list[ModelValidation] = field(default_factory=list)
    rungs: list[Rung] = field(default_factory=list)
    held_out: list[FrictionRecording] = field(default_factory=list)
    looks: dict[str, FirstLook] = field(default_factory=dict)
    cases: list[Case] = field(default_factory=list)
    notes: list[str] = field(default_factory=list)

    @functools.cached_property
    def ladder(self) -> dict[str, dict[str, Any]]:
        """Errors and parameters of each law."""
        return {each.law.name: each.figures() for each in self.rungs}

    @property
    def best(self) -> str:
        """The law with the least error, held out if anything is."""
        return best_rung(self.rungs).law.name

    def all_cases(self) -> list[Case]:
        """Return the cases of the recordings and of the ladder."""
        return [*self.cases, *self._cases_of_ladder()]

    def _cases_of_ladder(self) -> list[Case]:
        case = ladder_case(self.ladder, self.best) if self.ladder else None
        return [case] if case else []

    def figures(self) -> dict[str, Any]:
        """Return everything as plain numbers and texts, for JSON; SI units but where the name has another."""
        result: dict[str, Any] = {'recordings': self.recordings, 'notes': self.notes}
        if self.looks:
            result['looks'] = {name: look._asdict() for name, look in self.looks.items()}
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
        if self.fit is not None:
            result['coefficients'] = self.fit.coefficients._asdict()
            result['residuals'] = {'a_rms': self.fit.a_rms, 'b_rms_per_mm': self.fit.b_rms_mm}
        if self.validations:
            result['validation'] = [
                {'recording': each.recording.name}
                | {name: value for name, value in each._asdict().items() if name.endswith('_error')}
                for each in self.validations
            ]
        if self.ladder:
            result |= {'ladder': self.ladder, 'best': self.best}
        return {**result, 'cases': [case._asdict() for case in self.all_cases()]}

    def report(self, screen: Screen) -> None:
        """Show notes, steps, ladder and what keeps a coefficient from being written."""
        for sentence in self.notes:
            screen.note(sentence)
        for case in self.cases:
            screen.note(case.sentence, 'warning')
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
        if self.fit is not None:
            screen.say(
                f'steps 2, 3: {len(self.lines)} strokes; Eqs (13), (14) meet them within '
                f'{self.fit.a_rms:.4f} (a) and {self.fit.b_rms_mm:.2f} 1/mm (b) rms'
            )
        for each in self.validations:
            screen.say(
                f'held out {each.recording.name}: full model {each.full_error:.1%}, simplified '
                f'{each.simplified_error:.1%}; macroslip {each.full_macroslip_error:.1%}, '
                f'{each.simplified_macroslip_error:.1%}'
            )
        if self.ladder:
            screen.table(_ladder_table(self.ladder))
            screen.say(f'best: {self.best}')
        for case in self._cases_of_ladder():
            screen.note(case.sentence, 'warning')

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
    keys = ('held_out_error', 'train_error', 'explained')
    rows = [
        (name, *('-' if entry[key] is None else f'{entry[key]:.1%}' for key in keys))
        for name, entry in ladder.items()
    ]
    caption = 'errors: rms over rms; explains: share of the mean square of the force'
    return Table('', 'lrrr', rows, ('law', 'held out', 'training', 'explains'), caption)
