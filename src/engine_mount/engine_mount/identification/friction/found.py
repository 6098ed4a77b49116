"""What is asked of an identification, and all that was found."""

import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from engine_mount.identification.friction.channels import friction_mapping
from engine_mount.identification.friction.ladder import Rung
from engine_mount.identification.friction.looks.cases import Case, explained
from engine_mount.identification.friction.looks.first_look import FirstLook
from engine_mount.identification.friction.recording import FrictionRecording, IdentificationError
from engine_mount.identification.friction.steps.coefficient_fit import CoefficientFit
from engine_mount.identification.friction.steps.ramp_hold import RampHoldFit
from engine_mount.identification.friction.steps.sawtooth import StrokeLine
from engine_mount.identification.friction.steps.validation import ModelValidation
from engine_mount.signals.mapping import Mapping
from mount_models.friction.coefficient import FrictionCoefficients
from mount_models.friction.contact import FrictionContact


@dataclass(frozen=True)
class IdentifyOrder:
    """Which recordings train, which are held out, which are tried in all ordered pairs; and how.

    `zero` is where the zero of the force is taken from, '' for what each kind of file takes.
    """

    train: Sequence[Path] = ()
    held_out: Sequence[Path] = ()
    pairs: Sequence[Path] = ()
    step: str = 'auto'
    clamp: str = 'sliding'
    zero: str = ''
    mapping: Mapping = field(default_factory=friction_mapping)
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
    """All that was found; lists are empty where a step had no recordings.

    `cases` are what keeps a coefficient of friction from being written; `looks` go by recording.
    """

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
    looks: dict[str, FirstLook] = field(default_factory=dict)
    cases: list[Case] = field(default_factory=list)
    notes: list[str] = field(default_factory=list)


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
            'explained': float(np.mean([explained(each.held_out_error) for _, each in same])),
            'parameters': {pair.train: each.named_values for pair, each in same},
        }
    return result
