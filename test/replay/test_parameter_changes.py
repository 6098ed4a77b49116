"""A recording in the middle of which parameters were changed, put through the controller again."""

import numpy as np
import pytest

from engine_mount.drives.loop import recording as core_recording
from engine_mount.drives.loop import run as core_run
from engine_mount.drives.loop.chain import CoreChain
from engine_mount.drives.loop.recording import record_core
from engine_mount.drives.replay import CORE, LOCKSTEP, ReplayOrder, _told, replay_without_output
from engine_mount.settings.chosen import chosen_control
from mount_control.controller import ControlLaw
from mount_recorder.session import session_text
from mount_ros.messages.cdr import string_message
from mount_ros.messages.event import change_text, dated
from mount_ros.topics import EVENT

PARAMETERS = {
    'mount_sim': {'scenario': 'bench', 'timeline.start': 2.8, 'timeline.duration': 2.0},
    'mount_control': {'policy': 'switched_viscous'},
}
CHANGES = [
    (3.4, 'viscous_2000', {'damper': ('viscous_2000', 'viscous_3500')}),
    (3.9, 'viscous_3500', {'eigenfrequency': (8.0, 7.0), 'lead_time': (0.0019, 0.004)}),
]


@pytest.fixture(scope='module')
def changed_drive(tmp_path_factory):
    """A core drive whose controller was changed twice, as mount_control would be, and what it told of it."""
    folder, told, patch = tmp_path_factory.mktemp('changed') / 'recording', [], pytest.MonkeyPatch()
    take_many, run_core = core_run._take_many, core_recording.run_core
    values = {**PARAMETERS['mount_control'], 'damper': 'viscous_2000'}

    def take_many_and_change(mount, chain, samples, pending):
        stamp = mount.sample * 1_000_000
        if len(told) < len(CHANGES) and stamp >= CHANGES[len(told)][0] * 1e9:
            _, _, changes = CHANGES[len(told)]
            values.update({name: new for name, (_, new) in changes.items()})
            chain.loop.controller.change(_law(chain, values))
            told.append((stamp, dated(stamp, change_text('mount_control', changes))))
        return take_many(mount, chain, samples, pending)

    def run_core_and_tell(parameters, write, *arguments):
        outcome = run_core(parameters, write, *arguments)
        for stamp, text in told:
            write(EVENT, string_message(text), stamp)
        return outcome

    patch.setattr(core_run, '_take_many', take_many_and_change)
    patch.setattr(core_recording, 'run_core', run_core_and_tell)
    record_core(folder, PARAMETERS, session_text({'scenario': 'bench', 'parameters': PARAMETERS}))
    patch.undo()
    assert len(told) == 2
    return folder, told


def _law(chain: CoreChain, values):
    settings = chosen_control({'mount_control': values})
    return ControlLaw(settings, settings.table(*chain.result.table, chain.result.offset_current))


def test_the_replay_changes_them_at_the_same_samples_to_the_bit(changed_drive):
    folder, told = changed_drive
    outcome = replay_without_output(ReplayOrder(folder, CORE))
    assert outcome.agreement.agrees, outcome.agreement
    assert outcome.given.changes[0].values == {'damper': 'viscous_3500'}
    notes = [note for note in outcome.given.notes if 'was told' in note]
    assert len(notes) == 3
    assert f'mount_control was told damper = viscous_3500 at {told[0][0] / 1e9:.3f} s' in notes[0]
    assert all(note.endswith('the replay does the same') for note in notes)


def test_what_the_replay_is_asked_for_stays_as_asked(changed_drive):
    folder, _ = changed_drive
    order = ReplayOrder(folder, CORE, changes={'mount_control': {'damper': 'viscous_1000'}})
    outcome = replay_without_output(order)
    assert [sorted(change.values) for change in outcome.given.changes] == [['eigenfrequency', 'lead_time']]
    (run,) = outcome.replayed.runs
    moving = run.traces['damping_active'] == 1.0
    wanted = np.abs(run.traces['desired_force'][moving]).max()
    speed = np.abs(run.traces['predicted_velocity'][moving]).max()
    assert wanted == pytest.approx(1000.0 * (speed - 0.004), rel=1e-6)


def test_a_replay_in_lock_step_says_that_it_does_not_change_them(changed_drive):
    folder, _ = changed_drive
    given = replay_without_output(ReplayOrder(folder, CORE)).given
    assert all(sentence.endswith('does not: use core') for sentence in _told(given, LOCKSTEP))
