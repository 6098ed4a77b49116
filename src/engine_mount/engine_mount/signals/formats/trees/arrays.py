"""NPY and NPZ files, and folders of pairs of times and values: by their names, or as comma2k19 has them."""

from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np

from engine_mount.signals.formats.broken import reading
from engine_mount.signals.formats.content import Stated
from engine_mount.signals.formats.trees.layouts import leaves_in
from engine_mount.signals.formats.trees.leaves import Leaf, Leaves, leaves_of, with_dates
from engine_mount.signals.signal import SignalError

_PAIRS = (('value', 't'), ('values', 'times'), ('value.npy', 't.npy'))
"""Names of files that belong together in a folder, which is then the name of the signal."""
_NAMED = ('_value.npy', '_t.npy')


def open_npy(path: Path, stated: Stated) -> Leaves:
    """Return the columns of an NPY file, with the times of the file beside it where there is one."""
    notes: list[str] = []
    times = _times_of(path)
    if times is None:
        found = leaves_of('', _loaded(path), notes)
        _refuse_none(path, found, notes)
        return Leaves(path, 'NPY', 'numpy', with_dates(found), notes)
    name = (
        path.parent.name if times.name in {time for _, time in _PAIRS} else path.name.removesuffix(_NAMED[0])
    )
    return Leaves(path, 'NPY with times', 'numpy', _pair(name, path, times, notes), notes)


def open_npz(path: Path, stated: Stated) -> Leaves:
    """Return the columns of all arrays of an NPZ file."""
    notes: list[str] = []
    with reading(path, 'NPZ file'), np.load(path, allow_pickle=False) as archive:
        arrays = {}
        for name in archive.files:
            try:
                arrays[name] = archive[name]
            except ValueError as error:
                if 'allow_pickle' not in str(error):
                    raise
                notes.append(f'{name}: objects, left out')
        found = with_dates(list(leaves_in(arrays, notes)))
    _refuse_none(path, found, notes)
    return Leaves(path, 'NPZ', 'numpy', found, notes)


def is_array_folder(path: Path) -> bool:
    """Return whether a folder holds, at any depth, pairs of values and times."""
    return path.is_dir() and next(_pairs_below(path), None) is not None


def open_array_folder(path: Path, stated: Stated) -> Leaves:
    """Return the columns of all pairs in a folder: `accelerometer.2`, or `IMU/accelerometer.2` from above."""
    notes: list[str] = []
    found: list[Leaf] = []
    for name, values, times in _pairs_below(path):
        try:
            found += _pair(name, values, times, notes)
        except SignalError as error:
            notes.append(f'left out: {error}')
    _refuse_none(path, found, notes)
    return Leaves(path, 'folder of NPY files', 'numpy', found, notes)


def _pairs_below(path: Path) -> Iterator[tuple[str, Path, Path]]:
    """Yield name, file of values and file of times of every pair, sorted by path."""
    for file in sorted(one for one in path.rglob('*') if one.is_file()):
        times = _times_of(file)
        if times is None:
            continue
        if file.name.endswith(_NAMED[0]):
            yield str(file.relative_to(path))[: -len(_NAMED[0])], file, times
        elif _is_npy(file):
            place = file.parent.relative_to(path)
            yield str(place) if place.parts else path.name, file, times


def _times_of(file: Path) -> Path | None:
    """Return the file of times that belongs to a file of values."""
    names = dict(_PAIRS)
    name = names.get(file.name, '')
    if file.name.endswith(_NAMED[0]):
        name = file.name.removesuffix(_NAMED[0]) + _NAMED[1]
    return file.with_name(name) if name and file.with_name(name).is_file() else None


def _is_npy(file: Path) -> bool:
    with file.open('rb') as stream:
        return stream.read(6) == b'\x93NUMPY'


def _pair(name: str, values: Path, times: Path, notes: list[str]) -> list[Leaf]:
    clock = _loaded(times)
    if clock.dtype.kind not in 'fiu' or sum(side > 1 for side in clock.shape) > 1:
        raise SignalError(
            f'{times} holds {clock.dtype} of shape {clock.shape}; needed are times in s, (samples,)'
        )
    axis = Leaf('t', clock, axis=int(np.argmax(clock.shape)) if clock.shape else 0)
    array = _loaded(values)
    if not array.shape or array.shape[0] != axis.count:
        raise SignalError(
            f'{values} holds {array.shape[0] if array.shape else 1} samples, {times.name} beside it '
            f'{axis.count} times; both must be of equal length'
        )
    if array.ndim == 1:
        array = array[:, None]
    found = leaves_of(name, array, notes) if array.shape[1] > 1 else [Leaf(f'{name}.0', array, place=0)]
    return [replace(leaf, time=axis, told=f'times in {times.name}, taken as s') for leaf in found]


def _loaded(path: Path) -> np.ndarray:
    with reading(path, 'NPY file of numbers'):
        return np.load(path, mmap_mode='r', allow_pickle=False)


def _refuse_none(path: Path, found: list[Leaf], notes: list[str]) -> None:
    if not found:
        why = f': {"; ".join(notes)}' if notes else ''
        raise SignalError(f'{path} holds no signals{why}; needed are arrays of real numbers over time')
