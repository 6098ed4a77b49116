"""Parameter sets as records in plain bytes: the same names in compiled code, handed over as one pointer.

A named tuple is taken apart number by number at each call of a compiled function; for a law with fifty
parameters that costs more than the law. Bytes cost nothing: compiled code looks at them through
``parameters.view(DTYPE)[0]`` and then reads `record.field` as it would read the tuple's. So does code that
is not compiled, because the elements of such a type are `np.record`.
"""

import functools
from collections.abc import Sequence
from typing import Any, NamedTuple, get_type_hints

import numpy as np

from mount_models.arrays import ByteArray

Field = tuple[str, Any]  # name, and type as numpy takes it


def record_type(fields: Sequence[Field]) -> np.dtype:
    """Return the type of a record of these fields, which are its attributes, compiled or not."""
    return np.dtype((np.record, list(fields)))


def number_record(*names: str) -> np.dtype:
    """Return the type of a record of float64 numbers."""
    return record_type([(name, 'f8') for name in names])


@functools.cache
def record_dtype(kind: type[NamedTuple]) -> np.dtype:
    """Return the record type of a named tuple of numbers, or of such tuples, from its annotations."""
    return record_type([(name, _field_type(hint)) for name, hint in get_type_hints(kind).items()])


def record_bytes(parameters: NamedTuple) -> ByteArray:
    """Return the record of `parameters` as bytes, to be viewed as `record_dtype(type(parameters))`."""
    record = np.zeros(1, record_dtype(type(parameters)))
    _fill(record[0], parameters)
    return record.view(np.uint8)


def _field_type(hint: Any) -> Any:
    if hint is float:
        return 'f8'
    if hint in (int, bool):
        return 'i8'
    return record_dtype(hint)


def _fill(record: Any, parameters: NamedTuple) -> None:
    for name, value in parameters._asdict().items():
        if hasattr(value, '_asdict'):
            _fill(record[name], value)
        else:
            record[name] = value
