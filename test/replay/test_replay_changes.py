"""The parameters of a replay: as recorded, but for what is changed."""

from engine_mount.drives.replay import with_changes

RECORDED = {
    'mount_init': {'peak_current': 2.5},
    'mount_control': {'damper': 'viscous_2000', 'friction.a_p1': 0.4, 'contact.contact_stiffness': 3e6},
}


def test_what_is_changed_holds_and_the_rest_is_as_recorded():
    changed = with_changes(RECORDED, {'mount_control': {'friction.a_p1': 0.5}})
    assert changed == {
        'mount_init': {'peak_current': 2.5},
        'mount_control': {**RECORDED['mount_control'], 'friction.a_p1': 0.5},
    }


def test_another_specimen_takes_the_friction_of_the_one_before_with_it():
    changes = {'mount_control': {'parameters_file': 'left.yaml', 'friction.a_p2': 0.1}}
    assert with_changes(RECORDED, changes)['mount_control'] == {
        'damper': 'viscous_2000',
        'parameters_file': 'left.yaml',
        'friction.a_p2': 0.1,
    }
