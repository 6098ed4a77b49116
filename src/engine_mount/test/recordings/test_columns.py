"""Columns read block by block: the numbers of all messages at once, in a memory of their own size."""

import tracemalloc

import numpy as np
import pytest
from recorded_drive import PERIOD, START, joint_state, write_drive

import engine_mount
from engine_mount.recordings import SeriesError
from engine_mount.recordings.mcap_file import McapFile
from mount_recorder.bag_writer import BagWriter
from mount_ros.topics import DISPLACEMENT, JOINT_STATE, SIM_MOUNT_FORCE

COUNT = 500


def test_columns_and_stamps_are_those_of_all_messages_in_one_pass(drive, monkeypatch):
    whole, some = engine_mount.open(drive), engine_mount.open(drive)
    whole.load(['displacement', 'coil_ripple'])
    some.load_columns({'displacement': ['mount'], 'coil_ripple': ['flux_density', 'coil_current']})
    monkeypatch.setattr(McapFile, 'blocks', lambda file, topics: pytest.fail('read again'))
    for topic, names in (('displacement', ['mount']), ('coil_ripple', ['coil_current', 'flux_density'])):
        for name in names:
            np.testing.assert_array_equal(some[topic][name], whole[topic][name])
        for what in ('stamps', 'receive_times', 'time'):
            np.testing.assert_array_equal(getattr(some[topic], what), getattr(whole[topic], what))
        assert len(some[topic]) == COUNT
        assert not some[topic].loaded


def test_what_else_is_asked_of_a_topic_is_read_then(drive):
    some, whole = engine_mount.open(drive), engine_mount.open(drive)
    some.load_columns({'coil_ripple': ['coil_current']})
    series = some['coil_ripple']
    assert not series.loaded
    np.testing.assert_array_equal(series.publish_times, whole['coil_ripple'].publish_times)
    assert series.names == ('coil_current', 'flux_density')
    np.testing.assert_array_equal(series['flux_density'], whole['coil_ripple']['flux_density'])
    np.testing.assert_array_equal(series.derivative('flux_density'), -series['flux_density'])
    assert series.message(COUNT - 1).name == whole['coil_ripple'].message(COUNT - 1).name
    with pytest.raises(SeriesError, match='it has coil_current, flux_density'):
        series['nothing']


@pytest.fixture
def changing(tmp_path):
    """Return a recording in which the last messages have one name more."""
    writer = BagWriter(tmp_path / 'bag')
    writer.add_topic('/displacement', JOINT_STATE)
    for index in range(COUNT):
        names = ['mount'] if index < 400 else ['other', 'mount']
        raw = joint_state(START + index * PERIOD, names, np.arange(float(len(names))) + index, np.empty(0))
        writer.write('/displacement', raw, START + index * PERIOD)
    writer.close()
    return tmp_path / 'bag'


def test_a_column_that_not_every_message_has_is_that_of_all_messages(changing):
    some, whole = engine_mount.open(changing), engine_mount.open(changing)
    some.load_columns({'displacement': ['mount', 'other']})
    for name in ('mount', 'other'):
        np.testing.assert_array_equal(some['displacement'][name], whole['displacement'][name])
    assert np.isnan(some['displacement']['other']).sum() == 400


def test_a_message_that_is_none_is_named_as_among_all_messages(tmp_path):
    writer = BagWriter(tmp_path / 'bag')
    writer.add_topic('/displacement', JOINT_STATE)
    for index in range(COUNT):
        good = joint_state(START + index * PERIOD, ['mount'], np.array([1.0]), np.empty(0))
        writer.write('/displacement', good if index != 300 else good[:30], START + index * PERIOD)
    writer.close()
    recording = engine_mount.open(tmp_path / 'bag')
    recording.load_columns({'displacement': ['mount']})
    with pytest.raises(SeriesError, match='message 300 is no'):
        recording['displacement']['mount']


def test_a_damaged_chunk_is_told_as_when_all_messages_are_read(tmp_path):
    folder = write_drive(tmp_path / 'bag', COUNT, chunk_size=5000)
    content = bytearray((folder / 'bag_0.mcap').read_bytes())
    content[engine_mount.open(folder).files[0].chunks[2].begin + 50] ^= 1
    (folder / 'bag_0.mcap').write_bytes(content)
    some, whole = engine_mount.open(folder), engine_mount.open(folder)
    some.load_columns({'displacement': ['mount']})
    np.testing.assert_array_equal(some['displacement']['mount'], whole['displacement']['mount'])
    assert some.missing == whole.missing
    assert some.warnings == whole.warnings
    assert not some.whole


def test_a_topic_without_stamps_has_its_columns(tmp_path):
    writer = BagWriter(tmp_path / 'bag')
    writer.add_topic('/number', 'std_msgs/msg/Float64')
    for index in range(COUNT):
        writer.write('/number', b'\0\1\0\0' + np.float64(index).tobytes(), START + index * PERIOD)
    writer.close()
    recording = engine_mount.open(tmp_path / 'bag')
    recording.load_columns({'number': ['data']})
    np.testing.assert_array_equal(recording['number']['data'], np.arange(COUNT))
    with pytest.raises(SeriesError, match='no header with a stamp'):
        recording['number'].stamps  # noqa: B018


def test_an_empty_topic_has_empty_columns(tmp_path):
    writer = BagWriter(tmp_path / 'bag')
    writer.add_topic('/displacement', DISPLACEMENT.type)
    writer.add_topic('/sim/mount_force', SIM_MOUNT_FORCE.type)
    writer.close()
    recording = engine_mount.open(tmp_path / 'bag')
    recording.load_columns({'displacement': ['mount', 'nothing'], 'sim/mount_force': ['wrench.force.z']})
    assert len(recording['displacement']) == len(recording['displacement']['mount']) == 0
    assert len(recording['displacement'].stamps) == 0
    with pytest.raises(SeriesError, match='it has mount'):
        recording['displacement']['nothing']


def peak_of_reading(folder, read):
    recording = engine_mount.open(folder)
    tracemalloc.start()
    read(recording)
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    return peak


def test_memory_grows_by_the_columns_and_not_by_the_messages(tmp_path):
    names = [f'a long name of a number {place}' for place in range(40)]
    counts = 6000, 12000  # both have so many chunks that several are read together
    for count in counts:
        writer = BagWriter(tmp_path / f'bag_{count}')
        writer.add_topic('/displacement', JOINT_STATE)
        for index in range(count):
            raw = joint_state(START + index * PERIOD, names, np.full(40, float(index)), np.empty(0))
            writer.write('/displacement', raw, START + index * PERIOD)
        writer.close()
    assert len(raw) > 1500
    some = {'displacement': names[:1]}
    # At first what is compiled is loaded.
    folders = [tmp_path / f'bag_{count}' for count in (counts[0], *counts)]
    _, small, large = (peak_of_reading(folder, lambda each: each.load_columns(some)) for folder in folders)
    assert (large - small) / (counts[1] - counts[0]) < 250
