"""What the recorder wrote, closed or killed, as the reader finds it."""

import shutil

import numpy as np
import pytest
import yaml
from hypothesis import given, settings
from hypothesis import strategies as st
from recorded_drive import PERIOD, START, sample

import engine_mount
from engine_mount.recordings import ReadingError
from engine_mount.recordings.events import switching_times
from engine_mount.recordings.metadata import read_metadata, read_statement, readable_qos
from mount_recorder.bag_writer import BagWriter, SplitRule
from mount_recorder.metadata import OfferedQos, qos_text
from mount_ros.topics import DISPLACEMENT

STRING = 'std_msgs/msg/String'
NAMES = ('/stream', '/session')  # of no car and of one: in two chunks
COUNT = 350


def string(text):
    data = text.encode() + b'\0'
    return b'\0\1\0\0' + len(data).to_bytes(4, 'little') + data


@pytest.fixture
def split_bag(tmp_path):
    """Return a recording of four files: displacements and, at samples 5 and 120, a latched session."""
    writer = BagWriter(tmp_path / 'bag', split=SplitRule(duration=100 * PERIOD), chunk_size=4096)
    writer.add_topic('/displacement', DISPLACEMENT.type)
    writer.add_topic('/session', STRING, latched=True)
    for index in range(COUNT):
        time = START + index * PERIOD
        if index in (5, 120):
            writer.write('/session', string(f'at {index}'), time, time - 7)
        writer.write('/displacement', sample(DISPLACEMENT, index), time)
    writer.close()
    return tmp_path / 'bag'


def test_whole_recording_counts_each_message_once(split_bag):
    recording = engine_mount.open(split_bag)
    assert recording.warnings == []
    assert len(recording['displacement']) == COUNT
    assert [message.data for message in recording['session'].messages()] == ['at 5', 'at 120']
    assert recording.message_count == COUNT + 2


def test_each_file_alone_is_a_recording(split_bag):
    for number, count in enumerate([100, 100, 100, 50]):
        recording = engine_mount.open(split_bag / f'bag_{number}.mcap')
        assert recording.warnings == []
        assert len(recording['displacement']) == count
        assert recording.latched('session').data == ('at 5' if number == 0 else 'at 120')


def test_metadata_file_is_read(split_bag):
    bag = read_metadata((split_bag / 'metadata.yaml').read_text())
    assert bag.files == tuple(f'bag_{number}.mcap' for number in range(4))
    assert bag.message_count == COUNT + 5


steps = st.lists(
    st.one_of(
        st.just('flush'), st.tuples(st.sampled_from(NAMES), st.binary(max_size=30), st.integers(0, 40))
    ),
    max_size=40,
)


@settings(deadline=None, derandomize=True, max_examples=100)
@given(steps, st.sampled_from([0, 5, 20]), st.integers(1, 300), st.floats(0.0, 1.0))
def test_whatever_was_flushed_survives_a_cut_at_any_later_byte(
    tmp_path_factory, steps, duration, chunk_size, share
):
    folder = tmp_path_factory.mktemp('bags') / 'bag'
    writer = BagWriter(folder, split=SplitRule(duration=duration), chunk_size=chunk_size)
    for name in NAMES:
        writer.add_topic(name, STRING, latched=name == '/session')
    written, safe, safe_sizes = [], 0, {}
    for step in steps:
        if step != 'flush':
            writer.write(*step)
            written.append(step)
            continue
        writer.flush()
        safe, safe_sizes = len(written), {path.name: path.stat().st_size for path in folder.glob('*.mcap')}
    killed = shutil.copytree(folder, folder.parent / 'killed', ignore=shutil.ignore_patterns('.*'))
    writer.close()
    last = max(killed.glob('*.mcap'), key=lambda path: int(path.stem.rpartition('_')[2]))
    safe_size, size = safe_sizes.get(last.name, 0), last.stat().st_size
    with last.open('r+b') as file:
        file.truncate(safe_size + round(share * (size - safe_size)))
    try:
        recording = engine_mount.open(killed)
    except ReadingError:
        assert safe == 0
        return
    for name in NAMES:
        expected = [(raw, time) for topic, raw, time in map(tuple, written) if topic == name]
        series = recording[name] if name in recording.topics else None
        found = zip(series.payloads, series.receive_times.tolist(), strict=True) if series else ()
        kept = [(bytes(raw), time) for raw, time in found]
        assert kept == expected[: len(kept)]
        assert len(kept) >= sum(topic == name for topic, *_ in written[:safe])


@pytest.mark.parametrize('text', ['', 'topics: [', '{topics: 3}'])
def test_statement_that_is_not_understood_is_empty(text):
    assert read_statement({'topics': text}) == {}
    assert read_statement({}) == {}


def test_switched_stretches_of_an_opening_that_flutters():
    time = np.arange(400)
    active = np.where(time % 30 < 15, 0.03, 0.0) * ((time > 100) & (time < 300))
    on, off = switching_times(1e-3 * time, active)
    assert (on.tolist(), off.tolist()) == ([0.101], [pytest.approx(0.285)])
    on, off = switching_times(1e-3 * time, (time % 200 < 100).astype(float))
    assert (on.tolist(), off.tolist()) == ([0.0, 0.2], [0.1, 0.3])
    assert [len(each) for each in switching_times(time[:0], active[:0])] == [0, 0]


@settings(deadline=None, derandomize=True)
@given(st.sampled_from(['keep_last', 'keep_all', 'unknown']), st.integers(0, 1000), st.integers(0, 2**63 - 1))
def test_offered_qos_survives_its_text(history, depth, deadline):
    offers = (OfferedQos(history=history, depth=depth, deadline=deadline), OfferedQos())
    assert readable_qos(qos_text(offers)) == offers


def test_qos_of_old_bags_stands_in_numbers():
    time = {'sec': 0, 'nsec': 5}
    numbers = {
        'history': 3,
        'depth': 0,
        'reliability': 2,
        'durability': 1,
        'deadline': time,
        'lifespan': time,
        'liveliness': 1,
        'liveliness_lease_duration': time,
        'avoid_ros_namespace_conventions': False,
    }
    offer = OfferedQos('unknown', 0, 'best_effort', 'transient_local', 5, 5, 'automatic', 5, False)
    assert readable_qos(yaml.safe_dump([numbers])) == (offer,)
    assert readable_qos([{**numbers, 'history': 9}])[0].history == 'unknown'
    assert readable_qos([{'history': 9}]) == ()
