"""MATLAB files up to version 7 (scipy) and 7.3, and plain HDF5 (h5py): variables, structs and timeseries."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from engine_mount.signals.formats.broken import reading
from engine_mount.signals.formats.content import Stated
from engine_mount.signals.formats.trees.layouts import leaves_in
from engine_mount.signals.formats.trees.leaves import Leaf, Leaves
from engine_mount.signals.signal import SignalError

_OBJECTS = (
    'objects of MATLAB (timeseries, timetable, table) are read by MATLAB alone, left out; save their '
    'numbers: s.time = ts.Time; s.data = ts.Data'
)
_DEEPEST = 16  # levels, chosen
_MOST = 4096  # elements of an array of structs or cells, chosen


def open_matlab(path: Path, stated: Stated) -> Leaves:
    """Return the columns of a MATLAB file of version 4 to 7."""
    from scipy.io import loadmat

    notes: list[str] = []
    with reading(path, 'MATLAB file', 'is it cut off? Save it again'):
        tree = loadmat(str(path), simplify_cells=True)
    variables = {name: value for name, value in tree.items() if not name.startswith('__')}
    if '__function_workspace__' in tree or any(map(_is_opaque, variables.values())):
        notes.append(_OBJECTS)
    plain = {name: _plain(value) for name, value in variables.items() if not _is_opaque(value)}
    found = list(leaves_in(plain, notes))
    _refuse_none(path, found, notes)
    return Leaves(path, 'MATLAB', 'scipy', found, notes)


def _is_opaque(value: Any) -> bool:
    names = getattr(getattr(value, 'dtype', None), 'names', None) or ()
    return type(value).__name__ == 'MatlabOpaque' or '_ObjectSystem' in str(names) or 's0' in names


def _plain(value: Any) -> Any:
    """Return a cell array as a list, so that what it holds is looked into."""
    if isinstance(value, Mapping):
        return {key: _plain(one) for key, one in value.items()}
    if isinstance(value, np.ndarray) and value.dtype == object:
        return [_plain(one) for one in value.ravel()[:_MOST]]
    return [_plain(one) for one in value[:_MOST]] if isinstance(value, list) else value


def open_hdf5(path: Path, stated: Stated) -> Leaves:
    """Return the columns of an HDF5 file, MATLAB 7.3 included; they are read when they are chosen."""
    from engine_mount.signals.extras import required

    h5py = required('h5py', 'reading HDF5 and MATLAB 7.3 files')
    notes: list[str] = []
    with reading(path, 'HDF5 file'):
        file = h5py.File(path, 'r')
        tree = _group(file, file, notes, 0)
        found = list(leaves_in(tree, notes))
    _refuse_none(path, found, notes)
    matlab = any('MATLAB_class' in one.attrs for one in file.values())
    return Leaves(path, 'MATLAB 7.3' if matlab else 'HDF5', 'h5py', found, notes)


def _group(file: Any, group: Any, notes: list[str], depth: int) -> Any:
    """Return a group as a mapping, an array of structs as a list of them."""
    children = {name: child for name, child in group.items() if not name.startswith('#')}
    found = {name: _node(file, child, notes, depth + 1) for name, child in children.items()}
    lengths = {len(value) if isinstance(value, list) else 0 for value in found.values()}
    if len(lengths) == 1 and 0 not in lengths:
        return [{name: found[name][place] for name in found} for place in range(lengths.pop())]
    return found


def _node(file: Any, node: Any, notes: list[str], depth: int) -> Any:
    if depth > _DEEPEST:
        return None
    if hasattr(node, 'items'):
        return _group(file, node, notes, depth)
    kind = node.attrs.get('MATLAB_class', b'')
    if 'MATLAB_empty' in node.attrs or node.shape is None:
        return None
    if kind == b'char':
        return ''.join(map(chr, np.asarray(node).reshape(-1)[:_MOST]))
    if node.dtype.kind == 'O' and node.dtype.metadata and 'ref' in node.dtype.metadata:
        return [_node(file, file[one], notes, depth + 1) for one in np.asarray(node).reshape(-1)[:_MOST]]
    if 'MATLAB_object_decode' in node.attrs:
        notes.append(_OBJECTS)
        return None
    if node.dtype.kind in 'OSU':
        return node.asstr()[()] if not node.shape and node.dtype.kind == 'O' else node
    return _Turned(node) if kind and len(node.shape) == 2 else node


class _Turned:
    """A matrix of MATLAB, whose rows HDF5 holds as columns; read when it is sliced."""

    def __init__(self, dataset: Any):
        self._dataset = dataset
        self.shape = dataset.shape[::-1]
        self.dtype = dataset.dtype
        self.attrs = dataset.attrs

    def __getitem__(self, key: Any) -> Any:
        return self._dataset[...].T if key is Ellipsis else self._dataset[key[::-1]]


def _refuse_none(path: Path, found: list[Leaf], notes: list[str]) -> None:
    if not found:
        why = f': {"; ".join(dict.fromkeys(notes))}' if notes else ''
        raise SignalError(f'{path} holds no signals{why}; needed are arrays of real numbers over time')
