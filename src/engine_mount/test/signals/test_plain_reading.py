"""Signals in four formats: chosen, read with their times, refused with the place."""

import json

import numpy as np
import pytest
from ros_testing import serialised
from sensor_msgs.msg import Imu, JointState

from engine_mount.signals.loading import load_signal
from engine_mount.signals.signal import SignalError
from mount_recorder.bag_writer import BagWriter

RATE = 104.26  # Hz, of a common motion sensor


def _times(rate=RATE, duration=10.0):
    return np.arange(int(rate * duration)) / rate


def _sine(times, frequency=8.0):
    return np.sin(2.0 * np.pi * frequency * times)


@pytest.fixture
def csv(tmp_path):
    """Return a function that writes lines as a CSV file."""

    def write(*lines, name='drive.csv'):
        path = tmp_path / name
        path.write_text('\n'.join(lines) + '\n', encoding='utf-8')
        return path

    return write


@pytest.fixture
def npy(tmp_path):
    """Return a function that writes `name_value.npy` and `name_t.npy`."""

    def write(values, times=None, name='imu'):
        np.save(tmp_path / f'{name}_value.npy', values)
        if times is not None:
            np.save(tmp_path / f'{name}_t.npy', times)
        return tmp_path / f'{name}_value.npy'

    return write


def _lines(times, values, header='t,z'):
    return header, *(f'{t:.6f},{z:.6f}' for t, z in zip(times, values, strict=True))


def _refusal(*arguments, **choice):
    with pytest.raises(SignalError) as caught:
        load_signal(*arguments, **choice)
    return str(caught.value)


# CSV


def test_a_csv_column_is_found_by_name_and_time_by_its_usual_names(csv):
    times = _times()
    for header in ('t,z', 'Time,z', 'timestamp, z'):
        recorded = load_signal(csv(*_lines(times, _sine(times), header)), column='z')
        assert recorded.name == 'z'
        np.testing.assert_allclose(recorded.times, times, atol=1e-6)
        np.testing.assert_allclose(recorded.values, _sine(times), atol=1e-6)


def test_a_csv_column_is_found_by_number_and_time_by_choice(csv):
    times = _times()
    path = csv('z,x,when', *(f'{t * 2},{t * 3},{t}' for t in times))
    assert load_signal(path, column='0', time_column='when').values[7] == pytest.approx(2 * times[7])
    assert load_signal(path, column='x', time_column='2').values[7] == pytest.approx(3 * times[7])


def test_time_counts_from_the_first_sample_which_has_its_own(csv):
    times = _times()
    recorded = load_signal(csv(*_lines(times + 1000.0, times)), column='z')
    assert recorded.times[0] == 0.0
    assert recorded.begin == 1_000_000_000_000


def test_comments_blank_lines_and_a_byte_order_mark_do_no_harm(csv):
    times = _times()
    header, *lines = _lines(times, _sine(times))
    path = csv('\ufeff# a drive', '', header, *lines)
    assert len(load_signal(path, column='z').values) == len(times)
    assert len(load_signal(csv('\ufeff' + header, *lines), column='z', time_column='t').values) == len(times)


def test_csv_refusals_name_the_place(csv):
    times = _times()
    header, *lines = _lines(times, _sine(times))
    path = csv(header, *lines)
    assert "column 'q' is not in" in _refusal(path, column='q')
    assert 'its columns are t, z' in _refusal(path, column='2')
    assert "column '' is not in" in _refusal(path)
    assert "time column 'q' is not in" in _refusal(path, column='z', time_column='q')
    assert 'holds 1 lines; needed are a header and the samples' in _refusal(csv('t,z'), column='z')
    broken = csv('# made by hand', '', header, *lines[:5], '0.05,up', *lines[6:])
    assert "line 9: '0.05,up' is not a line of numbers" in _refusal(broken, column='z')
    short = csv(header, *lines[:5], '0.05')
    assert "line 7: '0.05' is not a line of numbers" in _refusal(short, column='z')


# NPY


def test_an_npy_file_of_one_column_needs_no_choice(npy):
    times = _times()
    for values in (_sine(times), _sine(times)[:, None]):
        recorded = load_signal(npy(values, times))
        assert recorded.name == 'imu.0'
        np.testing.assert_array_equal(recorded.values, _sine(times))


def test_a_column_of_an_npy_file_is_chosen_by_number(npy):
    times = _times()
    path = npy(np.c_[times, 2 * times, 3 * times].astype(np.float32), times[:, None])
    for column in ('2', 'imu.2'):
        np.testing.assert_allclose(load_signal(path, column=column).values, 3 * times, rtol=1e-6)


def test_a_signal_of_an_npy_folder_is_chosen_by_name_and_number(npy, tmp_path):
    times = _times()
    npy(np.c_[times, 2 * times], times, 'imu')
    npy(5 * times, times, 'wheel.speed')
    np.testing.assert_array_equal(load_signal(tmp_path, column='imu.1').values, 2 * times)
    np.testing.assert_array_equal(load_signal(tmp_path, column='wheel.speed.0').values, 5 * times)


def test_npy_refusals_name_what_there_is(npy, tmp_path):
    times = _times()
    path = npy(np.c_[times, times], times)
    assert "'imu.2' is none of them" in _refusal(path, column='imu.2')
    assert "has the columns 0 to 1; column '' is none of them" in _refusal(path)
    assert 'names no signal in' in _refusal(path, column='imu.z')
    npy(times, times, 'gyro')
    assert 'there are gyro (1 columns), imu (2 columns); choose as in --column gyro.0' in _refusal(
        tmp_path, column='nothing.0'
    )
    assert 'imu_t.npy is missing beside it' in _refusal(_without_times(tmp_path))


def _without_times(folder):
    (folder / 'imu_t.npy').unlink()
    return folder / 'imu_value.npy'


def test_an_empty_folder_is_refused(tmp_path):
    assert 'holds no pair of files x_value.npy and x_t.npy' in _refusal(tmp_path)


@pytest.mark.parametrize(
    ('values', 'what'),
    [
        (np.zeros((50, 3, 2)), 'float64 of shape (50, 3, 2)'),
        (np.zeros(50, complex), 'complex128 of shape (50,)'),
        (np.zeros(50, [('a', 'f8')]), "[('a', '<f8')] of shape (50,)"),
        (np.zeros(50, 'U3'), '<U3 of shape (50,)'),
        (np.array(3.0), 'float64 of shape ()'),
    ],
)
def test_what_is_no_table_of_real_numbers_is_refused(npy, values, what):
    assert f'holds {what}; needed are real numbers' in _refusal(
        npy(values, np.arange(50) / 100.0), column='0'
    )


def test_a_file_that_only_looks_like_npy_is_refused(npy, tmp_path):
    path = npy(np.zeros(50), np.arange(50) / 100.0)
    path.write_bytes(b'no numbers here')
    assert 'is no readable NPY file of numbers' in _refusal(path)
    with path.open('wb') as stream:
        np.savez(stream, a=np.zeros(50))
    assert 'holds an archive; needed are real numbers' in _refusal(path)


# MCAP


def _imu_recording(folder, times, values, topic='/imu'):
    writer = BagWriter(folder)
    writer.add_topic(topic, 'sensor_msgs/msg/Imu')
    writer.add_topic('/joint', 'sensor_msgs/msg/JointState')
    message = Imu()
    for t, z in zip(times, values, strict=True):
        stamp = 1_700_000_000_000_000_000 + round(1e9 * t)
        message.header.stamp.sec, message.header.stamp.nanosec = divmod(stamp, 10**9)
        message.linear_acceleration.z = float(z)
        writer.write(topic, serialised(message), stamp + 3_000_000)
        writer.write('/joint', serialised(JointState()), stamp)
    writer.close()
    return folder


def test_a_field_of_an_mcap_topic_is_read_with_its_header_stamps(tmp_path):
    times = _times(duration=3.0)
    folder = _imu_recording(tmp_path / 'bag', times, 9.81 + _sine(times))
    for file in (folder, next(folder.glob('*.mcap'))):
        recorded = load_signal(file, topic='/imu', column='linear_acceleration.z')
        assert recorded.name == '/imu.linear_acceleration.z'
        np.testing.assert_allclose(recorded.times, times, atol=1e-6)
        np.testing.assert_array_equal(recorded.values, 9.81 + _sine(times))


def test_a_split_recording_is_read_in_the_order_of_its_parts(tmp_path):
    times = _times(duration=6.0)
    whole = tmp_path / 'whole'
    whole.mkdir()
    for number, part in enumerate(np.array_split(times, 12)):
        folder = _imu_recording(tmp_path / f'part_{number}', part, part)
        next(folder.glob('*.mcap')).rename(whole / f'drive_{number}.mcap')
    recorded = load_signal(whole, topic='/imu', column='linear_acceleration.z')
    np.testing.assert_array_equal(recorded.values, times)


def test_mcap_refusals(tmp_path):
    times = _times(duration=3.0)
    folder = _imu_recording(tmp_path / 'bag', times, times)
    assert 'name a topic and a field' in _refusal(folder, column='linear_acceleration.z')
    assert 'name a topic and a field' in _refusal(folder, topic='/imu')
    assert "has no topic 'imo'; it has /imu, /joint" in _refusal(folder, topic='imo', column='x')
    unknown = _refusal(folder, topic='/imu', column='linear_acceleration.w')
    assert "/imu has no number 'linear_acceleration.w'; it has" in unknown
    assert 'linear_acceleration.z' in unknown
    assert "has no number 'header'" in _refusal(folder, topic='/imu', column='header')
    cut = tmp_path / 'cut.mcap'
    cut.write_bytes(b'no recording')
    assert 'cut.mcap' in _refusal(cut, topic='/imu', column='linear_acceleration.z')


def test_messages_without_a_number_are_left_out_and_counted(tmp_path):
    times = _times(duration=3.0)
    values = np.where(np.arange(times.size) == 7, np.nan, times)
    recorded = load_signal(
        _imu_recording(tmp_path / 'bag', times, values), topic='/imu', column='linear_acceleration.z'
    )
    np.testing.assert_array_equal(recorded.values, np.delete(times, 7))
    assert recorded.notes == ('1 samples without a number are left out',)


# JSON


def test_columns_of_json_rows_are_chosen_by_number(tmp_path):
    times = _times()
    path = tmp_path / 'rows.json'
    path.write_text(json.dumps({'data': [[t, 2 * t, 3 * t] for t in times.tolist()]}))
    np.testing.assert_array_equal(load_signal(path, column='2').values, 3 * times)
    np.testing.assert_array_equal(load_signal(path, column='0', time_column='1').times, 2 * times)
    assert "column '3' is not in" in _refusal(path, column='3')


@pytest.mark.parametrize(
    ('text', 'reason'),
    [
        ('[[0, 1]]', 'is no table'),
        ('{"data": 3}', 'is no table'),
        ('{', 'is no table'),
        ('{"data": []}', 'its 0 rows hold no numbers'),
        ('{"data": [[0, 1], [1]]}', 'its 2 rows hold 1, 2 numbers'),
        ('{"data": [[0, 1], [1, null]]}', "line 2: '1,None' is not a line of numbers"),
    ],
)
def test_json_that_is_no_table_of_numbers_is_refused(tmp_path, text, reason):
    path = tmp_path / 'rows.json'
    path.write_text(text)
    assert reason in _refusal(path, column='1')


# Every format


def test_a_missing_or_unknown_file_is_refused(tmp_path):
    assert 'does not exist; give an existing CSV' in _refusal(tmp_path / 'no.csv')
    (tmp_path / 'a.wav').write_bytes(b'')
    assert 'a.wav: files of type .wav are not read; use .csv' in _refusal(tmp_path / 'a.wav')


@pytest.mark.parametrize(
    ('change', 'reason'),
    [
        (lambda t, z: (t, z[:-1]), '1042 times but 1041 values; both must be of equal length'),
        (lambda t, z: (t[:9], z[:9]), 'has 9 samples; at least 10 are needed'),
        (lambda t, z: (t[:0], z[:0]), 'has 0 samples; at least 10 are needed'),
        (lambda t, z: (t, _changed(z, [7, 9], np.nan)), 'value number 7 is nan (2 such of 1042)'),
        (lambda t, z: (t, _changed(z, 7, np.inf)), 'value number 7 is inf'),
        (lambda t, z: (_changed(t, 7, np.nan), z), 'time number 7 is nan'),
    ],
)
def test_what_is_no_signal_is_refused_with_the_place(npy, change, reason):
    times = _times()
    changed_times, changed_values = change(times, _sine(times))
    assert reason in _refusal(npy(changed_values, changed_times))


def _changed(numbers, place, value):
    copy = numbers.copy()
    copy[place] = value
    return copy
