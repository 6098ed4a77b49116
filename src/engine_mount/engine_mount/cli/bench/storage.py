"""Loading of a recording beside `rosbags`, in the same run: from the file to arrays of stamps and numbers."""

from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
from rosbags.rosbag2 import Reader
from rosbags.typesys import Stores, get_typestore

import engine_mount
from engine_mount.cli.bench.bench import BenchOrder, Comparison, Figures, Report, median_times
from mount_models.sampling import SAMPLE_TIME_NS
from mount_recorder.bag_writer import BagWriter
from mount_ros.messages.scalars import ScalarsLayout
from mount_ros.topics import DISPLACEMENT

_SAMPLES = 600_000
_ROUNDS = 3
_STAMPS = 1_700_000_000_000_000_000 + SAMPLE_TIME_NS * np.arange(_SAMPLES)
_NUMBERS = np.arange(float(_SAMPLES))


def measure(order: BenchOrder, report: Report) -> Figures:
    """Return what it costs to load a message of ten minutes at 1 kHz."""
    store = get_typestore(Stores.ROS2_JAZZY)
    with TemporaryDirectory() as folder:
        recording = Path(folder) / 'recording'
        writer = BagWriter(recording)
        writer.add_topic(f'/{DISPLACEMENT.name}', DISPLACEMENT.type)
        rows = ScalarsLayout(DISPLACEMENT).pack_rows(_STAMPS, _NUMBERS[:, None])
        writer.write_columns([f'/{DISPLACEMENT.name}'], [rows], _STAMPS)
        writer.close()

        def ours() -> None:
            series = engine_mount.open(recording)[DISPLACEMENT.name]
            _require(series.stamps, series['mount'])

        def other() -> None:
            stamps, numbers = [], []
            with Reader(recording) as reader:
                for connection, _, raw in reader.messages():
                    message = store.deserialize_cdr(raw, connection.msgtype)
                    stamp = message.header.stamp  # type: ignore[attr-defined]
                    stamps.append(stamp.sec * 1_000_000_000 + stamp.nanosec)
                    numbers.append(message.position[0])  # type: ignore[attr-defined]
            _require(np.array(stamps), np.array(numbers))

        times = median_times({'ours': ours, 'rosbags': other}, _ROUNDS)
    first, second = (time / _SAMPLES for time in times.values())
    return {'load': Comparison('load displacement of 10 min', first, 'rosbags', second)}


def _require(stamps: np.ndarray, numbers: np.ndarray) -> None:
    """Raise `ValueError` unless all was read: a figure of something else would mislead."""
    if not (np.array_equal(stamps, _STAMPS) and np.array_equal(numbers, _NUMBERS)):
        raise ValueError(f'{len(stamps)} of {_SAMPLES} samples were read, or read wrongly')
