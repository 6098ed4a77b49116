"""The provenance of a specimen: free in what it tells, refused where it tells nonsense."""

import copy
import math
from dataclasses import replace

import pytest
import yaml

from mount_models.specimen import (
    DEFAULT_SPECIMEN,
    SpecimenError,
    checked_specimen,
    default_specimen,
    load_specimen,
)

GOOD = {
    'written_by': 'engine-mount calibrate',
    'remark': None,
    'parts': {
        'force_law': {
            'specimen': 'left',
            'date': '2026-05-04T10:00:00+00:00',
            'recordings': [{'file': 'force.csv', 'sha256': 64 * 'a'}],
            'valid': {'gap': [3e-4, 5e-4], 'current': [0.0, 3.0]},
            'residuals': {'rms': 0.4, 'relative_rms': None, 'gaps': [3e-4, 5e-4]},
            'covariance': [[1.0, -0.5], [-0.5, 2.0]],
        },
        'gap_curves': {
            'specimen': 'left',
            'inductance_of_gap': {'degree': 3, 'covariance': [[0.0]]},
        },
    },
}


def with_entry(path, value):
    changed = copy.deepcopy(GOOD)
    *outer, last = path.split('.')
    inside = changed
    for name in outer:
        inside = inside[name]
    inside[last] = value
    return replace(default_specimen(), provenance=changed)


NONSENSE = [
    ('temperature', math.nan, r'provenance\.temperature must be a finite number; instead received nan'),
    ('parts.force_law.residuals.gaps', [3e-4, math.inf], r'residuals\.gaps\[1\] must be a finite number'),
    ('remark', {1, 2}, r'provenance\.remark must be a text, a number, or a list'),
    ('remark', {7: 'seven'}, r'provenance\.remark must have texts as names; instead received 7'),
    ('parts', 3, r'provenance\.parts must be a mapping of parts'),
    ('parts.force_law', 'by hand', r'provenance\.parts\.force_law must be a mapping with the name'),
    ('parts.force_law.specimen', '', r'force_law must be a mapping with the name of a specimen'),
]


@pytest.mark.parametrize(('path', 'value', 'sentence'), NONSENSE)
def test_nonsense_is_refused_by_its_place(path, value, sentence):
    with pytest.raises(SpecimenError, match=sentence + '.*calibrate again'):
        checked_specimen(with_entry(path, value))


def test_nonsense_written_into_the_file_by_hand_is_refused_when_it_is_loaded(tmp_path):
    content = yaml.safe_load(DEFAULT_SPECIMEN.read_text(encoding='utf-8'))
    content['provenance']['parts']['friction']['residuals']['a_rms'] = math.nan
    file = tmp_path / 'edited.yaml'
    file.write_text(yaml.safe_dump(content), encoding='utf-8')
    sentence = r'edited\.yaml: provenance\.parts\.friction\.residuals\.a_rms must be a finite number'
    with pytest.raises(SpecimenError, match=sentence):
        load_specimen(file)
