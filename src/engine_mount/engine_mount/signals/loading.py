"""A signal from a file of any of the formats that are read."""

from pathlib import Path

from engine_mount.recordings.recording import ReadingError, open_recording
from engine_mount.signals.bag_field import read_field
from engine_mount.signals.npy_file import read_npy
from engine_mount.signals.signal import Signal, SignalError
from engine_mount.signals.table import read_csv, read_json

TABLES = {'.csv': read_csv, '.txt': read_csv, '.json': read_json}


def load_signal(path: Path, *, column: str = '', time_column: str = '', topic: str = '') -> Signal:
    """Return the chosen signal of `path` as recorded, or raise `SignalError`.

    `column` is a header name or number (CSV, JSON), a number or `signal.number` (NPY), or the field of the
    message such as `linear_acceleration.z` (MCAP, with `topic`).
    """
    if not path.exists():
        raise SignalError(
            f'{path} does not exist; give an existing CSV, NPY, JSON or MCAP file, or a folder of NPY files'
        )
    if is_recording(path):
        if not topic or not column:
            raise SignalError(
                f'{path} is an MCAP recording: name a topic and a field, '
                'such as --topic /imu --column linear_acceleration.z'
            )
        try:
            recording = open_recording(path)
        except ReadingError as error:
            raise SignalError(str(error)) from None
        return read_field(recording, topic, column)
    if path.is_dir() or path.suffix.lower() == '.npy':
        return read_npy(path, column)
    if path.suffix.lower() in TABLES:
        return TABLES[path.suffix.lower()](path).signal(column, time_column)
    raise SignalError(
        f'{path.name}: files of type {path.suffix or "(none)"!s} are not read; use .csv, .json, .npy or .mcap'
    )


def is_recording(path: Path) -> bool:
    """Return whether `path` is a bag: its folder, or one of its files, compressed or not."""
    names = [file.name for file in path.iterdir()] if path.is_dir() else [path.name]
    return any(kind in Path(name).suffixes for name in names for kind in ('.mcap', '.db3'))
