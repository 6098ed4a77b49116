"""Nested values as columns: mappings by their keys, and layouts of tools that say which times belong to what.

Three such layouts are known, each with times in s by its tool's own definition: a timeseries (`Time` beside
`Data`), Simulink's structure with time (`time` beside `signals.values`), and dSPACE's `X` beside `Y`.
"""

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from engine_mount.signals.formats.trees.leaves import Leaf, leaves_of

_DEEPEST = 32  # levels, chosen
_TIMES = ('Time', 'time')
_VALUES = ('Data', 'data', 'values', 'Values')
_UNITS = ('Units', 'units', 'Unit', 'unit')


def leaves_in(tree: Any, notes: list[str], name: str = '', depth: int = 0) -> Iterator[Leaf]:
    """Yield the columns of nested mappings, lists of mappings, and arrays."""
    if depth > _DEEPEST:
        notes.append(f'{name}: deeper than {_DEEPEST} levels, left out')
    elif isinstance(tree, Mapping):
        known = _timeseries(tree, notes, name) or _structure(tree, notes, name) or _dspace(tree, notes, name)
        if known:
            yield from known
            return
        unit = next(filter(None, (text_at(tree, key) for key in _UNITS)), '')
        for key, value in tree.items():
            for leaf in leaves_in(value, notes, f'{name}.{key}'.lstrip('.'), depth + 1):
                yield replace(leaf, unit=unit) if key in _VALUES and not leaf.unit else leaf
    elif isinstance(tree, list):
        for place, value in enumerate(tree):
            title = text_at(value, 'name') or str(place)
            yield from leaves_in(value, notes, f'{name}.{title}'.lstrip('.'), depth + 1)
    elif hasattr(tree, 'dtype') and hasattr(tree, 'shape'):
        yield from leaves_of(name, tree, notes, _unit_of(tree))


def text_at(tree: Any, *path: str) -> str:
    """Return the text at a path of keys, '' where there is none."""
    for key in path:
        tree = tree.get(key) if isinstance(tree, Mapping) else None
    if isinstance(tree, bytes):
        return tree.decode(errors='replace')
    return tree if isinstance(tree, str) else ''


def _timeseries(tree: Mapping[str, Any], notes: list[str], name: str) -> list[Leaf]:
    """Return the values of a timeseries; times in another unit than s stay a column."""
    time = next((tree[key] for key in _TIMES if key in tree), None)
    values = next((tree[key] for key in _VALUES if key in tree), None)
    if not (_is_vector(time) and hasattr(values, 'shape') and _fits(values, time)):
        return []
    seconds = text_at(tree, 'TimeInfo', 'Units') in ('', 's', 'sec', 'seconds')
    if not seconds:
        return []
    unit = text_at(tree, 'DataInfo', 'Units') or next(
        filter(None, (text_at(tree, key) for key in _UNITS)), ''
    )
    return _timed(leaves_of(name, values, notes, unit), time, f'times of the timeseries {name!r}')


def _structure(tree: Mapping[str, Any], notes: list[str], name: str) -> list[Leaf]:
    """Return the signals of Simulink's structure with time."""
    time, signals = tree.get('time'), tree.get('signals')
    parts = signals if isinstance(signals, list) else [signals]
    if not _is_vector(time) or not all(isinstance(part, Mapping) and 'values' in part for part in parts):
        return []
    found = []
    for place, part in enumerate(parts):
        title = text_at(part, 'label') or str(place)
        found += leaves_of(f'{name}.{title}'.lstrip('.'), part['values'], notes)
    return _timed(found, time, f'time of the structure {name!r}')


def _dspace(tree: Mapping[str, Any], notes: list[str], name: str) -> list[Leaf]:
    """Return the traces of a recording of dSPACE: each of `Y` on one of the axes `X`."""
    axes, traces = (_as_list(tree.get(key)) for key in ('X', 'Y'))
    if not axes or not traces or not all(_has_data(part) for part in (*axes, *traces)):
        return []
    times: dict[int, Leaf] = {}
    found = []
    for place, trace in enumerate(traces):
        number = trace.get('XIndex', 1)
        axis = int(np.asarray(number).reshape(-1)[0]) - 1 if np.size(number) else 0
        if not 0 <= axis < len(axes) or not _fits(trace['Data'], axes[axis]['Data']):
            notes.append(f'{name}.Y[{place}]: has no axis of its length, left out')
            continue
        time = times.setdefault(axis, Leaf('X', axes[axis]['Data'], axis=_long(axes[axis]['Data'])))
        title, unit = text_at(trace, 'Name') or str(place), text_at(trace, 'Unit')
        leaves = leaves_of(title.strip('"'), trace['Data'], notes, unit)
        found += [replace(leaf, time=time, told='times of the recording of dSPACE') for leaf in leaves]
    return found


def _timed(leaves: list[Leaf], time: Any, told: str) -> list[Leaf]:
    axis = Leaf('time', time, axis=_long(time))
    return [replace(leaf, time=axis, told=told) if leaf.count == axis.count else leaf for leaf in leaves]


def _long(array: Any) -> int:
    return int(np.argmax(array.shape)) if array.shape else 0


def _is_vector(array: Any) -> bool:
    shape = getattr(array, 'shape', ())
    return sum(side > 1 for side in shape) == 1 and array.dtype.kind in 'fiu'


def _fits(values: Any, time: Any) -> bool:
    return math.prod(time.shape) in getattr(values, 'shape', ())


def _has_data(part: Any) -> bool:
    return isinstance(part, Mapping) and hasattr(part.get('Data'), 'shape')


def _as_list(value: Any) -> Sequence[Any]:
    return value if isinstance(value, list) else [value] if value is not None else []


def _unit_of(array: Any) -> str:
    """Return the unit that the attributes of an HDF5 dataset tell."""
    attributes = getattr(array, 'attrs', {})
    found = next((attributes[key] for key in _UNITS if key in attributes), '')
    return found.decode(errors='replace') if isinstance(found, bytes) else str(found)
