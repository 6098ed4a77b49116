"""A replay tells with which versions and on which kind of machine the recording was made."""

import pytest

from engine_mount.drives.loop.recording import record_core
from engine_mount.drives.replay import replay
from mount_recorder.session import session_text
from mount_recorder.versions import versions

SIM = {'scenario': 'bench', 'timeline.start': 2.8, 'timeline.duration': 0.1}


@pytest.mark.parametrize(
    ('others', 'sentence'),
    [
        ({}, 'made with the same versions on the same kind of machine'),
        ({'machine': 'z80'}, f'others than here: machine z80 (here {versions()["machine"]})'),
    ],
)
def test_the_replay_says_where_the_recording_is_from(others, sentence, tmp_path):
    parameters = {'mount_sim': SIM, 'mount_control': {'policy': 'continuous_viscous'}}
    content = {'parameters': parameters, 'versions': {**versions(), **others}}
    record_core(tmp_path / 'drive', parameters, session_text(content))
    outcome = replay(tmp_path / 'drive')
    assert outcome.held
    assert sentence in ' '.join(outcome.sentences())
    assert outcome.figures['recorded_with'] == others
