"""Settings as the user writes them, before a node or a core run has them."""

import numpy as np
import pytest

from mount_bringup.settings import checked_settings, settings_of_options
from mount_models.damper import DamperError, damper_curve

POINTS = {'velocity': [0.0, 0.004, 0.1], 'force': [0.0, 0.0, 200.0]}


@pytest.mark.parametrize(
    ('option', 'curve'),
    [
        ('viscous_2500', damper_curve('viscous_2500')),
        ('{law: viscous, dead_zone: 0.002}', damper_curve({'law': 'viscous', 'dead_zone': 0.002})),
        ('{velocity: [0, 0.004, 0.1], force: [0, 0, 200]}', damper_curve(POINTS)),
    ],
)
def test_a_damper_is_given_to_core_and_nodes_in_one_text(option, curve):
    settings = checked_settings(settings_of_options([f'mount_control.damper={option}']))
    assert isinstance(settings['mount_control']['damper'], str)  # what a node can declare
    assert np.array_equal(damper_curve(settings['mount_control']['damper']).table, curve.table)


def test_the_points_of_a_file_are_in_the_settings_so_that_a_session_keeps_them(tmp_path):
    file = tmp_path / 'own.csv'
    file.write_text('velocity,force\n0,0\n0.004,0\n0.1,200\n')
    settings = checked_settings(settings_of_options([f'mount_control.damper={file}']))
    file.unlink()
    assert np.array_equal(damper_curve(settings['mount_control']['damper']).table, damper_curve(POINTS).table)
    with pytest.raises(DamperError, match='cannot be read'):
        checked_settings({'mount_control': {'damper': str(file)}})
