"""One numeric field of a topic in an MCAP recording as times and values."""

import operator
import re
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
from mcap.exceptions import McapError
from mcap.reader import make_reader
from numpy.typing import NDArray

from mount_ros.message_types import decoded


class NoSuchSignalError(ValueError):
    """The recording has no such topic or field; the text says what it has."""


def read_field(file: Path, topic: str, field: str) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return (times s, values) of `field`, by header stamps where the type has them, else by receive time."""
    files = sorted(file.glob('*.mcap'), key=_part_number) if file.is_dir() else [file]
    times, values = [], []
    for part in files:
        for message, type_name, received in _messages(part, topic):
            values.append(_number(message, field, type_name, topic))
            header = getattr(message, 'header', None)
            times.append(header.stamp.sec + 1e-9 * header.stamp.nanosec if header else 1e-9 * received)
    if not values:
        raise NoSuchSignalError(
            f'{file} holds no message on {topic!r}; is the name complete, with its slash?'
        )
    return np.array(times), np.array(values)


def _messages(part: Path, topic: str) -> Iterator[tuple[Any, str, int]]:
    """Give (message, type name, receive time ns) of each message on `topic`."""
    try:
        with part.open('rb') as stream:
            for schema, _, record in make_reader(stream).iter_messages(topics=[topic]):
                assert schema is not None
                yield decoded(record.data, schema.name), schema.name, record.log_time
    except McapError as error:
        raise NoSuchSignalError(f'{part} is damaged or no MCAP recording: {error}') from None


def _part_number(part: Path) -> tuple[int, str]:
    """Sort the parts of a split recording by number: rosbag2 writes x_2.mcap before x_10.mcap."""
    digits = re.search(r'(\d+)$', part.stem)
    return (int(digits[1]) if digits else -1), part.name


def _number(message: object, field: str, type_name: str, topic: str) -> float:
    try:
        return float(operator.attrgetter(field)(message))
    except (AttributeError, TypeError, ValueError):
        known = ', '.join(message.get_fields_and_field_types())  # type: ignore[attr-defined]
        raise NoSuchSignalError(
            f'{field!r} is no number in {type_name} on {topic}; its fields are {known}'
        ) from None
