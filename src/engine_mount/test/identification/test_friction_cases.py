"""Recordings that tell no coefficient are named in words, and none is written to a specimen from them."""

import re

import numpy as np
import pytest
from joint import DT, TIME, jenkin, measured, motion

from engine_mount.identification.friction.found import Identification, IdentifyOrder
from engine_mount.identification.friction.intake import taken
from engine_mount.identification.friction.looks.cases import case_of, ladder_case
from engine_mount.identification.friction.looks.first_look import first_look
from engine_mount.identification.friction.looks.force_zero import zeroed
from engine_mount.identification.friction.recording import IdentificationError
from engine_mount.identification.friction.steps.coefficient_fit import fit_coefficients
from engine_mount.identification.friction.steps.sawtooth import stroke_lines
from engine_mount.identification.specimen import with_friction
from mount_models.friction.contact import FrictionContact
from mount_models.specimen import default_specimen

LIMITS = (600.0, 600.0)


def seen(x, force, noise=0.01):
    recording = measured(x, force, 0.0, noise=noise)
    return case_of(recording, first_look(recording))


def test_a_contact_that_slides_is_no_case():
    x = motion(0.01)
    assert seen(x, jenkin(x, LIMITS, 1e6, 0.5e-3, 0.0)) is None


@pytest.mark.parametrize(
    ('amplitude', 'play', 'kind', 'words'),
    [
        (0.3e-3, 0.0, 'never slips', r'it slides on 0% of its way.*up to 3\d\d N .*longer than 0.6 mm'),
        (0.75e-3, 0.0, 'mostly sticks', r'it slides on \d+%.*record strokes of 4\.\d mm or more'),
        (0.01, 8e-3, 'play dominates', r'crosses a play of 16 mm on [678]\d%.*take the play out'),
    ],
)  # fmt: skip
def test_sticking_and_play_are_named_with_figures_and_a_remedy(amplitude, play, kind, words):
    x = motion(amplitude)
    case = seen(x, jenkin(x, LIMITS, 1e6, play, 0.0))
    assert case is not None
    assert case.kind == kind
    assert re.search(words, case.sentence)


@pytest.mark.parametrize(
    ('of', 'word'),
    [
        (lambda x: 800.0 * np.gradient(np.gradient(x, DT), DT) / 9.8, 'acceleration explains'),
        (lambda x: 900.0 * np.gradient(x, DT), 'velocity explains'),
        (lambda x: 300.0 * np.random.default_rng(1).standard_normal(x.size), 'neither displacement'),
    ],
)
def test_a_force_that_is_not_of_friction_is_told_by_what_it_goes_with(of, word):
    x = motion(0.01, 0.9, rest=0.0) + motion(0.004, 2.3, rest=0.0)
    case = seen(x, of(x), noise=0.0)
    assert case is not None
    assert case.kind == 'not of friction'
    assert word in case.sentence


def entries(**errors):
    return {
        name.replace('_', ' '): {'train_error': train, 'held_out_error': held}
        for name, (train, held) in errors.items()
    }


def test_a_ladder_is_a_case_where_no_law_explains_or_foretells():
    assert ladder_case(entries(Dahl=(0.2, 0.3), Coulomb=(0.6, 0.7))) is None
    assert ladder_case({}) is None
    poor = ladder_case(entries(Dahl=(0.5, 0.6), Coulomb=(0.6, 0.7)))
    assert poor is not None
    assert poor.kind == 'not explained'
    assert 'Dahl, explains 75% of its mean square' in poor.sentence
    other = ladder_case(entries(Dahl=(0.2, 0.6), Coulomb=(0.6, 0.7)))
    assert other is not None
    assert other.kind == 'not foretold'
    assert '96% of its mean square in training and 64% of what was held out' in other.sentence
    assert ladder_case(entries(Dahl=(0.2, None), Coulomb=(0.6, None))) is None


def sawtooth(amplitude):
    """To and fro at five speeds, straight."""
    corners, times = [0.0], [0.0]
    for speed in (2.0, 3.0, 4.0, 6.0, 8.0):
        for corner in (1.0, -1.0):
            times.append(times[-1] + abs(corner - corners[-1]) / speed)
            corners.append(corner)
    return amplitude * np.interp(TIME, times, corners)


def written_as_csv(file, x, force):
    table = np.column_stack([TIME, 1e3 * x, force, np.full(TIME.size, 1000.0)])
    np.savetxt(
        file,
        table,
        delimiter=',',
        header='time_s,displacement_mm,friction_force_n,normal_force_n',
        comments='',
    )
    return file


def test_no_coefficient_is_written_from_a_contact_that_mostly_sticks(tmp_path):
    for amplitude, wanted in ((0.75e-3, 'mostly sticks'), (20e-3, '')):
        found, x = Identification(), sawtooth(amplitude)
        file = written_as_csv(tmp_path / f'{amplitude}.csv', x, jenkin(x, LIMITS, 1e6, 0.0, 0.0))
        ((recording, _),) = taken(found, [file], 'train', IdentifyOrder(train=[file]))
        found.contact = FrictionContact()
        stiff = jenkin(sawtooth(20e-3), LIMITS, 1e6, 0.0, 0.0)
        slides = measured(sawtooth(20e-3), stiff, 0.0)
        found.lines = stroke_lines(slides, found.contact)
        found.fits = [(fit_coefficients(found.lines), 0.1)]
        if wanted:
            with pytest.raises(
                IdentificationError, match=f'no coefficient of friction is written: .*{wanted}'
            ):
                with_friction(default_specimen(), 'own', found)
        else:
            assert with_friction(default_specimen(), 'own', found).friction != default_specimen().friction
        assert recording.force.size == TIME.size


def stuck_at_rest(zero):
    x = motion(0.01)
    return measured(x, jenkin(x, LIMITS, 1e6, 1e-3, 1.5e-3), zero)


def test_a_zero_is_doubted_in_words_where_rest_and_loop_disagree():
    recording = stuck_at_rest(250.0)
    by_law, look = zeroed(recording, 'law')
    assert by_law.force.mean() == pytest.approx(recording.force.mean() - 250.0, abs=20.0)
    assert 'the rest before the motion reads 7' in by_law.notes[-1]
    assert 'so the rest is not taken' in by_law.notes[-1]
    assert abs(look.zero) < 1e-9
    by_rest, _ = zeroed(recording, 'rest')
    assert by_rest.force[:100].mean() == pytest.approx(0.0, abs=2.0)
    assert 'doubtful: the loop says 2' in by_rest.notes[-1]
    untouched, _ = zeroed(recording)
    np.testing.assert_array_equal(untouched.force, recording.force)
    assert 'by the loop it is off by 2' in untouched.notes[-1]


def test_a_zero_that_agrees_is_not_doubted():
    x = motion(0.01)
    recording = measured(x, jenkin(x, LIMITS, 1e6, 1e-3, 0.0), 0.0)
    assert zeroed(recording)[0].notes == ()
    assert 'agrees' in zeroed(recording, 'law')[0].notes[-1]
    assert 'doubtful' not in zeroed(recording, 'rest')[0].notes[-1]


def test_a_zero_that_no_loop_tells_is_left_as_recorded_and_said():
    x = motion(0.3e-3)
    recording = measured(x, jenkin(x, LIMITS, 1e6, 0.0, 0.1e-3), 80.0)
    left, _ = zeroed(recording, 'law')
    np.testing.assert_array_equal(left.force, recording.force)
    assert 'the loop tells it only to +-' in left.notes[-1]


def test_a_rest_that_there_is_not_and_an_unknown_word_are_refused():
    x = 0.01 * np.sin(3 * TIME)
    recording = measured(x, jenkin(x, LIMITS, 1e6, 0.0, 0.0), 0.0)
    with pytest.raises(IdentificationError, match=r'moves within the first 0\.1 s'):
        zeroed(recording, 'rest')
    with pytest.raises(IdentificationError, match="--zero 'first' must be one of law, rest, recorded"):
        zeroed(recording, 'first')
