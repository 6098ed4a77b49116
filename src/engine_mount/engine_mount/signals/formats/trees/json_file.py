"""JSON with any keys: arrays, tables and lists of records by their paths; one value a line as well."""

import json
from pathlib import Path
from typing import Any

import numpy as np

from engine_mount.signals.formats.content import Stated
from engine_mount.signals.formats.text.cells import date_in
from engine_mount.signals.formats.trees.layouts import leaves_in
from engine_mount.signals.formats.trees.leaves import Leaves, with_dates
from engine_mount.signals.signal import SignalError

_LONGEST_VECTOR = 64  # numbers of one sample, chosen: a covariance has 36


def open_json(path: Path, stated: Stated) -> Leaves:
    """Return the columns of a JSON file, or of a file with one JSON value in each line.

    Raises `SignalError` with line and column of a fault.
    """
    text = path.read_bytes().decode('utf-8-sig', errors='replace')
    lines = path.suffix.lower() in ('.jsonl', '.ndjson')
    try:
        tree = [_parsed(line, number) for number, line in _lines(text)] if lines else _parsed(text, 1)
    except _NoJsonError as error:
        raise SignalError(f'{path}, {error}; is the file cut off, or another format?') from None
    except RecursionError:
        raise SignalError(f'{path} is nested too deeply to be signals') from None
    notes: list[str] = []
    found = with_dates(list(leaves_in(_arrays(tree, '', path), notes)))
    if not found:
        raise SignalError(
            f'{path} holds no lists of numbers; expected are {{"t": [...], "az": [...]}}, a list of records '
            'or a list of rows'
        )
    return Leaves(path, 'JSON', 'json', found, notes)


class _NoJsonError(ValueError):
    """A text is no JSON; the text says where."""


def _lines(text: str) -> list[tuple[int, str]]:
    return [(number, line) for number, line in enumerate(text.splitlines(), 1) if line.strip()]


def _parsed(text: str, number: int) -> Any:
    try:
        return json.loads(text)
    except json.JSONDecodeError as error:
        found = text[error.pos : error.pos + 20] or 'the end'
        raise _NoJsonError(
            f'line {number + error.lineno - 1}, column {error.colno}: {error.msg} at {found!r}'
        ) from None


def _arrays(tree: Any, name: str, path: Path) -> Any:
    """Return nested values with arrays in place of lists of numbers, of rows and of records."""
    if isinstance(tree, dict):
        return {key: _arrays(value, f'{name}.{key}', path) for key, value in tree.items()}
    if not isinstance(tree, list) or not tree:
        return tree
    records = [one for one in tree if isinstance(one, dict)]
    if records and all(isinstance(one, dict) or one is None for one in tree):
        if _hold_signals(records):
            return [_arrays(one, f'{name}.{place}', path) for place, one in enumerate(tree)]
        keys = dict.fromkeys(key for one in records for key in one)
        columns = {key: [None if one is None else one.get(key) for one in tree] for key in keys}
        return {key: _arrays(column, f'{name}.{key}', path) for key, column in columns.items()}
    rows = [one for one in tree if isinstance(one, list)]
    if rows:
        return _table(tree, name, path)
    return _vector(tree)


def _hold_signals(records: list[dict[str, Any]]) -> bool:
    """Whether each record is a signal with a list of samples, rather than one sample of all signals."""
    longest = max((len(one) for one in records[0].values() if isinstance(one, list)), default=0)
    return longest > max(_LONGEST_VECTOR, len(records))


def _vector(tree: list[Any]) -> Any:
    """Return a list as numbers, NaN where it holds null, as dates, or as texts."""
    known = [one for one in tree if one is not None]
    if all(isinstance(one, int | float) for one in known):
        try:
            return np.array([np.nan if one is None else one for one in tree], np.float64)
        except OverflowError:
            return np.array(list(map(str, tree)))
    if len(known) == len(tree) and all(isinstance(one, str) for one in tree):
        try:
            return np.array(list(map(date_in, tree)), np.int64).view('datetime64[ns]')
        except ValueError:
            return np.array(tree)
    return np.array(list(map(str, tree)))


def _table(tree: list[Any], name: str, path: Path) -> Any:
    """Return a list of rows as columns by their numbers; raises `SignalError` for rows that differ."""
    place, first = next((place, one) for place, one in enumerate(tree) if isinstance(one, list))
    for number, row in enumerate(tree):
        if row is not None and (not isinstance(row, list) or len(row) != len(first)):
            count = f'{len(row)} values' if isinstance(row, list) else repr(row)[:40]
            raise SignalError(
                f'{path}, {name.lstrip(".") or "list"}[{number}] holds {count} where row {place} holds '
                f'{len(first)}; rows must be equally long'
            )
    whole = [[None] * len(first) if row is None else row for row in tree]
    columns = {str(key): [row[key] for row in whole] for key in range(len(first))}
    return {key: _arrays(column, f'{name}.{key}', path) for key, column in columns.items()}
