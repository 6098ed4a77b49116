"""What looks at a long recording needs little memory for each of its messages."""

import tracemalloc

import numpy as np
import pytest
from recorded_drive import PERIOD, START, joint_state, write_drive
from seen_memory import SEEN

import engine_mount
from engine_mount.recordings.audit.audit import audit
from engine_mount.recordings.audit.losses import losses
from engine_mount.recordings.bag import file_blocks
from engine_mount.recordings.events.recorded_events import recorded_events
from engine_mount.recordings.messages import packed_column, stamps
from mount_recorder.bag_writer import BagWriter
from mount_ros.topics import COIL_TEMPERATURE, DISPLACEMENT, JOINT_STATE

TOPICS = 3


def peak_of(folder, look):
    recording = engine_mount.open(folder)
    tracemalloc.start()
    look(recording)
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    return peak


def all_figures(recording):
    audits = audit(recording)
    losses(recording, audits)
    recorded_events(recording)


@pytest.mark.slow
def test_an_audit_needs_few_bytes_for_each_message(tmp_path, monkeypatch):
    monkeypatch.setattr(packed_column, 'BLOCK', 512)
    monkeypatch.setattr(packed_column, '_SLAB', 512)
    monkeypatch.setattr(packed_column, 'mmap', SEEN)
    monkeypatch.setattr(stamps, '_AT_ONCE', 512)
    monkeypatch.setattr(file_blocks, '_AT_ONCE', 50_000)
    monkeypatch.setattr(file_blocks, '_FEW', 0)
    short, long = 4_000, 16_000
    folders = [
        write_drive(tmp_path / f'bag_{count}', count, chunk_size=50_000) for count in (short, short + 1, long)
    ]
    _, *peaks = (peak_of(folder, all_figures) for folder in folders)  # the first time modules are loaded too
    # Even stamps take next to nothing, what their blocks are and the chunks some bytes.
    assert (peaks[1] - peaks[0]) / (TOPICS * (long - short)) < 2.5


def test_a_slow_topic_does_not_hold_the_messages_of_the_others(tmp_path, monkeypatch):
    monkeypatch.setattr(file_blocks, '_AT_ONCE', 50_000)
    names = [f'a long name of a number {place}' for place in range(40)]
    writer = BagWriter(tmp_path / 'bag', chunk_size=50_000)
    writer.add_topic('/displacement', JOINT_STATE)
    writer.add_topic('/coil_temperature', COIL_TEMPERATURE.type)
    size = 0
    for index in range(3000):
        stamp = START + index * PERIOD
        raw = joint_state(stamp, names, np.full(40, float(index)), np.empty(0))
        writer.write('/displacement', raw, stamp)
        size += len(raw)
        if index % 20 == 0:
            writer.write('/coil_temperature', b'\0\1\0\0' + bytes(40), stamp)
    writer.close()
    engine_mount.open(tmp_path / 'bag').load(['coil_temperature'])  # loads what is compiled
    assert peak_of(tmp_path / 'bag', lambda recording: recording['coil_temperature']) < size / 5
    assert peak_of(tmp_path / 'bag', lambda recording: recording.latched('coil_temperature')) < size / 5
    assert len(engine_mount.open(tmp_path / 'bag')[DISPLACEMENT.name]) == 3000


def test_chunks_that_a_summary_tells_of_are_kept_packed(tmp_path):
    folder = write_drive(tmp_path / 'bag', 3000, chunk_size=1_000)
    chunks = len(engine_mount.open(folder).files[0].chunks)
    tracemalloc.start()
    recording = engine_mount.open(folder)
    kept = tracemalloc.get_traced_memory()[0]
    tracemalloc.stop()
    assert chunks > 500
    assert recording.whole
    assert kept / chunks < 250.0
