"""Bad input ends in one clear sentence and a non-zero exit code, before anything moves."""

import numpy as np
import pytest


def _csv(path, times, values):
    rows = '\n'.join(f'{t},{v}' for t, v in zip(times, values, strict=True))
    path.write_text(f't,az\n{rows}\n')
    return path


TIMES = np.arange(500) / 100.0
WAVE = np.sin(2 * np.pi * 8.0 * TIMES)


@pytest.fixture
def bad_inputs(tmp_path):
    with_nan = WAVE.copy()
    with_nan[123] = np.nan
    backwards = TIMES.copy()
    backwards[200] = backwards[100]
    return {
        'good': _csv(tmp_path / 'good.csv', TIMES, WAVE),
        'nan': _csv(tmp_path / 'nan.csv', TIMES, with_nan),
        'backwards': _csv(tmp_path / 'backwards.csv', backwards, WAVE),
        'gap': _csv(tmp_path / 'gap.csv', np.where(TIMES > 2.0, TIMES + 1.0, TIMES), WAVE),
        'slow': _csv(tmp_path / 'slow.csv', TIMES * 100.0, WAVE),
        'missing': tmp_path / 'missing.csv',
    }


@pytest.mark.parametrize(
    ('which', 'column', 'words'),
    [
        ('missing', 'az', ('missing.csv does not exist',)),
        ('good', 'ay', ("'ay' is not in", 'its columns are t, az')),
        ('nan', 'az', ('value number 123 is nan', '1 such of 500')),
        ('backwards', 'az', ('time does not rise at sample 200',)),
        ('gap', 'az', ('has a gap of 1.010 s at 2.000 s',)),
        ('slow', 'az', ('samples per second', 'is its time in seconds?')),
    ],
)
def test_bad_recorded_input_is_refused(command, bad_inputs, which, column, words):
    result = command.drive(
        '--lockstep', '--scenario', 'recorded', '--file', str(bad_inputs[which]), '--column', column
    )
    _expect_refusal(result, *words)


@pytest.mark.parametrize(
    ('options', 'words'),
    [
        (('--scenario', 'race'), ("scenario 'race' is unknown", 'motorway, bench, recorded')),
        (('--scenario', 'recorded'), ('needs a file',)),
        (('--set', 'mount_control.quality=50'), ('quality (50', '0.3 .. 5')),
        (('--set', 'mount_control.qualty=1'), ("'qualty' is no parameter of mount_control", 'quality')),
        (('--set', 'mount_kontrol.quality=1'), ("'mount_kontrol' is no node",)),
        (('--set', 'mount_control.damper=soft'), ("'soft'", 'viscous_2000')),
        (('--set', 'mount_control.switch_off_level=0.0009'), ('switch_off_level (0.9 mm)', 'below')),
        (('--set', 'mount_sim.mechanics.contact_gap=0.0006'), ('contact_gap (600.0 um)', 'rest_gap')),
        (('--set', 'mount_sim.fault.kind=flat_tyre'), ("fault 'flat_tyre' is unknown",)),
        (('--set', 'mount_driver.channel=127.0.0.1'), ('multicast',)),
        (('--set', 'mount_driver.interface=socketcan'), ('CAN interface', 'does not open')),
        (('--domain', '400'), ("ROS domain '400'", '0 .. 101')),
    ],
)
def test_impossible_orders_are_refused(command, options, words):
    _expect_refusal(command.drive('--lockstep', '--duration', '1', *options), *words)


def test_a_folder_in_use_is_refused(command, tmp_path):
    (tmp_path / 'run_1').mkdir()
    (tmp_path / 'run_1' / 'precious').touch()
    _expect_refusal(command.drive('--core'), 'exists and is not empty', '--out')


def _expect_refusal(result, *words):
    assert result.code not in (0, 130), result.output
    assert 'Traceback' not in result.output
    for word in words:
        assert word in ' '.join(result.output.split()), result.output
