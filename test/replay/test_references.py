"""The recordings in bags/reference, replayed: every setpoint and intermediate to the bit as accepted."""

import pytest
from reference_differences import differences_from_reference
from references import REFERENCES

from engine_mount.drives.replay import replay
from engine_mount.recordings.reference import ACCEPTED_NAME
from engine_mount.recordings.session import (
    version_differences,
    versions_sentence,
)
from mount_recorder.versions import versions


@pytest.mark.parametrize('reference', REFERENCES, ids=lambda folder: folder.name)
def test_the_accepted_setpoints_are_met_to_the_bit(reference, tmp_path):
    outcome = replay(reference, out=tmp_path / 'replay')
    told = differences_from_reference(reference, outcome.recording)
    assert not told, '\n'.join(
        [
            f'{reference.name}:',
            *told,
            versions_sentence(version_differences(outcome.given.session, versions()), versions()),
            f'if this is meant: engine-mount dev accept REPLAY --reference {reference.name} --reason "..."',
        ]
    )


def test_all_kinds_of_drives_are_there_with_a_reason_and_small():
    assert [folder.name for folder in REFERENCES] == ['fault', 'gap', 'initialisation', 'opening', 'rough']
    assert all('reason:' in (folder / ACCEPTED_NAME).read_text() for folder in REFERENCES)
    size = sum(path.stat().st_size for folder in REFERENCES for path in folder.iterdir())
    assert size < 5_000_000
