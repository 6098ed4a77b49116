"""The settings of each mount of a car."""

import pytest

from engine_mount.settings.options import mounts_of, settings_of_mounts
from mount_models.quantity import ParameterError

MOUNTS = ('left', 'right')
SETTINGS = {
    'mount_sim': {'mounts': 'left,right', 'friction.scale': 1.1, 'mount_left.friction.scale': 1.2},
    'mount_control': {'highest_current': 2.0, 'longest_bridge': 3},
    'left/mount_control': {'highest_current': 1.0},
}


def test_own_settings_of_a_mount_come_before_those_of_all():
    assert mounts_of(SETTINGS) == MOUNTS
    left, right = settings_of_mounts(SETTINGS).values()
    assert left['mount_control'] == {'highest_current': 1.0, 'longest_bridge': 3}
    assert right['mount_control'] == SETTINGS['mount_control']
    assert (left['mount_sim']['friction.scale'], right['mount_sim']['friction.scale']) == (1.2, 1.1)


def test_one_mount_alone_has_the_settings_as_they_are():
    settings = {'mount_sim': {'seed': 2}, 'mount_control': {'policy': 'switched_viscous'}}
    assert settings_of_mounts(settings) == {'': settings}
    with pytest.raises(ParameterError, match='its mounts are one alone'):
        mounts_of({'left/mount_control': {}})
