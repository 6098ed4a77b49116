"""What happens to recordings in the field, one function for each: `(folder, random)` spoils a whole one."""

import shutil
from collections.abc import Callable, Mapping
from pathlib import Path

import numpy as np

from mount_recorder.bag_writer import BagWriter
from mount_recorder.metadata import METADATA_NAME
from mount_ros.messages.cdr import accelerometer
from mount_ros.messages.scalars import OneNumberLayout

Damage = Callable[[Path, np.random.Generator], None]

FOREIGN_SAMPLES = 500  # chosen: 5 s at 100 Hz
LEFT = 0.6  # chosen: share of a file that the power failure left


def truncate(folder: Path, random: np.random.Generator) -> None:
    """End the file in the middle of a message, as a power failure does."""
    file = _data(folder)
    file.write_bytes(file.read_bytes()[: int(LEFT * file.stat().st_size)])


def lose_metadata(folder: Path, random: np.random.Generator) -> None:
    """Remove `metadata.yaml`, which is easily left behind when a file is copied."""
    (folder / METADATA_NAME).unlink()


def fill_with_garbage(folder: Path, random: np.random.Generator) -> None:
    """Replace the bytes of the file by random ones, as a broken disk does."""
    _data(folder).write_bytes(random.bytes(65_536))


def lose_data(folder: Path, random: np.random.Generator) -> None:
    """Leave a folder without data: `metadata.yaml` alone, for a store of objects knows no empty folder."""
    _data(folder).unlink()


def spoil_checksum(folder: Path, random: np.random.Generator) -> None:
    """Change one byte in the middle, which only the check sum of its chunk tells."""
    file = _data(folder)
    raw = bytearray(file.read_bytes())
    raw[len(raw) // 2] ^= 0xFF
    file.write_bytes(bytes(raw))


def replace_by_foreign(folder: Path, random: np.random.Generator) -> None:
    """Put a bag of another system in its place, which holds an acceleration and no displacement."""
    shutil.rmtree(folder)
    writer = BagWriter(folder)
    try:
        imu = OneNumberLayout(accelerometer)
        writer.add_topic('/imu/data', 'sensor_msgs/msg/Imu')
        for place, value in enumerate(random.normal(0.0, 0.3, FOREIGN_SAMPLES)):
            stamp = place * 10_000_000  # ns
            writer.write('/imu/data', imu.pack(stamp, float(value)), stamp)
    finally:
        writer.close()


DAMAGES: Mapping[str, Damage] = {
    'truncated': truncate,
    'no_metadata': lose_metadata,
    'garbage': fill_with_garbage,
    'no_data': lose_data,
    'wrong_checksum': spoil_checksum,
    'foreign': replace_by_foreign,
}


def _data(folder: Path) -> Path:
    (file,) = folder.glob('*.mcap')
    return file
