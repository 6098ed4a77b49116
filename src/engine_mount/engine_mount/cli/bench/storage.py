"""Figures of the storage of recordings: writing and loading, each beside its alternative in the same run."""

import tempfile
from pathlib import Path

import numpy as np
from mcap.writer import Writer

import engine_mount
from engine_mount.cli.bench.comparison import Comparison, in_turn
from mount_models.sampling import SAMPLE_TIME
from mount_recorder.bag_writer import BagWriter
from mount_recorder.mcap_writer import CHUNK_SIZE
from mount_ros.messages.scalars import ScalarsLayout
from mount_ros.topics import DISPLACEMENT

MINUTES = 10
_SAMPLES = round(60 * MINUTES / SAMPLE_TIME)
_WRITTEN = 200_000  # messages in one round of writing
ROUNDS = 3
_STAMP = 1_700_000_000_000_000_000  # ns, any time
_TOPIC = f'/{DISPLACEMENT.name}'


def storage_figures(
    samples: int = _SAMPLES, written: int = _WRITTEN, rounds: int = ROUNDS
) -> list[Comparison]:
    """Measure and return the figures: medians of `rounds`, ours and the other in turn.

    Loading is that of `displacement` from a recording of `samples` (10 minutes at 1 kHz), from opening the
    recording to an array of stamps and one of numbers. The other is left out where `rosbags` is missing.
    """
    with tempfile.TemporaryDirectory() as folder:
        figures = [_writing(Path(folder), written, rounds)]
        loading = _loading(Path(folder), samples, rounds)
        return figures + ([loading] if loading else [])


def _writing(folder: Path, count: int, rounds: int) -> Comparison:
    raws = _messages(count)
    places = iter(range(2 * rounds))

    def ours() -> None:
        _write(folder / f'ours_{next(places)}', raws)

    def other() -> None:
        with (folder / f'other_{next(places)}.mcap').open('wb') as stream:
            writer = Writer(stream, chunk_size=CHUNK_SIZE)
            writer.start('ros2')
            channel = writer.register_channel(
                _TOPIC, 'cdr', writer.register_schema(DISPLACEMENT.type, 'ros2msg', b'')
            )
            for index, raw in enumerate(raws):
                writer.add_message(channel, _STAMP + index, raw, _STAMP + index)
            writer.finish()

    first, second = in_turn(ours, other, rounds)
    return Comparison('write a message to a bag', first / count, 'mcap.writer', second / count)


def _loading(folder: Path, samples: int, rounds: int) -> Comparison | None:
    try:
        from rosbags.rosbag2 import Reader
        from rosbags.typesys import Stores, get_typestore
    except ImportError:
        return None
    recording = folder / 'minutes'
    _write(recording, _messages(samples))
    store = get_typestore(Stores.ROS2_JAZZY)

    def ours() -> None:
        series = engine_mount.open(recording)[DISPLACEMENT.name]
        _require(series.stamps, series['mount'], samples)

    def other() -> None:
        stamps, numbers = [], []
        with Reader(recording) as reader:
            for connection, _, raw in reader.messages():
                message = store.deserialize_cdr(raw, connection.msgtype)
                stamps.append(message.header.stamp.sec * 1_000_000_000 + message.header.stamp.nanosec)  # type: ignore[attr-defined]
                numbers.append(message.position[0])  # type: ignore[attr-defined]
        _require(np.array(stamps), np.array(numbers), samples)

    first, second = in_turn(ours, other, rounds)
    return Comparison(f'load displacement of {MINUTES} min', first / samples, 'rosbags', second / samples)


def _require(stamps: np.ndarray, numbers: np.ndarray, samples: int) -> None:
    """Raise `ValueError` unless the last sample was read: a figure of something else would mislead."""
    if len(stamps) != samples or stamps[-1] != _stamp(samples - 1) or numbers[-1] != samples - 1:
        raise ValueError(f'{len(stamps)} of {samples} samples were read, or read wrongly')


def _messages(count: int) -> list[bytes]:
    layout = ScalarsLayout(DISPLACEMENT)
    return [layout.pack(_stamp(index), (float(index),)) for index in range(count)]


def _stamp(index: int) -> int:
    return _STAMP + index * round(SAMPLE_TIME * 1e9)


def _write(folder: Path, raws: list[bytes]) -> None:
    writer = BagWriter(folder)
    writer.add_topic(_TOPIC, DISPLACEMENT.type)
    for index, raw in enumerate(raws):
        writer.write(_TOPIC, raw, _stamp(index))
    writer.close()
