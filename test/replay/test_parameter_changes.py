"""A recording in the middle of which parameters were changed, put through the controller again."""

import numpy as np
import pytest

from engine_mount.drives.loop.recording import record_core
from engine_mount.drives.loop.run import CoreChain, MountRun
from engine_mount.drives.replay import replay
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
    take_many, end = MountRun.take_many, MountRun.end
    values = {**PARAMETERS['mount_control'], 'damper': 'viscous_2000'}

    def take_many_and_change(self):
        stamp, chain = self.stamp, self.chain
        if len(told) < len(CHANGES) and stamp >= CHANGES[len(told)][0] * 1e9:
            _, _, changes = CHANGES[len(told)]
            values.update({name: new for name, (_, new) in changes.items()})
            chain.loop.controller.change(_law(chain, values))
            told.append((stamp, dated(stamp, change_text('mount_control', changes))))
        return take_many(self)

    def end_and_report(self):
        end(self)
        for stamp, text in told:
            self._sink._write(EVENT, string_message(text), stamp)

    patch.setattr(MountRun, 'take_many', take_many_and_change)
    patch.setattr(MountRun, 'end', end_and_report)
    record_core(folder, PARAMETERS, session_text({'scenario': 'bench', 'parameters': PARAMETERS}))
    patch.undo()
    assert len(told) == 2
    return folder, told


def _law(chain: CoreChain, values):
    settings = chosen_control({'mount_control': values})
    return ControlLaw(settings, settings.table(*chain.result.table, chain.result.offset_current))


def test_the_replay_changes_them_at_the_same_samples_to_the_bit(changed_drive):
    folder, told = changed_drive
    outcome = replay(folder)
    assert outcome.agreement.agrees, outcome.agreement
    assert outcome.given.changes[0].values == {'damper': 'viscous_3500'}
    notes = [note for note in outcome.given.notes if 'was told' in note]
    assert len(notes) == 3
    assert f'mount_control was told damper = viscous_3500 at {told[0][0] / 1e9:.3f} s' in notes[0]
    assert all(note.endswith('the replay does the same') for note in notes)


def test_what_the_replay_is_asked_for_stays_as_asked(changed_drive):
    outcome = replay(changed_drive[0], {'damper': 'viscous_1000'})
    assert [sorted(change.values) for change in outcome.given.changes] == [['eigenfrequency', 'lead_time']]
    (run,) = outcome.replayed.runs
    moving = run.traces['damping_active'] == 1.0
    wanted = np.abs(run.traces['desired_force'][moving]).max()
    speed = np.abs(run.traces['predicted_velocity'][moving]).max()
    assert wanted == pytest.approx(1000.0 * (speed - 0.004), rel=1e-6)
