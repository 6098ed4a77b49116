"""What a recording is worth when its recorder was not allowed to finish it."""

import random
import signal
import subprocess
import sys
from pathlib import Path

import pytest
from fed_recorder import TOPICS
from hypothesis import given, settings
from hypothesis import strategies as st
from read_back import pieces_of, read_back, text_in
from ros_testing import wait_until

from mount_recorder.bag_writer import BagWriter

STRING = 'std_msgs/msg/String'
KILLS = 5
LARGEST_LOSS = 200  # samples at 1 kHz
NAMES = ('/stream', '/session')


@pytest.mark.parametrize('seed', range(KILLS))
def test_killed_recorder_loses_less_than_a_fifth_of_a_second(tmp_path, seed):
    wanted = random.Random(seed).randrange(50, 900)
    progress = tmp_path / 'progress'
    progress.write_bytes(bytes(8))
    program = Path(__file__).with_name('fed_recorder.py')
    process = subprocess.Popen([sys.executable, str(program), str(tmp_path / 'bag'), str(progress)])
    try:
        wait_until(
            lambda: process.poll() is not None or samples_told(progress) >= wanted, f'the sample {wanted}'
        )
        assert process.poll() is None, 'the recorder ended by itself'
    finally:
        process.send_signal(signal.SIGKILL)
        process.wait()
    taken = samples_told(progress)
    kept = read_back(tmp_path / 'bag')
    for topic in TOPICS:
        indices = [sample_index(entry.raw) for entry in kept if entry.topic == topic]
        assert indices == list(range(len(indices)))
        assert taken - len(indices) <= LARGEST_LOSS
    assert [text_in(entry.raw) for entry in kept if entry.topic == '/session'] == ['s']


def samples_told(progress):
    return int.from_bytes(progress.read_bytes(), 'little')


def sample_index(raw):
    return int.from_bytes(raw[4:12], 'little')


steps = st.lists(
    st.one_of(
        st.just('flush'), st.tuples(st.sampled_from(NAMES), st.binary(max_size=30), st.integers(0, 40))
    ),
    max_size=40,
)


@settings(deadline=None, derandomize=True, max_examples=100)
@given(steps, st.sampled_from([0, 1]), st.integers(1, 300), st.floats(0.0, 1.0))
def test_whatever_was_flushed_survives_a_cut_at_any_later_byte(
    tmp_path_factory, steps, split_size, chunk_size, share
):
    folder = tmp_path_factory.mktemp('bags') / 'bag'
    writer = BagWriter(folder, split_size=split_size, chunk_size=chunk_size)
    for name in NAMES:
        writer.add_topic(name, STRING)
    written, safe, safe_sizes = [], 0, {}
    for step in steps:
        if step != 'flush':
            writer.write(*step)
            written.append(step)
            continue
        writer.flush()
        safe, safe_sizes = len(written), {path: path.stat().st_size for path in pieces_of(folder)}
    kill(writer)
    cut(folder, safe_sizes, share)
    expected = {name: [tuple(rest) for topic, *rest in written if topic == name] for name in NAMES}
    kept = read_back(folder)
    for name in NAMES:
        found = [(entry.raw, entry.log_time) for entry in kept if entry.topic == name]
        assert found == expected[name][: len(found)]
        assert len(found) >= sum(topic == name for topic, *_ in written[:safe])


def kill(writer):
    """Leave the files of a writer as SIGKILL would."""
    writer._file.file.release_room()
    writer._file.file.close()


def cut(folder, safe_sizes, share):
    """Cut the last file anywhere behind what was safe."""
    last = pieces_of(folder)[-1]
    safe, size = safe_sizes.get(last, 0), last.stat().st_size
    with last.open('r+b') as file:
        file.truncate(safe + round(share * (size - safe)))
