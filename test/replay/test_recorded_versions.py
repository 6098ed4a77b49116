"""A replay tells with which versions and on which processor the recording was made."""

import io

import pytest

from engine_mount.drives.loop.recording import record_core
from engine_mount.drives.replay import CORE, LOCKSTEP, ReplayOrder, replay
from engine_mount.drives.summary import print_replay, replay_figures
from engine_mount.recordings.screen import Screen
from mount_recorder.session import session_text
from mount_recorder.versions import versions

SIM = {'scenario': 'bench', 'timeline.start': 2.8, 'timeline.duration': 0.1}


@pytest.mark.parametrize(
    ('others', 'sentence'),
    [
        ({}, 'made with the same versions on the same kind of processor'),
        ({'processor': 'Z80'}, f'others than here: processor Z80 (here {versions()["processor"]})'),
    ],
)
@pytest.mark.parametrize('mode', [CORE, LOCKSTEP])
def test_the_replay_is_equal_and_says_where_the_recording_is_from(others, sentence, mode, domain, tmp_path):
    parameters = {'mount_sim': SIM, 'mount_control': {'policy': 'continuous_viscous'}}
    content = {'parameters': parameters, 'versions': {**versions(), **others}}
    record_core(tmp_path / 'drive', parameters, session_text(content))
    outcome = replay(ReplayOrder(tmp_path / 'drive', mode, out=tmp_path / 'replay', domain=domain))
    figures, shown = replay_figures(outcome), io.StringIO()
    print_replay(outcome, figures, Screen(shown))
    assert outcome.held
    assert sentence in shown.getvalue()
    assert figures['recorded_with'] == others
