"""What nests, as columns by their paths (`imu.acc.z`): JSON, MATLAB, HDF5 and Parquet."""

import json
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

import numpy as np

from engine_mount.signals.formats.arrays import leaves_of
from engine_mount.signals.formats.cells import date_in, name_and_unit
from engine_mount.signals.formats.content import Content, Leaf, Stated, readable, with_dates
from engine_mount.signals.signal import SignalError, required

_DEEPEST = 32  # groups of an HDF5 file, whose links may form circles, chosen
_MOST = 4096  # elements of an array of structs or cells, chosen
_LONGEST_VECTOR = 64  # numbers of one sample, chosen: a covariance has 36
_UNITS = ('Units', 'units', 'Unit', 'unit')
_VALUES = ('Data', 'data', 'values', 'Values')
"""Keys of the samples, to which the unit beside them belongs."""
_ARROW_NUMBERS = ('int', 'uint', 'float', 'double', 'halffloat', 'bool', 'timestamp', 'decimal')
_OBJECTS = (
    'objects of MATLAB (timeseries, timetable, table) are read by MATLAB alone, left out; save their '
    'numbers: s.time = ts.Time; s.data = ts.Data'
)


def leaves_in(tree: Any, notes: list[str], name: str = '', unit: str = '') -> Iterator[Leaf]:
    """Yield the columns of nested mappings, lists of mappings, and arrays."""
    if isinstance(tree, Mapping):
        own = _text(tree, *_UNITS) or _text(tree.get('DataInfo'), *_UNITS)
        for key, value in tree.items():
            yield from leaves_in(value, notes, f'{name}.{key}'.lstrip('.'), own if key in _VALUES else '')
    elif isinstance(tree, list):
        for place, value in enumerate(tree[:_MOST]):
            key = _text(value, 'name', 'Name', 'label') or place
            yield from leaves_in({key: value}, notes, name)
    elif hasattr(tree, 'dtype') and hasattr(tree, 'shape'):
        attributes = getattr(tree, 'attrs', {})
        # HDF5 holds the rows of a matrix of MATLAB as columns
        turned = 'MATLAB_class' in attributes and len(tree.shape) == 2
        yield from leaves_of(name, tree, notes, unit or _text(attributes, *_UNITS), turned=turned)


def _text(tree: Any, *keys: str) -> str:
    """Return the first text at one of the keys, '' where there is none."""
    for key in keys if isinstance(tree, Mapping) else ():
        text = tree.get(key)
        text = text.decode(errors='replace') if isinstance(text, bytes) else text
        if isinstance(text, str) and text:
            return str(text)
    return ''


# JSON.


def open_json(path: Path, stated: Stated) -> Content:
    """Return the columns of a JSON file, or of a file with one JSON value in each line.

    Raises `SignalError` with line and column of a fault.
    """
    text = path.read_bytes().decode('utf-8-sig', errors='replace')
    notes: list[str] = []
    try:
        if path.suffix.lower() == '.json':
            tree = _parsed(path, text, 1)
        else:
            lines = enumerate(text.splitlines(), 1)
            tree = [_parsed(path, line, number) for number, line in lines if line.strip()]
        leaves = list(leaves_in(_as_arrays(tree, '', path), notes))
    except RecursionError:
        raise SignalError(f'{path} is nested too deeply to be signals') from None
    return Content(path, 'JSON', 'json', with_dates(path, leaves), notes)


def _parsed(path: Path, text: str, number: int) -> Any:
    try:
        return json.loads(text)
    except json.JSONDecodeError as error:
        found = text[error.pos : error.pos + 20] or 'the end'
        raise SignalError(
            f'{path}, line {number + error.lineno - 1}, column {error.colno}: {error.msg} at {found!r}; '
            'is the file cut off, or another format?'
        ) from None


def _as_arrays(tree: Any, name: str, path: Path) -> Any:
    """Return nested values with arrays in place of lists of numbers, of rows and of records."""
    if isinstance(tree, dict):
        return {key: _as_arrays(value, f'{name}.{key}', path) for key, value in tree.items()}
    known = [one for one in tree if one is not None] if isinstance(tree, list) else []
    if not known:
        return tree
    if all(isinstance(one, dict) for one in known):
        longest = max((len(one) for one in known[0].values() if isinstance(one, list)), default=0)
        if longest > max(_LONGEST_VECTOR, len(known)):  # each a signal, rather than a sample of all signals
            return [_as_arrays(one, f'{name}.{place}', path) for place, one in enumerate(tree)]
        keys = dict.fromkeys(key for one in known for key in one)
        return _as_arrays({key: [one.get(key) if one else None for one in tree] for key in keys}, name, path)
    if any(isinstance(one, list) for one in known):
        width = next(len(one) for one in known if isinstance(one, list))
        for number, row in enumerate(tree):
            if row is not None and (not isinstance(row, list) or len(row) != width):
                count = f'{len(row)} values' if isinstance(row, list) else repr(row)[:40]
                raise SignalError(
                    f'{path}, {name.lstrip(".") or "list"}[{number}] holds {count} where others hold '
                    f'{width}; rows must be equally long'
                )
        return _as_arrays({str(key): [one and one[key] for one in tree] for key in range(width)}, name, path)
    try:
        if all(isinstance(one, int | float) for one in known):
            return np.array([np.nan if one is None else one for one in tree], np.float64)
        return np.array(list(map(date_in, tree)), np.int64).view('datetime64[ns]')
    except (ValueError, TypeError, OverflowError):
        return np.array(list(map(str, tree)))


# MATLAB and HDF5.


def open_matlab(path: Path, stated: Stated) -> Content:
    """Return the columns of a MATLAB file of version 4 to 7."""
    from scipy.io import loadmat

    notes: list[str] = []
    with readable(path, 'MATLAB file', 'is it cut off? Save it again'):
        tree = loadmat(str(path), simplify_cells=True)
        known = {name: value for name, value in tree.items() if not (name[:2] == '__' or _is_opaque(value))}
        known = _plain(known)
    if '__function_workspace__' in tree or any(map(_is_opaque, tree.values())):
        notes.append(_OBJECTS)
    return Content(path, 'MATLAB', 'scipy', list(leaves_in(known, notes)), notes)


def _is_opaque(value: Any) -> bool:
    names = getattr(getattr(value, 'dtype', None), 'names', None) or ()
    return type(value).__name__ == 'MatlabOpaque' or '_ObjectSystem' in str(names) or 's0' in names


def _plain(value: Any) -> Any:
    """Return a cell array as a list, so that its elements are walked, and a sparse matrix in full."""
    if isinstance(value, Mapping):
        return {key: _plain(one) for key, one in value.items()}
    if hasattr(value, 'toarray') and min(value.shape) <= _LONGEST_VECTOR:
        value.check_format()  # of a damaged file SciPy would write beyond the array
        return value.toarray()
    if isinstance(value, list) or (isinstance(value, np.ndarray) and value.dtype == object):
        return [_plain(one) for one in np.ravel(value)[:_MOST]]
    return value


def open_hdf5(path: Path, stated: Stated) -> Content:
    """Return the columns of an HDF5 file, MATLAB 7.3 included; they are read when they are chosen."""
    h5py = required('h5py', 'reading HDF5 and MATLAB 7.3 files')
    notes: list[str] = []
    with readable(path, 'HDF5 file'):
        file = h5py.File(path, 'r')
        leaves = list(leaves_in(_node(file, file, notes, 0), notes))
        matlab = any('MATLAB_class' in one.attrs for one in file.values())
    return Content(path, 'MATLAB 7.3' if matlab else 'HDF5', 'h5py', leaves, notes)


def _node(file: Any, node: Any, notes: list[str], depth: int) -> Any:
    """Return a group as a mapping, a cell array as a list, and any other dataset as it is."""
    if depth > _DEEPEST:
        return None
    if 'MATLAB_sparse' in getattr(node, 'attrs', {}):
        from scipy.sparse import csc_array

        parts = tuple(np.asarray(node[key]) for key in ('data', 'ir', 'jc'))
        return _plain(csc_array(parts, (int(node.attrs['MATLAB_sparse']), parts[2].size - 1)))
    if hasattr(node, 'items'):
        groups = {key: one for key, one in node.items() if not key.startswith('#')}
        return {key: _node(file, one, notes, depth + 1) for key, one in groups.items()}
    if 'MATLAB_empty' in node.attrs or node.shape is None:
        return None
    if 'MATLAB_object_decode' in node.attrs:
        notes.append(_OBJECTS)
        return None
    if node.attrs.get('MATLAB_class') == b'char':
        return ''.join(map(chr, np.asarray(node).reshape(-1)[:_MOST]))
    if node.dtype.kind == 'O' and node.dtype.metadata and 'ref' in node.dtype.metadata:
        return [_node(file, file[one], notes, depth + 1) for one in np.asarray(node).reshape(-1)[:_MOST]]
    return node


# Parquet.


def open_parquet(path: Path, stated: Stated) -> Content:
    """Return the columns of a Parquet file, one within a struct as `struct.field`; dates are times."""
    parquet = required('pyarrow.parquet', 'reading Parquet files')
    with readable(path, 'Parquet file'):
        file = parquet.ParquetFile(path)
        leaves = [_arrow_leaf(file, field) for field in _flat(file.schema_arrow.empty_table()).schema]
    return Content(path, 'Parquet', 'pyarrow', with_dates(path, leaves))


def _arrow_leaf(file: Any, field: Any) -> Leaf:
    path, kind = field.name, str(field.type)
    metadata = {key.decode(errors='replace'): text for key, text in (field.metadata or {}).items()}
    told = _text(metadata, *_UNITS)
    name, unit = (path, told) if told else name_and_unit(path)
    date = kind.startswith('timestamp')

    def read() -> Any:
        column = _flat(file.read(columns=[path])).column(0)
        return column.cast('timestamp[ns]' if date else 'float64', safe=False).to_numpy()

    return Leaf(name, read if kind.startswith(_ARROW_NUMBERS) else None, unit, path, date)


def _flat(table: Any) -> Any:
    """Return a table of Arrow with the fields of structs as columns of their own."""
    while any(str(field.type).startswith('struct') for field in table.schema):
        table = table.flatten()
    return table
