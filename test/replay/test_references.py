"""The recordings in bags/reference, replayed: every setpoint and intermediate to the bit as accepted."""

from pathlib import Path

import pytest

from mount_bags.compare.accept import ACCEPTED_NAME, LARGEST_TOTAL
from mount_bags.compare.reference import differences_from_reference
from mount_bags.run.versions import version_differences, versions, versions_sentence
from mount_replay.replay import CORE, LOCKSTEP, ReplayOrder, replay

REFERENCES = sorted(
    folder for folder in (Path(__file__).parents[2] / 'bags' / 'reference').iterdir() if folder.is_dir()
)


@pytest.mark.parametrize('mode', [CORE, LOCKSTEP])
@pytest.mark.parametrize('reference', REFERENCES, ids=lambda folder: folder.name)
def test_the_accepted_setpoints_are_met_to_the_bit(reference, mode, domain, tmp_path):
    outcome = replay(ReplayOrder(reference, mode, out=tmp_path / 'replay', domain=domain))
    told = differences_from_reference(reference, outcome.folder.recording)
    assert not told, '\n'.join(
        [
            f'{reference.name}, {mode}:',
            *told,
            versions_sentence(version_differences(outcome.given.session, versions()), versions()),
            f'if this is meant: engine-mount accept REPLAY --reference {reference.name} --reason "..."',
        ]
    )


def test_a_gap_a_rough_stretch_a_fault_and_an_initialisation_are_there_with_a_reason_and_small():
    assert [folder.name for folder in REFERENCES] == ['fault', 'gap', 'initialisation', 'rough']
    assert all('reason:' in (folder / ACCEPTED_NAME).read_text() for folder in REFERENCES)
    size = sum(path.stat().st_size for folder in REFERENCES for path in folder.iterdir())
    assert size < LARGEST_TOTAL
