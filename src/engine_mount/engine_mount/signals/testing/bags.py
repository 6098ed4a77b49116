"""Recordings of ROS 2."""

from pathlib import Path

import numpy as np

from engine_mount.signals.formats.measured import FloatArray
from engine_mount.signals.testing.made import BEGIN, Columns, Made


def make_mcap(folder: Path, name: str, times: FloatArray, columns: Columns) -> Made:
    """Write a rosbag2 folder with MCAP, by the rosbags package."""
    return _bag(folder / name, 'MCAP', times, columns)


def make_sqlite(folder: Path, name: str, times: FloatArray, columns: Columns) -> Made:
    """Write a rosbag2 folder with sqlite3, packed by zstd as a whole."""
    return _bag(folder / name, 'SQLITE3', times, columns)


def _bag(folder: Path, storage: str, times: FloatArray, columns: Columns) -> Made:
    """Write `/signals`, a JointState with a position for each column."""
    from rosbags.rosbag2 import CompressionFormat, CompressionMode, StoragePlugin, Writer
    from rosbags.typesys import Stores, get_typestore

    store = get_typestore(Stores.ROS2_JAZZY)
    kinds = store.types
    state, header, stamp = (
        kinds[name]
        for name in ('sensor_msgs/msg/JointState', 'std_msgs/msg/Header', 'builtin_interfaces/msg/Time')
    )
    writer = Writer(folder, version=9, storage_plugin=StoragePlugin[storage])
    if storage == 'SQLITE3':
        writer.set_compression(CompressionMode.FILE, CompressionFormat.ZSTD)
    table, none = np.column_stack([values for _, values in columns.values()]), np.empty(0)
    with writer:
        connection = writer.add_connection('/signals', state.__msgtype__, typestore=store)
        for time, row in zip(times.tolist(), table, strict=True):
            nanoseconds = BEGIN * 10**9 + round(time * 1e9)
            head = header(stamp=stamp(*divmod(nanoseconds, 10**9)), frame_id='')
            message = state(header=head, name=list(columns), position=row, velocity=none, effort=none)
            writer.write(connection, nanoseconds + 1_000_000, store.serialize_cdr(message, state.__msgtype__))
    return Made(folder, {key: key for key in columns}, units=False)
