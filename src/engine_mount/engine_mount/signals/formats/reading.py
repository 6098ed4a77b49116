"""The front door: any file of measured signals as named columns with unit, time base and provenance."""

import gzip
import hashlib
import importlib
import shutil
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

from engine_mount.signals.formats.arrays import is_array_folder
from engine_mount.signals.formats.can_frames import is_can_log
from engine_mount.signals.formats.content import NOT_STATED, Content, Stated, readable
from engine_mount.signals.formats.measured import Heading, Measured, Provenance, found
from engine_mount.signals.signal import SignalError
from engine_mount.signals.sources.stores import local_copy

_READ = (
    'CSV, LabVIEW (.lvm) and other text tables, JSON, NPY, NPZ, Parquet, MATLAB, HDF5, Excel (.xlsx), MDF, '
    'CAN logs (BLF, ASC, TRC, candump), MCAP and rosbag2, and those compressed as .gz'
)
_MARKS = {
    b'\x93NUMPY': 'npy', b'PAR1': 'parquet', b'\x89HDF': 'hdf5', b'MATLAB': 'matlab',
    b'MDF ': 'mdf', b'UnFinMF ': 'mdf', b'\x89MCAP': 'bag', b'SQLite format 3': 'bag',
}  # fmt: skip
"""Formats by the first bytes of their files."""
_REFUSED = {
    b'\xd0\xcf\x11\xe0': 'is a workbook of Excel before 2007; save it as .xlsx',
    b'#ROSBAG V2': 'is a bag of ROS 1; convert it with rosbags-convert',
    b'.FIT': 'is a FIT file of a sports watch; export it as CSV',
    b'TDSm': 'is a TDMS file; export it as CSV, or as MDF',
    b'version https://git-lfs': 'is a pointer of Git LFS; fetch the file itself with git lfs pull',
}
"""What is known but not read, by the first bytes."""
_GZIP = b'\x1f\x8b'
_SUFFIXES = {
    '.json': 'json', '.jsonl': 'json', '.ndjson': 'json', '.npy': 'npy', '.npz': 'npz', '.parquet': 'parquet',
    '.xlsx': 'excel', '.mf4': 'mdf', '.mdf': 'mdf', '.h5': 'hdf5', '.hdf5': 'hdf5', '.mat': 'matlab',
}  # fmt: skip
"""Formats by suffix, where the first bytes do not tell."""
_MODULES = {
    'npy': 'arrays', 'npz': 'arrays', 'array_folder': 'arrays', 'json': 'trees', 'matlab': 'trees',
    'hdf5': 'trees', 'parquet': 'trees', 'can_log': 'can_frames',
}  # fmt: skip
"""Where `open_FORMAT` is, if not in a module called like the format."""


def read(uri: str | Path, columns: Sequence[str] | None = None, stated: Stated = NOT_STATED) -> Measured:
    """Return the columns of the file or folder at `uri`, only those that `columns` name where given.

    Raises `SignalError` or `SourceError` with one sentence: file, place, value, what was expected, remedy.
    """
    with local_copy(str(uri)) as path, _unpacked(path) as plain:
        content = _opened(plain, stated)
        there = content.headings
        chosen = there if columns is None else [found(wanted, there, str(uri)) for wanted in columns]
        loaded = content.load(list(dict.fromkeys(chosen)), named=columns is not None)
        digest, size = _hashed(path)
    notes = dict.fromkeys(content.notes)
    for one in loaded:
        if missing := np.count_nonzero(np.isnan(one.values)):
            notes[f'{one.name}: {missing} of {one.values.size} samples hold no number'] = None
    columns_read = {one.name: one for one in loaded}
    others = tuple(heading for heading in there if heading.name not in columns_read)
    provenance = Provenance(str(uri), digest, size, content.format, content.reader)
    return Measured(columns_read, provenance, tuple(notes), others)


def headings(uri: str | Path, stated: Stated = NOT_STATED) -> tuple[Heading, ...]:
    """Return which columns the file or folder at `uri` has, without their values; raises as `read`."""
    with local_copy(str(uri)) as path, _unpacked(path) as plain:
        return _opened(plain, stated).headings


def is_recording(path: Path) -> bool:
    """Return whether `path` is a bag: its folder, or one of its files, compressed or not."""
    names = [file.name for file in path.iterdir()] if path.is_dir() else [path.name]
    return any(kind in Path(name).suffixes for name in names for kind in ('.mcap', '.db3'))


def is_foreign(path: Path) -> bool:
    """Return whether `path` is a file, or a folder of NPY files, rather than a recording of ROS 2."""
    if is_recording(path) or (path / 'recording').exists():
        return False
    return path.is_file() or is_array_folder(path)


@contextmanager
def _unpacked(path: Path) -> Iterator[Path]:
    """Give the content of a .gz file as a file for as long as the block lasts, any other path itself."""
    if path.is_dir() or path.open('rb').read(2) != _GZIP:
        yield path
        return
    with TemporaryDirectory() as folder:
        plain = Path(folder, path.stem)
        with readable(path, 'gzip file'), gzip.open(path) as packed, plain.open('wb') as file:
            shutil.copyfileobj(packed, file)
        yield plain


def _opened(path: Path, stated: Stated) -> Content:
    """Return the opened file; a module is loaded when a file needs it."""
    try:
        kind = _kind(path)
        module = importlib.import_module(f'engine_mount.signals.formats.{_MODULES.get(kind, kind)}')
        content: Content = getattr(module, f'open_{kind}')(path, stated)
        return content
    except PermissionError:
        raise SignalError(f'{path} may not be read by you; change its permissions') from None


def _kind(path: Path) -> str:
    if path.is_dir():
        if is_recording(path):
            return 'bag'
        if is_array_folder(path):
            return 'array_folder'
        raise SignalError(
            f'{path} is a folder without a recording; give one file of it, the folder of a rosbag2 '
            'recording, or of pairs of NPY files (value and t, x_value.npy and x_t.npy)'
        )
    with path.open('rb') as file:
        head = file.read(512)
    suffix = path.suffix.lower()
    if not head:
        raise SignalError(f'{path} is empty; give a file with samples')
    for mark, why in _REFUSED.items():
        if head.startswith(mark) or head[8:12] == mark:  # behind the sizes of a FIT file
            raise SignalError(f'{path} {why}')
    if head.startswith(b'PK'):
        return 'npz' if suffix == '.npz' else 'excel'
    if head[124:128] in (b'\0\2IM', b'\2\0MI'):  # MATLAB 7.3, whatever its words say
        return 'hdf5'
    for mark, kind in _MARKS.items():
        if head.startswith(mark):
            return kind
    if is_recording(path):
        return 'bag'
    if suffix in ('.blf', '.trc', '.asc', '.log') and is_can_log(path):
        return 'can_log'
    text = b'\0' not in head or head.startswith((b'\xff\xfe', b'\xfe\xff'))
    if not text and suffix not in (*_SUFFIXES, '.csv', '.txt'):
        raise SignalError(f'{path.name}: files of type {suffix or "(none)"} are not read; read are {_READ}')
    return _SUFFIXES.get(suffix, 'text')


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
