"""Arrays as columns; NPY and NPZ files, and folders of pairs of times and values (as comma2k19 has them)."""

from collections.abc import Iterator
from functools import cache, partial
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from engine_mount.signals.formats.content import Content, Leaf, Stated, readable, with_dates
from engine_mount.signals.formats.measured import TimeBase
from engine_mount.signals.signal import SignalError

_WIDEST = 256  # columns, chosen: a wider array is an image or a matrix, not signals over time
_PAIRS = {'value': 't', 'values': 'times', 'value.npy': 't.npy'}
"""Files of values and of times that belong together in a folder, whose name is that of the signal."""
_VALUES = '_value.npy'


def leaves_of(name: str, array: Any, notes: list[str], unit: str = '', *, turned: bool = False) -> list[Leaf]:
    """Return the columns of an array: anything with shape and dtype that numpy can slice.

    The samples of a table run along its longer side; `turned` swaps the names of its sides. What is no signal
    is told in `notes`, single numbers aside.
    """
    shape, dtype = tuple(array.shape), array.dtype
    if dtype.names:
        parts = {f'{name}.{field}'.lstrip('.'): array[field] for field in dtype.names}
        return [leaf for path, part in parts.items() for leaf in leaves_of(path, part, notes)]
    what, sides, date = name or 'the array', [side for side in shape if side > 1], dtype.kind == 'M'
    if 0 in shape or not sides:
        return []
    if dtype.kind not in 'fiubmM':
        notes.append(f'{what}: {dtype} is no number, left out')
        return []
    if len(sides) == 1:
        return [Leaf(name or 'value', lambda: np.asarray(array[...]).reshape(-1), unit, date=date)]
    if len(shape) > 2 or min(shape) > _WIDEST:
        notes.append(f'{what}: an array of {" x ".join(map(str, shape))} is no signal, left out')
        return []
    rows, columns = shape[::-1] if turned else shape
    if rows < columns:
        notes.append(f'{what}: {rows} x {columns}, samples taken along the rows')

    def column(place: int) -> NDArray[Any]:
        return np.asarray(array[place, :] if (rows < columns) != turned else array[:, place])

    return [
        Leaf(f'{name}.{place}'.lstrip('.'), partial(column, place), unit, date=date)
        for place in range(min(shape))
    ]


def open_npy(path: Path, stated: Stated) -> Content:
    """Return the columns of an NPY file, with the times of the file beside it where there is one."""
    notes: list[str] = []
    times = _times_of(path)
    if times is None:
        return Content(path, 'NPY', 'numpy', with_dates(path, leaves_of('', _loaded(path), notes)), notes)
    name = path.parent.name if path.name in _PAIRS else path.name.removesuffix(_VALUES)
    return Content(path, 'NPY with times', 'numpy', _pair(name, path, times, notes), notes)


def open_npz(path: Path, stated: Stated) -> Content:
    """Return the columns of all arrays of an NPZ file."""
    notes: list[str] = []
    leaves: list[Leaf] = []
    with readable(path, 'NPZ file'), np.load(path, allow_pickle=False) as archive:
        for name in archive.files:
            try:
                leaves += leaves_of(name, archive[name], notes)
            except ValueError as error:
                if 'allow_pickle' not in str(error):
                    raise
                notes.append(f'{name}: objects, left out')
    return Content(path, 'NPZ', 'numpy', with_dates(path, leaves), notes)


def is_array_folder(path: Path) -> bool:
    """Return whether a folder holds, at any depth, pairs of values and times."""
    return path.is_dir() and next(_pairs_below(path), None) is not None


def open_array_folder(path: Path, stated: Stated) -> Content:
    """Return the columns of all pairs in a folder: `accelerometer.2`, or `IMU/accelerometer.2` from above."""
    notes: list[str] = []
    leaves: list[Leaf] = []
    for name, values, times in _pairs_below(path):
        try:
            leaves += _pair(name, values, times, notes)
        except SignalError as error:
            notes.append(f'left out: {error}')
    return Content(path, 'folder of NPY files', 'numpy', leaves, notes)


def _pairs_below(path: Path) -> Iterator[tuple[str, Path, Path]]:
    """Yield name, file of values and file of times of every pair, sorted by path."""
    for file in sorted(one for one in path.rglob('*') if one.is_file()):
        times = _times_of(file)
        if times is None:
            continue
        if file.name.endswith(_VALUES):
            yield str(file.relative_to(path)).removesuffix(_VALUES), file, times
        elif file.open('rb').read(6) == b'\x93NUMPY':
            place = file.parent.relative_to(path)
            yield str(place) if place.parts else path.name, file, times


def _times_of(file: Path) -> Path | None:
    """Return the file of times that belongs to a file of values."""
    name = _PAIRS.get(file.name, '')
    if file.name.endswith(_VALUES):
        name = file.name.removesuffix(_VALUES) + '_t.npy'
    return file.with_name(name) if name and file.with_name(name).is_file() else None


def _pair(name: str, values: Path, times: Path, notes: list[str]) -> list[Leaf]:
    stamps, array = _loaded(times), _loaded(values)
    if stamps.dtype.kind not in 'fiu' or sum(side > 1 for side in stamps.shape) > 1:
        raise SignalError(
            f'{times} holds {stamps.dtype} of shape {stamps.shape}; needed are times in s, (samples,)'
        )
    if array.shape[:1] != (stamps.size,):
        raise SignalError(
            f'{values} holds {array.shape[0] if array.shape else 1} samples, {times.name} beside it '
            f'{stamps.size} times; both must be of equal length'
        )

    @cache
    def clock() -> TimeBase:
        return TimeBase(np.asarray(stamps, np.float64).reshape(-1), 0, f'times in {times.name}, taken as s')

    leaves = leaves_of(name, array, notes)
    if len(leaves) == 1:
        leaves = [leaves[0]._replace(name=f'{name}.0')]
    return [leaf._replace(clock=clock) for leaf in leaves]


def _loaded(path: Path) -> NDArray[Any]:
    with readable(path, 'NPY file of numbers'):
        return np.load(path, mmap_mode='r', allow_pickle=False)
