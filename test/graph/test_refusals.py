"""Bad input ends in one clear sentence and a non-zero exit code, before anything moves."""

from pathlib import Path

import numpy as np
import pytest

from engine_mount.cli.command import main


@pytest.fixture(autouse=True)
def own_folder(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv('COLUMNS', '200')


@pytest.mark.parametrize(
    ('column', 'words'),
    [
        ('ay', ("has no column 'ay'", 'its columns are t, az')),
        ('az', ('no unit is said', 'it could be m/s^2, g', 'write --column acceleration=az:m/s^2')),
        ('az:m/s^2', ('has a gap of 1.010 s at 2.000 s',)),
    ],
)
def test_bad_recorded_input_is_refused(capsys, tmp_path, column, words):
    times = np.arange(500) / 100.0
    values = np.c_[np.where(times > 2.0, times + 1.0, times), np.sin(16.0 * np.pi * times)]
    np.savetxt(tmp_path / 'gap.csv', values, delimiter=',', header='t,az', comments='')
    order = ('--scenario', 'recorded', '--file', str(tmp_path / 'gap.csv'), '--column', column)
    _expect_refusal(capsys, order, *words)


@pytest.mark.parametrize(
    ('options', 'words'),
    [
        (
            ('--mount', 'friction_always_on', '--set', 'mount_control.policy=continuous_viscous'),
            ('needs mount_control.policy switched_viscous', 'received continuous_viscous'),
        ),
        (
            ('--set', 'mount_control.switch_on_level=0.0006'),
            ('switch_on_level of the policy switched_viscous', 'set mount_control.policy to'),
        ),
        (('--scenario', 'recorded'), ('needs a file',)),
        (('--set', 'mount_control.qualty=1'), ("'qualty' is no parameter of mount_control", 'quality')),
        (('--core', '--fault', 'lost_5@3'), ('fault lost_5 shows on the CAN bus only',)),
        (('--domain', '400'), ("ROS domain '400'", '0 .. 101')),
    ],
)
def test_impossible_orders_are_refused(capsys, options, words):
    _expect_refusal(capsys, options, *words)


def test_a_folder_in_use_is_refused(capsys, tmp_path):
    (tmp_path / 'precious').touch()
    _expect_refusal(capsys, ('--out', str(tmp_path)), 'exists and is not empty', '--out')


@pytest.mark.slow
def test_a_can_interface_that_does_not_open_is_refused(command):
    # one process in lock-step, five in real time: the node, its refusal and who tells it are the same
    result = command.drive('--lockstep', '--duration', '1', '--set', 'mount_driver.interface=socketcan')
    assert result.code == 1
    _expect_words(result.output, "CAN interface 'socketcan'", 'does not open', 'ip link set')


def _expect_refusal(capsys, options, *words):
    """Run the command in this process: it must refuse before it starts another."""
    with pytest.raises(SystemExit) as ending:
        main(['drive', *options])
    assert ending.value.code not in (0, None, 130)
    assert not Path('bags').exists(), 'a refused order must leave nothing behind'
    _expect_words(capsys.readouterr().err, *words)


def _expect_words(output, *words):
    assert 'Traceback' not in output
    for word in words:
        assert word in ' '.join(output.split()), output
