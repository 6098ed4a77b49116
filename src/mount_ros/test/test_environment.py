"""What a process needs of its machine before the middleware starts."""

import os

import pytest

from mount_ros.environment import loopback_refusal, prepare_environment


@pytest.mark.parametrize('home', [None, '/proc'])
def test_logs_have_a_folder_where_home_is_none_or_cannot_be_written(monkeypatch, tmp_path, home):
    for name in ('ROS_LOG_DIR', 'ROS_HOME', 'HOME'):
        monkeypatch.delenv(name, raising=False)
    if home is not None:
        monkeypatch.setenv('HOME', home)
    monkeypatch.setattr('tempfile.tempdir', str(tmp_path))
    prepare_environment()
    assert os.environ['ROS_LOG_DIR'] == str(tmp_path / f'engine_mount_log_{os.getuid()}')
    monkeypatch.undo()


def test_a_loopback_interface_that_is_down_is_told_with_the_remedy(monkeypatch):
    assert loopback_refusal() == ''
    monkeypatch.setattr('mount_ros.environment._NEIGHBOUR', ('255.255.255.255', 9))  # refused without a flag
    assert loopback_refusal().startswith('the loopback interface is down (')
    assert loopback_refusal().endswith('): `ip link set lo up`')
