"""Bad input ends in one clear sentence and a non-zero exit code, before anything moves."""

from pathlib import Path

import numpy as np
import pytest

from engine_mount.cli.command import main

PAPER = ('--set', 'mount_control.policy=switched_viscous')


@pytest.fixture(autouse=True)
def own_folder(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv('COLUMNS', '200')


def _csv(path, times, values):
    rows = '\n'.join(f'{t},{v}' for t, v in zip(times, values, strict=True))
    path.write_text(f't,az\n{rows}\n')
    return path


TIMES = np.arange(500) / 100.0
WAVE = np.sin(2 * np.pi * 8.0 * TIMES)


@pytest.fixture
def bad_inputs(tmp_path):
    backwards = TIMES.copy()
    backwards[200] = backwards[100]
    return {
        'good': _csv(tmp_path / 'good.csv', TIMES, WAVE),
        'backwards': _csv(tmp_path / 'backwards.csv', backwards, WAVE),
        'gap': _csv(tmp_path / 'gap.csv', np.where(TIMES > 2.0, TIMES + 1.0, TIMES), WAVE),
        'slow': _csv(tmp_path / 'slow.csv', TIMES * 100.0, WAVE),
        'missing': tmp_path / 'missing.csv',
    }


@pytest.mark.parametrize(
    ('which', 'column', 'words'),
    [
        ('missing', 'az', ('missing.csv: no such file or folder',)),
        ('good', 'ay', ("has no column 'ay'", 'its columns are t, az')),
        ('good', 'az', ('no unit is said', 'it could be m/s^2, g', 'write --column acceleration=az:m/s^2')),
        ('backwards', 'az:m/s^2', ('time does not rise at sample 200',)),
        ('gap', 'az:m/s^2', ('has a gap of 1.010 s at 2.000 s',)),
        ('slow', 'az', ('samples per second', 'these look like ms: write --time t:ms')),
    ],
)
def test_bad_recorded_input_is_refused(capsys, bad_inputs, which, column, words):
    order = ('--scenario', 'recorded', '--file', str(bad_inputs[which]), '--column', column)
    _expect_refusal(capsys, order, *words)


@pytest.mark.parametrize(
    ('options', 'words'),
    [
        (('--scenario', 'race'), ("scenario 'race' is unknown", 'motorway, bench, sweep, recorded')),
        (('--mount', 'rubber'), ("mount 'rubber' is unknown", 'friction, friction_off', 'hydro, elastomer')),
        (
            ('--mount', 'friction_always_on', '--set', 'mount_control.policy=continuous_viscous'),
            ('needs mount_control.policy switched_viscous', 'received continuous_viscous'),
        ),
        (
            ('--set', 'mount_control.switch_on_level=0.0006'),
            ('switch_on_level of the policy switched_viscous', 'set mount_control.policy to'),
        ),
        (('--scenario', 'sweep', '--duration', '60'), ('duration (60 s)', '(49 s)')),
        (('--scenario', 'recorded'), ('needs a file',)),
        ((*PAPER, '--set', 'mount_control.quality=5e1'), ('quality (50', '0.3 .. 5')),
        (('--set', 'mount_control.qualty=1'), ("'qualty' is no parameter of mount_control", 'quality')),
        (
            ('--set', 'mount_kontrol.quality=1'),
            ("'mount_kontrol.quality' is no parameter", 'mount_control.quality'),
        ),
        ((*PAPER, '--set', 'mount_control.damper=soft'), ("'soft'", 'viscous_2000')),
        (('--fault', 'flat_tyre@3'), ("fault 'flat_tyre' is unknown",)),
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
