"""What `engine-mount identify friction` does: read, steps 1 to 3, ladder; everything but printing."""

import itertools
import math
from collections.abc import Sequence
from dataclasses import replace

from engine_mount.identification.friction.found import Identification, IdentifyOrder, PairResult, chosen_fit
from engine_mount.identification.friction.intake import check_order, taken
from engine_mount.identification.friction.kind import RAMP, SAWTOOTH
from engine_mount.identification.friction.ladder import Progress, Rung, all_laws, fit_ladder, law_error
from engine_mount.identification.friction.recording import FrictionRecording, IdentificationError
from engine_mount.identification.friction.steps.coefficient_fit import VARIANTS, fit_coefficients
from engine_mount.identification.friction.steps.ramp_hold import fit_ramp_hold, mean_contact
from engine_mount.identification.friction.steps.sawtooth import stroke_lines
from engine_mount.identification.friction.steps.validation import pooled_error, validate
from mount_models.friction.contact import FrictionContact


def identify(order: IdentifyOrder, progress: Progress | None = None) -> Identification:
    """Return what the recordings tell; raises `IdentificationError` before anything is written."""
    check_order(order)
    found = Identification()
    if len(order.pairs) == 1:
        _try_halves(found, order, progress)
        return found
    if order.pairs:
        _try_pairs(found, order, progress)
        return found
    train, held_out = (
        taken(found, order.train, 'train', order),
        taken(found, order.held_out, 'held out', order),
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
    ((whole, kind),) = taken(found, order.pairs, 'first half train, second half held out', order)
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
    recordings = [each for each, kind in taken(found, order.pairs, 'both', order) if kind != RAMP]
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
