"""Recordings that tell no coefficient are named in words, and none is written to a specimen from them."""

import re

import numpy as np
import pytest
from joint import DT, TIME, jenkin, measured, motion

from engine_mount.identification.fitting import IdentificationError
from engine_mount.identification.friction.screening import case_of, first_look, ladder_case, subtract_zero
from engine_mount.identification.identify import friction
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
        (1.7e-3, 0.5e-3, 'hardly slides', r'slides on less than 50%.*record strokes of'),
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
def test_a_force_that_is_not_of_friction_is_named_by_what_it_goes_with(of, word):
    x = motion(0.01, 0.9, rest=0.0) + motion(0.004, 2.3, rest=0.0)
    case = seen(x, of(x), noise=0.0)
    assert case is not None
    assert case.kind == 'not of friction'
    assert word in case.sentence


def of_ladder(train, held_out):
    return ladder_case({'Dahl': {'train_error': train, 'held_out_error': held_out}}, 'Dahl')


def test_a_ladder_is_a_case_where_no_law_explains_or_predicts():
    assert of_ladder(0.2, 0.24) is of_ladder(0.3, None) is None
    assert re.search(r'errs by 30\.7% .*expected: up to 25%.*loosely', of_ladder(0.2, 0.307).sentence)
    poor, other = of_ladder(0.5, 0.6), of_ladder(0.2, 0.6)
    assert (poor.kind, other.kind) == ('not explained', 'not predicted')
    assert 'Dahl, explains 75% of its mean square' in poor.sentence
    assert '96% of its mean square in training and 64% of what was held out' in other.sentence


def written_sawtooth(file, amplitude):
    """To and fro at five speeds, straight, of a joint that slides at 600 N of 1000 N."""
    corners, times = [0.0], [0.0]
    for speed in (2.0, 3.0, 4.0, 6.0, 8.0):
        for corner in (1.0, -1.0):
            times.append(times[-1] + abs(corner - corners[-1]) / speed)
            corners.append(corner)
    x = amplitude * np.interp(TIME, times, corners)
    table = np.column_stack([TIME, 1e3 * x, jenkin(x, LIMITS, 1e6, 0.0, 0.0), np.full(TIME.size, 1000.0)])
    header = 'time_s,displacement_mm,friction_force_n,normal_force_n'
    np.savetxt(file, table, delimiter=',', header=header, comments='')
    return file


def test_no_coefficient_is_written_from_a_contact_that_mostly_sticks(tmp_path):
    slides, sticks = (written_sawtooth(tmp_path / f'{a}.csv', a) for a in (20e-3, 0.75e-3))
    result = friction([slides], step='sawtooth')
    assert result.specimen('own').friction != default_specimen().friction
    refused = friction([slides], [sticks], step='sawtooth')
    with pytest.raises(IdentificationError, match=r'no coefficient of friction is written: .*mostly sticks'):
        refused.specimen('own')


def test_the_zero_of_the_loop_is_taken_by_word_and_doubts_that_of_the_file():
    x = motion(0.01)
    recording = measured(x, jenkin(x, LIMITS, 1e6, 1e-3, 1.5e-3), 250.0)  # it begins with a force of its own
    by_law, look = subtract_zero(recording, 'law')
    assert by_law.force.mean() == pytest.approx(recording.force.mean() - 250.0, abs=20.0)
    assert re.search(
        r'zero 2\d\d N \(\+- \d+ N, [0-9.]+% of the force of sliding\) from the loop', by_law.notes[-1]
    )
    assert abs(look.zero) < 1e-9
    untouched, _ = subtract_zero(recording)
    np.testing.assert_array_equal(untouched.force, recording.force)
    assert 'doubtful: the loop gives 2' in untouched.notes[-1]
    without = measured(x, jenkin(x, LIMITS, 1e6, 1e-3, 0.0), 0.0)
    assert subtract_zero(without)[0].notes == ()
    with pytest.raises(IdentificationError, match="--zero 'rest' is unknown; known are law, recorded"):
        subtract_zero(recording, 'rest')


def test_a_zero_that_no_loop_tells_is_left_as_recorded_and_said():
    x = motion(0.3e-3)
    recording = measured(x, jenkin(x, LIMITS, 1e6, 0.0, 0.1e-3), 80.0)
    left, _ = subtract_zero(recording, 'law')
    np.testing.assert_array_equal(left.force, recording.force)
    assert 'the loop gives it only to +-' in left.notes[-1]
