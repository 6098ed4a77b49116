"""The front door: any file of measured signals as named columns with unit, time base and provenance."""

import hashlib
import importlib
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from engine_mount.signals.formats.bag import is_recording
from engine_mount.signals.formats.content import Content, Stated
from engine_mount.signals.formats.measured import (
    Heading,
    Measured,
    MeasuredColumn,
    Provenance,
    TimeBase,
    found,
)
from engine_mount.signals.signal import SignalError
from engine_mount.signals.sources.stores import local_copy

_READ = (
    'CSV and other text tables, JSON, NPY, NPZ, Parquet, MATLAB, HDF5, Excel (.xlsx), MDF, CAN logs '
    '(BLF, ASC, TRC, candump), MCAP and rosbag2'
)
_MARKS = {
    b'\x93NUMPY': 'npy', b'PAR1': 'parquet', b'\x89HDF': 'hdf5', b'MATLAB 7.3': 'hdf5', b'MATLAB 5': 'matlab',
    b'MDF ': 'mdf', b'UnFinMF ': 'mdf', b'\x89MCAP': 'bag', b'SQLite format 3': 'bag',
    b'\xd0\xcf\x11\xe0': 'xls',
}  # fmt: skip
"""Formats by the first bytes of their files."""
_SUFFIXES = {
    '.json': 'json', '.jsonl': 'json', '.ndjson': 'json', '.npy': 'npy', '.npz': 'npz', '.parquet': 'parquet',
    '.xlsx': 'excel', '.mf4': 'mdf', '.mdf': 'mdf', '.h5': 'hdf5', '.hdf5': 'hdf5', '.mat': 'matlab',
}  # fmt: skip
"""Formats by suffix, where the first bytes do not tell."""
_MODULES = {
    'npy': 'arrays', 'npz': 'arrays', 'array_folder': 'arrays', 'json': 'trees', 'matlab': 'trees',
    'hdf5': 'trees', 'can_log': 'can_frames',
}  # fmt: skip
"""Where `open_FORMAT` is, if not in a module called like the format."""


def read(uri: str | Path, columns: Sequence[str] | None = None, stated: Stated | None = None) -> Measured:
    """Return the columns of the file or folder at `uri`, only those that `columns` name where given.

    Raises `SignalError` or `SourceError` with one sentence: file, place, value, what was expected, remedy.
    """
    stated = stated or Stated()
    if stated.rate is not None and not (np.isfinite(stated.rate) and stated.rate > 0.0):
        raise SignalError(f'rate ({stated.rate:g} Hz) must be above 0')
    if stated.decimal not in ('', '.', ','):
        raise SignalError(f'decimal sign {stated.decimal!r} must be . or ,')
    with local_copy(str(uri)) as path:
        content = _opened(path, stated)
        there = content.headings
        chosen = there if columns is None else [found(wanted, there, str(uri)) for wanted in columns]
        chosen = list(dict.fromkeys(chosen))
        loaded = _with_rate(content.load(chosen), stated.rate)
        digest, size = _hashed(path)
    missing = {one.name: int(np.count_nonzero(np.isnan(one.values))) for one in loaded}
    notes = dict.fromkeys(content.notes) | {
        f'{one.name}: {missing[one.name]} of {one.values.size} samples hold no number': None
        for one in loaded
        if missing[one.name]
    }
    provenance = Provenance(str(uri), digest, size, content.format, content.reader)
    others = tuple(heading for heading in there if heading not in chosen)
    return Measured({one.name: one for one in loaded}, provenance, tuple(notes), others)


def headings(uri: str | Path, stated: Stated | None = None) -> tuple[Heading, ...]:
    """Return which columns the file or folder at `uri` has, without their values; raises as `read`."""
    with local_copy(str(uri)) as path:
        return _opened(path, stated or Stated()).headings


def is_foreign(path: Path) -> bool:
    """Return whether `path` is a file, or a folder of NPY files, rather than a recording of ROS 2."""
    if path.is_dir():
        from engine_mount.signals.formats.arrays import is_array_folder

        return not is_recording(path) and not (path / 'recording').exists() and is_array_folder(path)
    return path.is_file() and not is_recording(path)


def _opened(path: Path, stated: Stated) -> Content:
    """Return the opened file; a module is loaded when a file needs it."""
    try:
        kind = _kind_of_folder(path) if path.is_dir() else _kind_of_file(path)
        module = importlib.import_module(f'engine_mount.signals.formats.{_MODULES.get(kind, kind)}')
        content: Content = getattr(module, f'open_{kind}')(path, stated)
        return content
    except PermissionError:
        raise SignalError(f'{path} may not be read by you; change its permissions') from None


def _kind_of_file(path: Path) -> str:
    with path.open('rb') as file:
        head = file.read(512)
    suffix = path.suffix.lower()
    kind = next((kind for mark, kind in _MARKS.items() if head.startswith(mark)), '')
    if not head:
        raise SignalError(f'{path} is empty; give a file with samples')
    if kind == 'xls':
        raise SignalError(f'{path} is a workbook of Excel before 2007; save it as .xlsx')
    if head.startswith(b'PK'):
        return 'npz' if suffix == '.npz' else 'excel'
    if kind:
        return kind
    if is_recording(path):
        return 'bag'
    if suffix in ('.blf', '.trc', '.asc', '.log'):
        from engine_mount.signals.formats.can_frames import is_can_log

        if is_can_log(path):
            return 'can_log'
    text = b'\0' not in head or head.startswith((b'\xff\xfe', b'\xfe\xff'))
    if not text and suffix not in (*_SUFFIXES, '.csv', '.txt'):
        raise SignalError(f'{path.name}: files of type {suffix or "(none)"} are not read; read are {_READ}')
    return _SUFFIXES.get(suffix, 'text')


def _kind_of_folder(path: Path) -> str:
    from engine_mount.signals.formats.arrays import is_array_folder

    if is_recording(path):
        return 'bag'
    if is_array_folder(path):
        return 'array_folder'
    raise SignalError(
        f'{path} is a folder without a recording; give one file of it, the folder of a rosbag2 recording, or '
        'of pairs of NPY files (value and t, x_value.npy and x_t.npy)'
    )


def _with_rate(columns: list[MeasuredColumn], rate: float | None) -> list[MeasuredColumn]:
    """Return the columns, those without times on an even grid of the stated rate (Hz)."""
    if rate is None:
        return columns
    sizes = {one.values.size for one in columns}
    told = f'the stated rate of {rate:g} Hz'
    bases = {size: TimeBase(np.arange(size) / rate, 0, told) for size in sizes}
    return [replace(one, time=one.time or bases[one.values.size]) for one in columns]


def _hashed(path: Path) -> tuple[str, int]:
    """Return SHA-256 and size in bytes of a file, or of a folder as `Provenance` says."""
    if path.is_file():
        with path.open('rb') as stream:
            return hashlib.file_digest(stream, 'sha256').hexdigest(), path.stat().st_size
    whole, size = hashlib.sha256(), 0
    for file in sorted(one for one in path.rglob('*') if one.is_file()):
        digest, bytes_of_file = _hashed(file)
        whole.update(f'{digest}  {file.relative_to(path).as_posix()}\n'.encode())
        size += bytes_of_file
    return whole.hexdigest(), size
