"""Columns read block by block: the numbers of all messages at once, in a memory of their own size."""

import tracemalloc

import numpy as np
import pytest
from compared_drives import bag_of
from samples import PERIOD, START, joint_state

import engine_mount
from engine_mount.recordings import SeriesError
from engine_mount.recordings.mcap_file import McapFile
from mount_ros.topics import JOINT_STATE

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


@pytest.fixture
def changing(tmp_path):
    """Return a recording in which the last messages have one name more."""
    raws = []
    for index in range(COUNT):
        names = ['mount'] if index < 400 else ['other', 'mount']
        numbers = np.arange(float(len(names))) + index
        raws.append(joint_state(START + index * PERIOD, names, numbers, np.empty(0)))
    bag_of(tmp_path / 'bag', '/displacement', JOINT_STATE, raws)
    return tmp_path / 'bag'


def test_a_column_that_not_every_message_has_is_that_of_all_messages(changing):
    some, whole = engine_mount.open(changing), engine_mount.open(changing)
    some.load_columns({'displacement': ['mount', 'other']})
    for name in ('mount', 'other'):
        np.testing.assert_array_equal(some['displacement'][name], whole['displacement'][name])
    assert np.isnan(some['displacement']['other']).sum() == 400


def test_a_topic_without_stamps_has_its_columns(tmp_path):
    raws = [b'\0\1\0\0' + np.float64(index).tobytes() for index in range(COUNT)]
    recording = bag_of(tmp_path / 'bag', '/number', 'std_msgs/msg/Float64', raws)
    recording.load_columns({'number': ['data']})
    np.testing.assert_array_equal(recording['number']['data'], np.arange(COUNT))
    with pytest.raises(SeriesError, match='no header with a stamp'):
        recording['number'].stamps  # noqa: B018


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
        raws = [
            joint_state(START + index * PERIOD, names, np.full(40, float(index)), np.empty(0))
            for index in range(count)
        ]
        bag_of(tmp_path / f'bag_{count}', '/displacement', JOINT_STATE, raws)
    assert len(raws[0]) > 1500
    some = {'displacement': names[:1]}
    # At first what is compiled is loaded.
    folders = [tmp_path / f'bag_{count}' for count in (counts[0], *counts)]
    _, small, large = (peak_of_reading(folder, lambda each: each.load_columns(some)) for folder in folders)
    assert (large - small) / (counts[1] - counts[0]) < 250
