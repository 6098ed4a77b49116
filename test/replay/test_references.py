"""The recordings in bags/reference, replayed: every setpoint and intermediate to the bit as accepted."""

from pathlib import Path

import numpy as np
import pytest
from reference_differences import differences_from_reference

from engine_mount.drives.inputs.consumed_samples import Notes
from engine_mount.drives.inputs.input import parameters_of, session_of
from engine_mount.drives.replay import replay
from engine_mount.recordings.events import switching_times
from engine_mount.recordings.recording import open_recording
from engine_mount.recordings.reference import ACCEPTED_NAME
from engine_mount.recordings.session import (
    recorded_session,
    session_content,
    session_parameters,
    version_differences,
    versions_sentence,
)
from mount_recorder.versions import versions

REFERENCES = sorted(
    folder for folder in (Path(__file__).parents[2] / 'bags' / 'reference').iterdir() if folder.is_dir()
)


@pytest.mark.parametrize('lockstep', [False, True], ids=['core', 'lock-step'])
@pytest.mark.parametrize('reference', REFERENCES, ids=lambda folder: folder.name)
def test_the_accepted_setpoints_are_met_to_the_bit(reference, lockstep, domain, tmp_path):
    outcome = replay(reference, lockstep=lockstep, out=tmp_path / 'replay', domain=domain)
    told = differences_from_reference(reference, outcome.recording)
    assert not told, '\n'.join(
        [
            f'{reference.name}, {outcome.mode}:',
            *told,
            versions_sentence(version_differences(outcome.given.session, versions()), versions()),
            f'if this is meant: engine-mount accept REPLAY --reference {reference.name} --reason "..."',
        ]
    )


@pytest.mark.parametrize('reference', REFERENCES, ids=lambda folder: folder.name)
def test_those_from_before_there_were_policies_are_of_the_first(reference):
    recording = open_recording(reference)
    named = session_parameters(session_content(recorded_session(recording)))['mount_control'].get('policy')
    told = {'opening': 'continuous_viscous', 'fault': 'switched_viscous'}  # since then
    assert named == told.get(reference.name)
    chosen = parameters_of(session_of(recording, Notes()), Notes())['mount_control']['policy']
    assert chosen == (named or 'switched_viscous')


def test_of_the_continuous_law_damping_opens_and_closes_under_an_idling_engine():
    trace = open_recording(REFERENCES[0].with_name('opening'))['control_trace']
    opening = trace['damping_active']
    on, off = switching_times(trace.time, opening)
    assert len(on) == len(off) == 1
    assert opening.max() > 0.5
    assert len(np.unique(opening)) > 1000  # neither on nor off, but between
    assert trace['idle_amplitude'][-1] > 1e-5


def test_all_kinds_of_drives_are_there_with_a_reason_and_small():
    assert [folder.name for folder in REFERENCES] == ['fault', 'gap', 'initialisation', 'opening', 'rough']
    assert all('reason:' in (folder / ACCEPTED_NAME).read_text() for folder in REFERENCES)
    size = sum(path.stat().st_size for folder in REFERENCES for path in folder.iterdir())
    assert size < 5_000_000
