"""Storage of recordings: writing beside `mcap`, loading beside `rosbags`, in the same run."""

from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
from mcap.writer import Writer

import engine_mount
from engine_mount.cli.bench.bench import BenchOrder, Comparison, Figures, Report, median_times
from mount_models.sampling import SAMPLE_TIME
from mount_recorder.bag_writer import BagWriter
from mount_recorder.mcap_writer import CHUNK_SIZE
from mount_ros.messages.scalars import ScalarsLayout
from mount_ros.topics import DISPLACEMENT

MINUTES = 10
_SAMPLES = round(60 * MINUTES / SAMPLE_TIME)
_WRITTEN = 200_000  # messages in one round of writing
_ROUNDS = 3
_BEGIN = 1_700_000_000_000_000_000  # ns, any time
_TOPIC = f'/{DISPLACEMENT.name}'


def measure(order: BenchOrder, report: Report) -> Figures:
    """Return what a message costs to write, and to load: from the file to arrays of stamps and numbers."""
    with TemporaryDirectory() as folder:
        return {'write': _writing(Path(folder)), 'load': _loading(Path(folder))}


def _writing(folder: Path) -> Comparison:
    raws = _messages(_WRITTEN)
    places = iter(range(2 * _ROUNDS))

    def other() -> None:
        with (folder / f'other_{next(places)}.mcap').open('wb') as stream:
            writer = Writer(stream, chunk_size=CHUNK_SIZE)
            writer.start('ros2')
            schema = writer.register_schema(DISPLACEMENT.type, 'ros2msg', b'')
            channel = writer.register_channel(_TOPIC, 'cdr', schema)
            for index, raw in enumerate(raws):
                writer.add_message(channel, _BEGIN + index, raw, _BEGIN + index)
            writer.finish()

    ours, theirs = median_times(lambda: _write(folder / f'ours_{next(places)}', raws), other, _ROUNDS)
    return Comparison('write a message to a bag', ours / _WRITTEN, 'mcap.writer', theirs / _WRITTEN)


def _loading(folder: Path) -> Comparison:
    from rosbags.rosbag2 import Reader
    from rosbags.typesys import Stores, get_typestore

    recording, store = folder / 'minutes', get_typestore(Stores.ROS2_JAZZY)
    _write(recording, _messages(_SAMPLES))

    def ours() -> None:
        series = engine_mount.open(recording)[DISPLACEMENT.name]
        _require(series.stamps, series['mount'])

    def other() -> None:
        stamps, numbers = [], []
        with Reader(recording) as reader:
            for connection, _, raw in reader.messages():
                message = store.deserialize_cdr(raw, connection.msgtype)
                stamps.append(message.header.stamp.sec * 1_000_000_000 + message.header.stamp.nanosec)  # type: ignore[attr-defined]
                numbers.append(message.position[0])  # type: ignore[attr-defined]
        _require(np.array(stamps), np.array(numbers))

    first, second = median_times(ours, other, _ROUNDS)
    what = f'load displacement of {MINUTES} min'
    return Comparison(what, first / _SAMPLES, 'rosbags', second / _SAMPLES)


def _require(stamps: np.ndarray, numbers: np.ndarray) -> None:
    """Raise `ValueError` unless the last sample was read: a figure of something else would mislead."""
    if len(stamps) != _SAMPLES or stamps[-1] != _stamp(_SAMPLES - 1) or numbers[-1] != _SAMPLES - 1:
        raise ValueError(f'{len(stamps)} of {_SAMPLES} samples were read, or read wrongly')


def _messages(count: int) -> list[bytes]:
    layout = ScalarsLayout(DISPLACEMENT)
    return [layout.pack(_stamp(index), (float(index),)) for index in range(count)]


def _stamp(index: int) -> int:
    return _BEGIN + index * round(SAMPLE_TIME * 1e9)


def _write(folder: Path, raws: list[bytes]) -> None:
    writer = BagWriter(folder)
    writer.add_topic(_TOPIC, DISPLACEMENT.type)
    for index, raw in enumerate(raws):
        writer.write(_TOPIC, raw, _stamp(index))
    writer.close()
