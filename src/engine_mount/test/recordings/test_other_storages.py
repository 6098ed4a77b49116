"""Bags of others: in sqlite3, not closed by their writer, with every message compressed by itself."""

import gc
import os
import shutil
import sqlite3

import numpy as np
import pytest
from mcap.records import Statistics
from recorded_drive import PERIOD, START, joint_state, sample, write_drive
from rosbags.rosbag2 import CompressionFormat, CompressionMode, Reader, StoragePlugin, Writer
from rosbags.typesys import Stores, get_typestore

import engine_mount
from engine_mount.recordings.audit import audit
from engine_mount.recordings.cut import cut
from engine_mount.recordings.merge import merge
from engine_mount.recordings.recover import recover
from engine_mount.recordings.series import SeriesError
from mount_recorder import mcap_writer
from mount_ros.topics import DISPLACEMENT

COUNT = 101
STORAGES = (StoragePlugin.SQLITE3, StoragePlugin.MCAP)


def written(folder, count, storage=StoragePlugin.SQLITE3, compression=CompressionMode.NONE):
    """Write a bag of one topic as `rosbags` does, with stamps and numbers that tell their index."""
    with_definitions = get_typestore(Stores.ROS2_JAZZY)
    writer = Writer(folder, version=9, storage_plugin=storage)
    writer.set_compression(compression, CompressionFormat.ZSTD)
    with writer:
        topic = writer.add_connection('/displacement', DISPLACEMENT.type, typestore=with_definitions)
        for index in range(count):
            writer.write(topic, START + index * PERIOD, sample(DISPLACEMENT, index))
    return folder


def as_by_rosbags(folder):
    with Reader(folder) as reader:
        return [(connection.topic, time, bytes(raw)) for connection, time, raw in reader.messages()]


# A database with its log.


@pytest.fixture
def unclosed(tmp_path):
    """Return a bag of 101 messages whose writer was killed with 100 of them in the write-ahead log."""
    whole = written(tmp_path / 'whole', 1)
    base = sqlite3.connect(whole / 'whole.db3')
    base.execute('PRAGMA journal_mode=WAL')
    base.execute('PRAGMA wal_autocheckpoint=0')
    rows = [(START + index * PERIOD, sample(DISPLACEMENT, index)) for index in range(1, COUNT)]
    base.executemany('INSERT INTO messages (topic_id, timestamp, data) VALUES (1, ?, ?)', rows)
    base.commit()
    folder = tmp_path / 'unclosed'
    folder.mkdir()
    for file in ('whole.db3', 'whole.db3-wal'):
        shutil.copyfile(whole / file, folder / file)
    base.close()
    return folder


def test_messages_in_the_log_of_a_database_are_read(unclosed):
    recording = engine_mount.open(unclosed)
    series = recording['displacement']
    np.testing.assert_array_equal(series['mount'], np.arange(COUNT))
    assert recording.time_range == (START, START + (COUNT - 1) * PERIOD)
    assert not recording.whole  # nobody says that the log held everything
    assert any('not closed by its writer' in warning for warning in recording.warnings)


def test_source_with_a_log_is_not_touched_and_may_be_read_only(unclosed):
    before = {file.name: file.read_bytes() for file in unclosed.iterdir()}
    for file in unclosed.iterdir():
        file.chmod(0o444)
    unclosed.chmod(0o555)
    try:
        assert engine_mount.open(unclosed).message_count == COUNT
        assert {file.name: file.read_bytes() for file in unclosed.iterdir()} == before
    finally:
        unclosed.chmod(0o755)


def test_copy_of_a_database_goes_with_its_recording(unclosed, tmp_path, monkeypatch):
    monkeypatch.setattr('tempfile.tempdir', str(tmp_path))
    present = set(os.listdir(tmp_path))
    recording = engine_mount.open(unclosed)
    assert len(set(os.listdir(tmp_path)) - present) == 1
    del recording
    gc.collect()
    assert set(os.listdir(tmp_path)) == present


def test_transaction_that_was_cut_off_is_rolled_back(tmp_path):
    """The journal of a writer that was killed takes back what stands half in the database."""
    folder = written(tmp_path / 'bag', 1)
    (folder / 'metadata.yaml').unlink()
    base = sqlite3.connect(folder / 'bag.db3', isolation_level=None)
    base.execute('PRAGMA journal_mode=DELETE')
    base.execute('PRAGMA cache_spill=1')
    base.execute('PRAGMA cache_size=1')
    base.execute('BEGIN')
    for index in range(1, 2000):  # more than the cache: pages go to the file before the commit
        row = (START + index * PERIOD, sample(DISPLACEMENT, index))
        base.execute('INSERT INTO messages (topic_id, timestamp, data) VALUES (1, ?, ?)', row)
    killed = tmp_path / 'killed'
    shutil.copytree(folder, killed)
    base.execute('ROLLBACK')
    base.close()
    recording = engine_mount.open(killed)
    assert recording['displacement']['mount'].tolist() == [0.0]
    assert not recording.whole


# Messages that are compressed one by one.


@pytest.mark.parametrize('storage', STORAGES)
def test_messages_compressed_one_by_one_are_read_with_their_stamps(tmp_path, storage):
    folder = written(tmp_path / 'bag', COUNT, storage, CompressionMode.MESSAGE)
    recording = engine_mount.open(folder)
    series = recording['displacement']
    np.testing.assert_array_equal(series['mount'], np.arange(COUNT))
    assert series.payloads[COUNT - 1] == sample(DISPLACEMENT, COUNT - 1)
    entry = audit(recording)['/displacement']
    assert (entry.expected, entry.lost) == (COUNT, 0)


def _recovered(folder, out):
    assert recover(folder, out).complete


def _cut(folder, out):
    cut(engine_mount.open(folder), out)


def _merged(folder, out):
    merge([engine_mount.open(folder)], out)


@pytest.mark.parametrize('storage', STORAGES)
@pytest.mark.parametrize('copy', [_recovered, _cut, _merged])
def test_copies_of_compressed_messages_are_plain_and_say_so(tmp_path, storage, copy):
    folder = written(tmp_path / 'bag', COUNT, storage, CompressionMode.MESSAGE)
    copy(folder, tmp_path / 'out')
    information = engine_mount.open(tmp_path / 'out').information
    assert (information.compression_mode, information.compression_format) == ('', '')
    expected = [('/displacement', START + i * PERIOD, sample(DISPLACEMENT, i)) for i in range(COUNT)]
    assert as_by_rosbags(tmp_path / 'out') == expected == as_by_rosbags(folder)


# A file that is wrong about its own times.


def test_times_are_those_of_the_chunks_where_the_statistics_tell_of_others(tmp_path, monkeypatch):
    honest = engine_mount.open(write_drive(tmp_path / 'honest', 50))
    false = {'message_start_time': START - 3600 * 10**9}
    monkeypatch.setattr(mcap_writer, 'Statistics', lambda **true: Statistics(**{**true, **false}))
    lying = engine_mount.open(write_drive(tmp_path / 'lying', 50))
    assert honest.warnings == []
    assert lying.proven
    assert lying.time_range == honest.time_range
    assert any('statistics state other times' in warning for warning in lying.warnings)
    assert lying['displacement'].time[0] == honest['displacement'].time[0]


@pytest.mark.parametrize(('field', 'type_'), [('position', 'float64[]'), ('name', 'string[]')])
def test_a_stored_definition_without_a_field_is_refused_in_a_sentence(tmp_path, field, type_):
    folder = written(tmp_path / 'bag', 2)
    with sqlite3.connect(folder / 'bag.db3') as base:
        base.execute(
            'UPDATE message_definitions SET encoded_message_definition = '
            'replace(encoded_message_definition, ?, ?)',
            (f'{type_} {field}', f'{type_} elsewhere'),
        )
        of_two = joint_state(START, ['mount', 'other'], np.array([1.0, 2.0]), np.empty(0))
        base.execute('INSERT INTO messages (topic_id, timestamp, data) VALUES (1, ?, ?)', (START, of_two))
    series = engine_mount.open(folder)['displacement']
    with pytest.raises(SeriesError, match=f"its definition of sensor_msgs/msg/JointState has no .*'{field}'"):
        _ = series['mount']
