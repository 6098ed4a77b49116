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


def test_saving_and_loading_changes_nothing(tmp_path):
    specimen = replace(
        DEFAULT, name='left', friction={'b_offset': 0.1 + 0.2}, provenance={'note': 'bench, May'}
    )
    save_specimen(specimen, tmp_path / 'left.yaml')
    assert load_specimen(tmp_path / 'left.yaml') == specimen


def test_a_specimen_and_its_mapping_lead_back_to_each_other():
    assert specimen_from_mapping(specimen_to_mapping(DEFAULT)) == DEFAULT


def test_a_file_that_was_written_anew_is_loaded_anew(tmp_path):
    file = tmp_path / 'specimen.yaml'
    save_specimen(DEFAULT, file)
    assert load_specimen(file) is load_specimen(file)
    save_specimen(replace(DEFAULT, name='other'), file)
    assert load_specimen(file).name == 'other'


def test_a_doubtful_specimen_is_not_saved(tmp_path):
    with pytest.raises(SpecimenError, match='turns_area'):
        save_specimen(replace(DEFAULT, turns_area=math.nan), tmp_path / 'bad.yaml')
    assert not (tmp_path / 'bad.yaml').exists()


def test_a_file_for_another_specimen_is_refused(tmp_path):
    save_specimen(replace(DEFAULT, name='left'), tmp_path / 'left.yaml')
    assert load_specimen(tmp_path / 'left.yaml', 'left').name == 'left'
    with pytest.raises(SpecimenError, match="is for the specimen 'left', 'right' is asked for"):
        load_specimen(tmp_path / 'left.yaml', 'right')


def test_a_specimen_without_compensation_can_be_saved_too(tmp_path):
    plain = replace(DEFAULT, temperature=None)
    save_specimen(plain, tmp_path / 'plain.yaml')
    assert load_specimen(tmp_path / 'plain.yaml') == plain


def test_a_refused_specimen_leaves_the_file_as_it_was(tmp_path):
    file = tmp_path / 'left.yaml'
    save_specimen(DEFAULT, file)
    before = file.read_bytes()
    with pytest.raises(SpecimenError):
        save_specimen(replace(DEFAULT, turns_area=-1.0), file)
    assert file.read_bytes() == before
    assert [path.name for path in tmp_path.iterdir()] == ['left.yaml']


def test_a_disk_that_fails_leaves_the_file_as_it_was(tmp_path, monkeypatch):
    file = tmp_path / 'left.yaml'
    save_specimen(DEFAULT, file)
    before = file.read_bytes()

    def fails(*_):
        raise OSError('no space left')

    monkeypatch.setattr('engine_mount.identification.specimen.os.replace', fails)
    with pytest.raises(OSError, match='no space'):
        save_specimen(replace(DEFAULT, name='right'), file)
    assert file.read_bytes() == before
    assert [path.name for path in tmp_path.iterdir()] == ['left.yaml']


def test_a_good_provenance_comes_back_from_its_file(tmp_path):
    specimen = replace(DEFAULT, provenance=GOOD)
    save_specimen(specimen, tmp_path / 'left.yaml')
    assert load_specimen(tmp_path / 'left.yaml').provenance == GOOD


def test_nothing_is_written_of_a_specimen_with_nonsense(tmp_path):
    with pytest.raises(SpecimenError):
        save_specimen(replace(DEFAULT, provenance={'parts': 3}), tmp_path / 'left.yaml')
    assert not list(tmp_path.iterdir())
