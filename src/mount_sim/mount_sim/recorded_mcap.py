"""One numeric field of a topic in an MCAP recording as times and values."""

import operator
from pathlib import Path

import numpy as np
from mcap.reader import make_reader
from numpy.typing import NDArray

from mount_ros.message_types import decoded


class NoSuchSignalError(ValueError):
    """The recording has no such topic or field; the text says what it has."""


def read_field(file: Path, topic: str, field: str) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return (times s, values) of `field`, by header stamps where the type has them, else by receive time."""
    files = sorted(file.glob('*.mcap')) if file.is_dir() else [file]
    times, values = [], []
    for part in files:
        with part.open('rb') as stream:
            for schema, _, record in make_reader(stream).iter_messages(topics=[topic]):
                assert schema is not None
                message = decoded(record.data, schema.name)
                values.append(_number(message, field, schema.name, topic))
                header = getattr(message, 'header', None)
                stamp = header.stamp.sec + 1e-9 * header.stamp.nanosec if header else 1e-9 * record.log_time
                times.append(stamp)
    if not values:
        raise NoSuchSignalError(
            f'{file} holds no message on {topic!r}; is the name complete, with its slash?'
        )
    return np.array(times), np.array(values)


def _number(message: object, field: str, type_name: str, topic: str) -> float:
    try:
        return float(operator.attrgetter(field)(message))
    except (AttributeError, TypeError, ValueError):
        known = ', '.join(message.get_fields_and_field_types())  # type: ignore[attr-defined]
        raise NoSuchSignalError(
            f'{field!r} is no number in {type_name} on {topic}; its fields are {known}'
        ) from None
