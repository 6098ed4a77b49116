"""A displacement that somebody else recorded, on its way to the controller: whatever its stamps are like."""

import numpy as np
import pytest
from ros_testing import serialised
from sensor_msgs.msg import JointState

from engine_mount.drives.inputs.foreign import default_gap, foreign_input, foreign_order
from engine_mount.signals.signal import SignalError
from mount_recorder.bag_writer import BagWriter

TIMES = np.arange(1000) / 100.0
MILLIMETRES = 0.8 * np.sin(2.0 * np.pi * 8.0 * TIMES) + 0.1 * np.random.default_rng(1).standard_normal(1000)


def write(folder, times=TIMES, *columns):
    path = folder / 'pot.csv'
    rows = np.column_stack([times, *(columns or (MILLIMETRES,))])
    np.savetxt(path, rows, '%.7f', delimiter=',', header='t,x,y'[: 1 + 2 * rows.shape[1] - 2], comments='')
    return path


def given(path, *maps, scale=1e-3, offset='mean'):
    return foreign_input(
        path, foreign_order(list(maps) or ['displacement=x'], scale, offset), {}, default_gap({})
    )


def displacement_of(found):
    return found.controls[0].displacement


def test_it_is_at_1_khz_and_true(tmp_path):
    sine = np.sin(2.0 * np.pi * 8.0 * TIMES)
    found = given(write(tmp_path, TIMES, sine), offset='0')
    run = found.controls[0]
    assert set(np.diff(run.stamps)) == {1_000_000}
    expected = 1e-3 * np.sin(2.0 * np.pi * 8.0 * (run.stamps - run.stamps[0]) / 1e9)
    inside = slice(500, -500)
    assert np.abs(run.displacement - expected)[inside].max() < 1e-6
    assert any('resampled from 100 Hz to 1 kHz, band-limited' in note for note in found.notes)


def test_a_displacement_beyond_the_range_is_refused_with_its_sample(tmp_path):
    values = np.where(np.arange(1000) == 321, 400.0, MILLIMETRES)
    with pytest.raises(SignalError, match=r'displacement at 1 kHz: sample 3210 at 3\.2100 s is .* m, beyond'):
        given(write(tmp_path, TIMES, values))
    with pytest.raises(SignalError, match='write --map displacement=x:mm'):
        given(write(tmp_path), scale=1.0)


def test_engine_minus_chassis_by_their_own_times(tmp_path):
    for name, begin in (('engine', 100.0), ('chassis', 102.0)):
        times = begin + TIMES
        np.save(tmp_path / f'{name}_t.npy', times)
        np.save(tmp_path / f'{name}_value.npy', np.sin(2.0 * np.pi * 7.3 * times) + (name == 'engine'))
    found = given(tmp_path, 'engine_displacement=engine.0', 'chassis_displacement=chassis.0', offset='0')
    assert found.controls[0].stamps[0] == 102_000_000_000
    assert np.abs(displacement_of(found) - 1e-3)[500:-500].max() < 1e-6


def test_a_field_of_a_bag_by_its_stamps(tmp_path):
    writer = BagWriter(tmp_path / 'bag')
    writer.add_topic('/pot', 'sensor_msgs/msg/JointState')
    for time, value in zip(TIMES, MILLIMETRES, strict=True):
        stamp = 1_700_000_000_000_000_000 + round(1e9 * time)
        message = JointState(name=['range'], position=[value if time != 3.0 else np.nan])
        message.header.stamp.sec, message.header.stamp.nanosec = divmod(stamp, 10**9)
        writer.write('/pot', serialised(message), stamp + 5_000_000)
    writer.close()
    found = given(tmp_path / 'bag', 'displacement=/pot.range')
    assert found.controls[0].stamps[0] == 1_700_000_000_000_000_000
    assert '/pot.range: 999 samples at 100 Hz, by their header stamps' in found.notes
    assert '/pot.range: 1 samples without a number are left out' in found.notes
    with pytest.raises(SignalError, match=r'its columns are /pot\.range'):
        given(tmp_path / 'bag', 'displacement=/pot')
    with pytest.raises(SignalError, match=r"has no column '/pot\.length'; its columns are"):
        given(tmp_path / 'bag', 'displacement=/pot.length')


@pytest.mark.parametrize(
    ('times', 'reason'),
    [
        (TIMES * 2.0, 'has 50 samples per second .*at least 100 are needed'),
        (TIMES + 0.3 * (TIMES > 5.0), r'has a gap of 0\.310 s at 5\.000 s'),
        (TIMES * 0.01, 'no overlap of 0.5 s or more'),
    ],
)
def test_what_the_controller_cannot_follow_is_refused(tmp_path, times, reason):
    with pytest.raises(ValueError, match=reason):
        given(write(tmp_path, times))
