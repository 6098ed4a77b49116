"""What looks at a long recording needs little memory for each of its messages."""

import tracemalloc

import numpy as np
from recorded_drive import PERIOD, START, joint_state

import engine_mount
from engine_mount.recordings import mcap_file
from mount_recorder.bag_writer import BagWriter
from mount_ros.topics import COIL_TEMPERATURE, DISPLACEMENT, JOINT_STATE


def peak_of(folder, look):
    recording = engine_mount.open(folder)
    tracemalloc.start()
    look(recording)
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    return peak


def test_a_slow_topic_does_not_hold_the_messages_of_the_others(tmp_path, monkeypatch):
    monkeypatch.setattr(mcap_file, '_AT_ONCE', 50_000)
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
    engine_mount.open(tmp_path / 'bag').load(['coil_temperature'])  # loads modules
    assert peak_of(tmp_path / 'bag', lambda recording: recording['coil_temperature']) < size / 5
    assert peak_of(tmp_path / 'bag', lambda recording: recording.latched('coil_temperature')) < size / 5
    assert len(engine_mount.open(tmp_path / 'bag')[DISPLACEMENT.name]) == 3000
