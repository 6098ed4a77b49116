"""The front door: any file of measured signals as named columns with unit, time base and provenance."""

import hashlib
from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from engine_mount.signals.formats.content import Content, Stated
from engine_mount.signals.formats.measured import (
    Heading,
    Measured,
    MeasuredColumn,
    Provenance,
    TimeBase,
    found,
)
from engine_mount.signals.loading import is_recording
from engine_mount.signals.signal import SignalError
from engine_mount.signals.sources.stores import local_copy

Opener = Callable[[Path, Stated], Content]
READ = (
    'CSV and other text tables, JSON, NPY, NPZ, Parquet, MATLAB, HDF5, Excel (.xlsx), MDF, CAN logs '
    '(BLF, ASC, TRC, candump), MCAP and rosbag2'
)
"""What is read, for sentences."""


def read(uri: str | Path, columns: Sequence[str] | None = None, stated: Stated | None = None) -> Measured:
    """Return the columns of the file or folder at `uri`, only those that `columns` name where given.

    Raises `SignalError` or `SourceError` with one sentence: file, place, value, what was expected, remedy.
    """
    stated = stated or Stated()
    _check_stated(stated)
    with local_copy(str(uri)) as path:
        content = _opened(path, stated)
        there = content.headings
        chosen = there if columns is None else [found(wanted, there, str(uri)) for wanted in columns]
        chosen = list(dict.fromkeys(chosen))
        loaded = _with_rate(content.load(chosen), stated)
        digest, size = _hashed(path)
        others = tuple(heading for heading in there if heading not in chosen)
        provenance = Provenance(str(uri), digest, size, content.format, content.reader)
        notes = (*dict.fromkeys(content.notes), *_missing(loaded))
        return Measured({one.name: one for one in loaded}, provenance, notes, others)


def headings(uri: str | Path, stated: Stated | None = None) -> tuple[Heading, ...]:
    """Return which columns the file or folder at `uri` has, without their values; raises as `read`."""
    with local_copy(str(uri)) as path:
        return tuple(_opened(path, stated or Stated()).headings)


def is_foreign(path: Path) -> bool:
    """Return whether `path` is a file, or a folder of NPY files, rather than a recording of ROS 2."""
    from engine_mount.signals.formats.trees import arrays

    if path.is_dir():
        return not is_recording(path) and not (path / 'recording').exists() and arrays.is_array_folder(path)
    return path.is_file() and not is_recording(path)


def _opened(path: Path, stated: Stated) -> Content:
    try:
        return _opener(path)(path, stated)
    except PermissionError:
        raise SignalError(f'{path} may not be read by you; change its permissions') from None


def _opener(path: Path) -> Opener:
    """Return what opens a file, by its first bytes, and by its suffix where these do not tell."""
    from engine_mount.signals.formats.can import log
    from engine_mount.signals.formats.text.table import TextTable
    from engine_mount.signals.formats.trees import arrays, json_file

    if path.is_dir():
        return _opener_of_folder(path)
    with path.open('rb') as file:
        head = file.read(512)
    if not head:
        raise SignalError(f'{path} is empty; give a file with samples')
    suffix = path.suffix.lower()
    binary = _by_first_bytes(head, suffix)
    if binary is not None:
        return binary
    if is_recording(path):
        return _bag
    if log.is_can_log(path):
        return log.CanLog
    by_suffix: dict[str, Opener] = {
        '.json': json_file.open_json, '.jsonl': json_file.open_json, '.ndjson': json_file.open_json,
        '.npy': arrays.open_npy, '.npz': arrays.open_npz, '.parquet': _parquet, '.xlsx': _excel,
        '.mf4': _mdf, '.mdf': _mdf, '.h5': _hdf5, '.hdf5': _hdf5, '.mat': _matlab,
    }  # fmt: skip
    if suffix in by_suffix:
        return by_suffix[suffix]
    if b'\0' in head and not head.startswith((b'\xff\xfe', b'\xfe\xff')) and suffix not in ('.csv', '.txt'):
        raise SignalError(f'{path.name}: files of type {suffix or "(none)"} are not read; read are {READ}')
    return TextTable


def _by_first_bytes(head: bytes, suffix: str) -> Opener | None:
    from engine_mount.signals.formats.trees import arrays

    marks: tuple[tuple[bytes, Opener], ...] = (
        (b'\x93NUMPY', arrays.open_npy), (b'PAR1', _parquet), (b'\x89HDF', _hdf5), (b'MATLAB 7.3', _hdf5),
        (b'MATLAB 5', _matlab), (b'MDF ', _mdf), (b'UnFinMF ', _mdf), (b'\x89MCAP', _bag),
        (b'SQLite format 3', _bag),
    )  # fmt: skip
    for mark, opener in marks:
        if head.startswith(mark):
            return opener
    if head.startswith(b'PK') and suffix != '.npz':
        return _excel
    if head.startswith(b'\xd0\xcf\x11\xe0'):
        return _old_excel
    return arrays.open_npz if head.startswith(b'PK') else None


def _opener_of_folder(path: Path) -> Opener:
    from engine_mount.signals.formats.trees import arrays

    if is_recording(path):
        return _bag
    if arrays.is_array_folder(path):
        return arrays.open_array_folder
    raise SignalError(
        f'{path} is a folder without a recording; give one file of it, the folder of a rosbag2 recording, or '
        'of pairs of NPY files (value and t, x_value.npy and x_t.npy)'
    )


def _bag(path: Path, stated: Stated) -> Content:
    from engine_mount.signals.formats.bag import Bag

    return Bag(path, stated)


def _parquet(path: Path, stated: Stated) -> Content:
    from engine_mount.signals.formats.parquet import Parquet

    return Parquet(path, stated)


def _excel(path: Path, stated: Stated) -> Content:
    from engine_mount.signals.formats.excel import Workbook

    return Workbook(path, stated)


def _old_excel(path: Path, stated: Stated) -> Content:
    raise SignalError(f'{path} is a workbook of Excel before 2007; save it as .xlsx')


def _mdf(path: Path, stated: Stated) -> Content:
    from engine_mount.signals.formats.mdf import Mdf

    return Mdf(path, stated)


def _hdf5(path: Path, stated: Stated) -> Content:
    from engine_mount.signals.formats.trees.matlab import open_hdf5

    return open_hdf5(path, stated)


def _matlab(path: Path, stated: Stated) -> Content:
    from engine_mount.signals.formats.trees.matlab import open_matlab

    return open_matlab(path, stated)


def _check_stated(stated: Stated) -> None:
    if stated.rate is not None and not (np.isfinite(stated.rate) and stated.rate > 0.0):
        raise SignalError(f'rate ({stated.rate:g} Hz) must be above 0')
    if stated.decimal not in ('', '.', ','):
        raise SignalError(f'decimal sign {stated.decimal!r} must be . or ,')


def _with_rate(columns: list[MeasuredColumn], stated: Stated) -> list[MeasuredColumn]:
    """Return the columns, those without times on an even grid of the stated rate."""
    if stated.rate is None:
        return columns
    times: dict[int, TimeBase] = {}
    told = f'the stated rate of {stated.rate:g} Hz'
    return [
        one if one.time is not None else replace(one, time=times.setdefault(
            one.values.size, TimeBase(np.arange(one.values.size) / stated.rate, 0, told)
        ))
        for one in columns
    ]  # fmt: skip


def _missing(columns: list[MeasuredColumn]) -> Iterator[str]:
    for one in columns:
        count = int(np.count_nonzero(np.isnan(one.values)))
        if count:
            yield f'{one.name}: {count} of {one.values.size} samples hold no number'


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
