"""The specimen file: nothing is lost, nothing is guessed, and no truth of the plant comes near it."""

import math
from copy import deepcopy
from dataclasses import replace
from functools import reduce
from operator import getitem

import pytest
import yaml

from mount_models.specimen import (
    DEFAULT_SPECIMEN,
    SpecimenError,
    checked_specimen,
    chosen_specimen,
    default_specimen,
    load_specimen,
    specimen_from_mapping,
)

DEFAULT = default_specimen()
CONTENT = yaml.safe_load(DEFAULT_SPECIMEN.read_text())


def changed(path, value, content=None):
    """Return a mapping, by default the shipped specimen, the entry at `path` changed, or dropped for None."""
    content = deepcopy(CONTENT if content is None else content)
    *outer, last = path.split('.') if isinstance(path, str) else path
    inside = content
    for name in outer:
        inside = inside[name]
    if value is None:
        del inside[last]
    else:
        inside[last] = value
    return content


def test_the_default_specimen_covers_the_gaps_of_new_and_worn_pads():
    curves = DEFAULT.gap_curves
    low = max(DEFAULT.force_law.gap_low, curves.inductance_of_gap.low, curves.crossing_current_of_gap.low)
    high = min(DEFAULT.force_law.gap_high, curves.inductance_of_gap.high, curves.crossing_current_of_gap.high)
    assert low <= 280e-6
    assert high >= 540e-6


@pytest.mark.parametrize(
    ('path', 'value', 'sentence'),
    [
        ('pad_stiffness', None, 'pad_stiffness is missing'),
        ('pad_stifness', 2e7, 'pad_stifness is unknown'),
        ('force_law.a3', None, 'force_law must hold exactly .* a3 is missing'),
        ('force_law.a1', 3.0, 'force_law.a1 must be a list of numbers; instead received 3.0'),
        (
            'force_law.a1',
            [1.0, 'x', 0.0, 0.0],
            r"force_law.a1\[1\] must be a finite number; instead received 'x'",
        ),
        (
            'turns_area',
            '1e-1',
            r"turns_area must be a finite number; instead .*'1e-1' \(YAML reads 1e-6 as a text",
        ),
        ('spring_stiffness', -1.0, r'spring_stiffness \(-1 N/m\) must lie within 1000 \.\. 1e\+07 N/m'),
        (
            'current_limit',
            3.5,
            r'current_limit \(3\.50 A\) must not exceed force_law\.current_high \(3\.00 A\)',
        ),
        ('coil_resistance', 3.0, r'coil_resistance \(3 ohm\) and heating\.resistance \(2\.5 ohm\) are'),
        ('force_law.gap_high', 900e-6, 'the force must'),
        ('gap_curves.gap_of_inductance.coefficients', [4e-4, 1e-4], 'must agree within'),
        ('gap_curves.gap_of_inductance.coefficients', [4e-4, 0.0], 'must be monotone'),
        ('name', 7, 'name must be a text'),
        ('friction', {'a_p1': 'high'}, 'friction.a_p1 must be a finite number'),
        ('provenance', 'bench', 'provenance must be a mapping'),
        ('provenance.parts', 3, r'provenance\.parts must be a mapping'),
        ('provenance.parts.friction', 'by hand', r'provenance\.parts\.friction must be a mapping'),
        ('provenance.parts.friction.specimen', '', r'parts\.friction\.specimen must be a text'),
        ('schema_version', 1, r'schema_version \(1\) must be 2; .* calibrate again'),
        ('friction', {'mu': 0.3}, "'mu' is no parameter of friction; known are b_offset"),
        ('friction', {'a_p2': -1.0}, r'friction.a_p2 \(-1 1\) must lie within'),
        ('temperature.reference_celsius', 20.0, 'must differ from calibration_celsius'),
        ('temperature.highest_celsius', 400.0, r'temperature.highest_celsius \(400 degC\) must lie within'),
        ('temperature.reluctance_shift.coefficients', [-9.0, 9.0], 'must still fall with the gap'),
    ],
)
def test_a_doubtful_file_is_refused_in_a_sentence(tmp_path, path, value, sentence):
    file = tmp_path / 'doubtful.yaml'
    file.write_text(yaml.safe_dump(changed(path, value)))
    with pytest.raises(SpecimenError, match=sentence) as refusal:
        load_specimen(file)
    assert str(file) in str(refusal.value)


def leaves(content, path=()):
    """Yield the path to every value that is no mapping or list itself."""
    inner = content.items() if isinstance(content, dict) else enumerate(content)
    for name, value in inner:
        if isinstance(value, (dict, list)):
            yield from leaves(value, (*path, name))
        else:
            yield (*path, name)


PLAIN = {**CONTENT, 'provenance': {}}


@pytest.mark.parametrize('path', list(leaves(PLAIN)), ids=lambda path: '.'.join(map(str, path)))
def test_no_value_of_the_file_can_be_edited_without_being_refused_or_seen(path):
    old = reduce(getitem, path, PLAIN)
    edits = [f'{old}x' if isinstance(old, str) else 1.01 * old + 1e-9]
    if isinstance(path[-1], str):  # a list may be shorter: laws and curves of other orders exist
        edits.append(None)
    for edit in edits:
        try:
            assert specimen_from_mapping(changed(path, edit, PLAIN)) != replace(DEFAULT, provenance={})
        except SpecimenError:
            continue
    for nonsense in (math.nan, '1.0 mm', [[]], {}):
        with pytest.raises(SpecimenError):
            specimen_from_mapping(changed(path, nonsense if path != ('name',) else 7, PLAIN))


@pytest.mark.parametrize('text', ['a: [1, 2', '', '- 1\n- 2\n'])
def test_a_file_that_is_no_specimen_is_refused(tmp_path, text):
    (tmp_path / 'none.yaml').write_text(text)
    with pytest.raises(SpecimenError, match=r'none\.yaml'):
        load_specimen(tmp_path / 'none.yaml')


def test_the_default_specimen_is_chosen_without_a_file():
    assert chosen_specimen('') == chosen_specimen('', 'default') == DEFAULT
    with pytest.raises(SpecimenError, match="is for the specimen 'default', 'left' is asked for"):
        chosen_specimen('', 'left')


def test_friction_parameters_pass_through():
    assert specimen_from_mapping(changed('friction', {'a_p1': 1})).friction == {'a_p1': 1.0}
    assert checked_specimen(replace(DEFAULT, friction={})).friction == {}


@pytest.mark.parametrize(
    ('friction', 'sentence'),
    [
        ({'a_p1': -5.0}, r'coefficient of friction .* must be greater than 0'),
        ({'contact_stiffness': 1.0}, r'friction\.contact_stiffness \(1 N/m\) must lie within'),
    ],
)
def test_friction_that_is_none_is_refused(friction, sentence):
    with pytest.raises(SpecimenError, match=sentence):
        checked_specimen(replace(DEFAULT, friction=friction))
