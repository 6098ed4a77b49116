"""Bags in sqlite3 and compressed ones: read from a copy that `rosbags` makes."""

import os
import shutil
import sqlite3

import numpy as np
import pytest
from rosbags.rosbag2 import CompressionFormat, CompressionMode, StoragePlugin, Writer
from rosbags.typesys import Stores, get_typestore
from samples import PERIOD, START, by_rosbags, sample

import engine_mount
from engine_mount.recordings import ReadingError
from engine_mount.recordings.audit import audit
from engine_mount.recordings.edit import cut, recover
from mount_ros.topics import DISPLACEMENT

COUNT = 101
FORMS = [
    (StoragePlugin.SQLITE3, CompressionMode.NONE),
    (StoragePlugin.SQLITE3, CompressionMode.FILE),
    (StoragePlugin.SQLITE3, CompressionMode.MESSAGE),
    (StoragePlugin.MCAP, CompressionMode.FILE),
    (StoragePlugin.MCAP, CompressionMode.MESSAGE),
]


def written(folder, count, storage=StoragePlugin.SQLITE3, compression=CompressionMode.NONE):
    """Write a bag of one topic as `rosbags` does, with stamps and numbers that tell their index."""
    writer = Writer(folder, version=9, storage_plugin=storage)
    writer.set_compression(compression, CompressionFormat.ZSTD)
    with writer:
        store = get_typestore(Stores.ROS2_JAZZY)
        topic = writer.add_connection('/displacement', DISPLACEMENT.type, typestore=store)
        for index in range(count):
            writer.write(topic, START + index * PERIOD, sample(DISPLACEMENT, index))
    return folder


@pytest.mark.parametrize(('storage', 'compression'), FORMS)
def test_other_bags_are_read_as_ours_and_copies_are_plain(tmp_path, monkeypatch, storage, compression):
    folder = written(tmp_path / 'bag', COUNT, storage, compression)
    monkeypatch.setattr('tempfile.tempdir', str(tmp_path))
    present = set(os.listdir(tmp_path))
    recording = engine_mount.open(folder)
    assert set(os.listdir(tmp_path)) == present
    assert recording.whole
    assert all('no checksum' in warning for warning in recording.warnings)
    series = recording['displacement']
    np.testing.assert_array_equal(series['mount'], np.arange(COUNT))
    assert series.payloads[COUNT - 1] == sample(DISPLACEMENT, COUNT - 1)
    entry = audit(recording)['/displacement']
    assert (entry.expected, entry.lost) == (COUNT, 0)
    cut(recording, tmp_path / 'cut')
    assert recover(folder, tmp_path / 'recovered').complete
    expected = [('/displacement', START + i * PERIOD, sample(DISPLACEMENT, i)) for i in range(COUNT)]
    for out in ('bag', 'cut', 'recovered'):
        assert by_rosbags(tmp_path / out) == expected


def test_a_database_is_read_without_its_description(tmp_path):
    folder = written(tmp_path / 'bag', COUNT)
    (folder / 'metadata.yaml').unlink()
    for path in (folder, folder / 'bag.db3'):
        assert len(engine_mount.open(path)['displacement']) == COUNT


def test_a_database_that_its_writer_did_not_close_is_refused_with_the_way_out(tmp_path):
    whole = written(tmp_path / 'whole', 1)
    base = sqlite3.connect(whole / 'whole.db3')
    base.execute('PRAGMA journal_mode=WAL')
    base.execute('PRAGMA wal_autocheckpoint=0')
    rows = [(START + index * PERIOD, sample(DISPLACEMENT, index)) for index in range(1, COUNT)]
    base.executemany('INSERT INTO messages (topic_id, timestamp, data) VALUES (1, ?, ?)', rows)
    base.commit()
    killed = tmp_path / 'killed'
    killed.mkdir()
    for file in ('whole.db3', 'whole.db3-wal', 'metadata.yaml'):
        shutil.copyfile(whole / file, killed / file)
    base.close()
    for path in (killed, killed / 'whole.db3'):
        with pytest.raises(ReadingError, match=r"in whole.db3-wal: .* sqlite3 whole.db3 'PRAGMA journal"):
            engine_mount.open(path)
    with sqlite3.connect(killed / 'whole.db3') as base:
        base.execute('PRAGMA journal_mode=DELETE')
    np.testing.assert_array_equal(engine_mount.open(killed)['displacement']['mount'], np.arange(COUNT))


def test_a_file_that_is_packed_as_a_whole_is_refused_with_the_way_out(tmp_path):
    (tmp_path / 'bag.mcap.zstd').write_bytes(b'')
    with pytest.raises(ReadingError, match='unpack it by zstd -d'):
        engine_mount.open(tmp_path / 'bag.mcap.zstd')
