"""Text tables and JSON."""

import csv
import json
from pathlib import Path

import numpy as np

from engine_mount.signals.formats.content import Stated
from engine_mount.signals.formats.measured import FloatArray
from engine_mount.signals.testing.made import Columns, Made


def make_csv(folder: Path, name: str, times: FloatArray, columns: Columns) -> Made:
    """Write a CSV file with units in brackets."""
    return _table(folder / f'{name}.csv', times, columns, ',', '.')


def make_german_csv(folder: Path, name: str, times: FloatArray, columns: Columns) -> Made:
    """Write a table with semicolons, decimal commas, and lines before the titles."""
    return _table(folder / f'{name}.csv', times, columns, ';', ',', ('Messung;12', 'Bediener;Meier', ''))


def make_text(folder: Path, name: str, times: FloatArray, columns: Columns) -> Made:
    """Write blanks between the cells, by numpy, without titles or times."""
    path = folder / f'{name}.txt'
    np.savetxt(path, np.column_stack([values for _, values in columns.values()]), fmt='%25.17g')
    return _untitled(path, times, columns)


def make_json(folder: Path, name: str, times: FloatArray, columns: Columns) -> Made:
    """Write a JSON file of nested lists."""
    path = folder / f'{name}.json'
    data = {key: {'unit': unit, 'values': values.tolist()} for key, (unit, values) in columns.items()}
    path.write_text(json.dumps({'meta': {'car': 'x'}, 'signals': {'t': times.tolist(), **data}}))
    return Made(path, {key: f'{key}.values' for key in columns}, 't')


def _table(
    path: Path,
    times: FloatArray,
    columns: Columns,
    delimiter: str,
    decimal: str,
    before: tuple[str, ...] = (),
) -> Made:
    with path.open('w', newline='', encoding='utf-8') as stream:
        stream.writelines(f'{line}\r\n' for line in before)
        writer = csv.writer(stream, delimiter=delimiter)
        writer.writerow(['t [s]', *(f'{key} [{unit}]' for key, (unit, _) in columns.items())])
        for row in np.column_stack([times, *(values for _, values in columns.values())]).tolist():
            writer.writerow([repr(value).replace('.', decimal) for value in row])
    return Made(path, {key: key for key in columns}, 't')


def _untitled(path: Path, times: FloatArray, columns: Columns) -> Made:
    rate = round((len(times) - 1) / float(times[-1] - times[0]), 6)
    names = {key: str(place) for place, key in enumerate(columns)}
    return Made(path, names, stated=Stated(rate=rate), units=False)
