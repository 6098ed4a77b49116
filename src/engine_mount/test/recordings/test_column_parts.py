"""Columns picked from unpacked chunks: the numbers of the general way, whatever stands in a chunk."""

import numpy as np
import pytest
from recorded_drive import PERIOD, START, joint_state, sample, write_drive

import engine_mount
from engine_mount.recordings.columns import column_parts
from mount_recorder.bag_writer import BagWriter
from mount_ros.topics import COIL_RIPPLE, DISPLACEMENT

COUNT = 900
WANTED = {'displacement': ('mount',), 'coil_ripple': ('flux_density', 'coil_current', 'nothing')}


@pytest.fixture
def other_messages(tmp_path):
    """A drive of which some messages have one more name than those before and behind."""
    writer = BagWriter(tmp_path / 'other', chunk_size=8192)
    for topic in (DISPLACEMENT, COIL_RIPPLE):
        writer.add_topic(f'/{topic.name}', topic.type)
    for index in range(COUNT):
        stamp = START + index * PERIOD
        for topic in (DISPLACEMENT, COIL_RIPPLE):
            raw = sample(topic, index)
            if topic is DISPLACEMENT and 400 <= index < 410:
                names = ['further', *topic.names]
                raw = joint_state(stamp, names, np.array([7.0, index]), np.empty(0))
            writer.write(f'/{topic.name}', raw, stamp + 200_000)
    writer.close()
    return tmp_path / 'other'


@pytest.fixture
def late_topic(tmp_path):
    """A drive whose displacement begins when the other topics have filled some chunks."""
    return write_drive(tmp_path / 'late', COUNT, skipped=range(300), chunk_size=8192)


@pytest.mark.parametrize('size', [1, 100, 8192])
@pytest.mark.parametrize('kind', ['late_topic', 'other_messages'])
def test_parts_put_together_are_all_messages(kind, size, request):
    folder = request.getfixturevalue(kind)
    assert len(engine_mount.open(folder).files[0].chunks) > 5
    whole, found = engine_mount.open(folder), {f'/{name}': [] for name in WANTED}
    for part in column_parts(engine_mount.open(folder), WANTED, size):
        found[part.topic].append(part)
    for topic, parts in found.items():
        series = whole[topic]
        np.testing.assert_array_equal(np.concatenate([part.stamps for part in parts]), series.stamps)
        received = np.concatenate([part.receive_times for part in parts])
        np.testing.assert_array_equal(received, series.receive_times)
        for name in series.registered.names:
            values = np.concatenate([part.column(name) for part in parts])
            np.testing.assert_array_equal(values, series[name])
        assert not any('nothing' in part.columns for part in parts)
