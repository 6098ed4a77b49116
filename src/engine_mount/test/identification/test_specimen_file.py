"""The file of a specimen: nothing is lost or doubtful, and it is written whole or not at all."""

import math
from dataclasses import replace

import pytest

from engine_mount.identification.specimen import save_specimen, specimen_to_mapping
from mount_models.specimen import SpecimenError, default_specimen, load_specimen, specimen_from_mapping

DEFAULT = default_specimen()
GOOD = {
    'written_by': 'engine-mount calibrate',
    'remark': None,
    'parts': {
        'force_law': {
            'specimen': 'left',
            'recordings': [{'file': 'force.csv', 'sha256': 64 * 'a'}],
            'valid': {'gap': [3e-4, 5e-4], 'current': [0.0, 3.0]},
            'residuals': {'rms': 0.4, 'relative_rms': None},
            'covariance': [[1.0, -0.5], [-0.5, 2.0]],
        },
    },
}


@pytest.mark.parametrize(
    'changes',
    [
        {'name': 'left', 'friction': {'b_offset': 0.1 + 0.2}, 'provenance': {'note': 'bench, May'}},
        {'temperature': None},
        {'provenance': GOOD},
    ],
)
def test_saving_and_loading_changes_nothing(tmp_path, changes):
    specimen = replace(DEFAULT, **changes)
    save_specimen(specimen, tmp_path / 'left.yaml')
    assert load_specimen(tmp_path / 'left.yaml') == specimen
    assert specimen_from_mapping(specimen_to_mapping(specimen)) == specimen


def test_a_file_that_was_written_anew_is_loaded_anew(tmp_path):
    file = tmp_path / 'specimen.yaml'
    save_specimen(DEFAULT, file)
    assert load_specimen(file) is load_specimen(file)
    save_specimen(replace(DEFAULT, name='other'), file)
    assert load_specimen(file).name == 'other'


def test_a_file_for_another_specimen_is_refused(tmp_path):
    save_specimen(replace(DEFAULT, name='left'), tmp_path / 'left.yaml')
    assert load_specimen(tmp_path / 'left.yaml', 'left').name == 'left'
    with pytest.raises(SpecimenError, match="is for the specimen 'left', 'right' is asked for"):
        load_specimen(tmp_path / 'left.yaml', 'right')


def no_space(*_):
    raise OSError('no space left')


@pytest.mark.parametrize(
    ('changes', 'error', 'sentence'),
    [
        ({'turns_area': math.nan}, SpecimenError, 'turns_area'),
        ({'turns_area': -1.0}, SpecimenError, 'turns_area'),
        ({'provenance': {'parts': 3}}, SpecimenError, 'parts'),
        ({'name': 'right'}, OSError, 'no space'),
    ],
)
def test_a_doubtful_specimen_and_a_disk_that_fails_leave_the_file_as_it_was(
    tmp_path, monkeypatch, changes, error, sentence
):
    file = tmp_path / 'left.yaml'
    save_specimen(DEFAULT, file)
    before = file.read_bytes()
    monkeypatch.setattr('engine_mount.identification.specimen.os.replace', no_space)
    with pytest.raises(error, match=sentence):
        save_specimen(replace(DEFAULT, **changes), file)
    assert file.read_bytes() == before
    assert [path.name for path in tmp_path.iterdir()] == ['left.yaml']
