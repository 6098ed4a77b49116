"""The traces that are shown, and how many samples become one interval of the picture."""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from engine_mount.recordings.mcap_records import HEAD
from engine_mount.recordings.series import Payloads, Series, SeriesError
from engine_mount.view.feed.feed import Message
from mount_ros.topics import COIL_RIPPLE, CONTROL_TRACE, CURRENT_SETPOINT, DISPLACEMENT, Topic

INTERVALS_PER_SECOND = 30

Extent = tuple[float, float]
"""The least and the highest value within an interval; NaN where there is none."""
NOTHING: Extent = (float('nan'), float('nan'))


@dataclass(frozen=True)
class Trace:
    """One line of a panel: `factor` turns the SI value of a column into `unit`."""

    key: str
    label: str
    panel: str
    unit: str
    topic: Topic
    column: str
    factor: float = 1.0


TRACES: tuple[Trace, ...] = (
    Trace('displacement', 'this mount', 'displacement', 'mm', DISPLACEMENT, 'mount', 1e3),
    Trace('damping', 'damping', 'damping', '1', CONTROL_TRACE, 'damping_active'),
    Trace('setpoint', 'setpoint', 'current', 'A', CURRENT_SETPOINT, 'coil_current'),
    Trace('current', 'measured', 'current', 'A', COIL_RIPPLE, 'coil_current'),
    Trace('desired_force', 'wanted', 'friction force', 'N', CONTROL_TRACE, 'desired_force'),
)
LATENCY = Trace('latency', 'sample to setpoint', 'latency', 'ms', CURRENT_SETPOINT, '', 1e3)


def columns_of(messages: Iterable[Message]) -> dict[Topic, Series]:
    """Return the messages of an interval by topic, in the order of arrival."""
    by_topic: dict[Topic, list[Message]] = {}
    for message in messages:
        by_topic.setdefault(message.topic, []).append(message)
    return {topic: _series(topic, found) for topic, found in by_topic.items()}


def extents(columns: Mapping[Topic, Series]) -> dict[str, Extent]:
    """Return {key: extent in the trace's unit} of one interval, with the latency."""
    found = {trace.key: extent(_column(columns, trace) * trace.factor) for trace in TRACES}
    return {**found, LATENCY.key: extent(_latencies(columns) * LATENCY.factor)}


def extent(values: NDArray[np.float64]) -> Extent:
    """Return the least and the highest of some values that are numbers."""
    known = values[np.isfinite(values)]
    return (float(known.min()), float(known.max())) if known.size else NOTHING


def _series(topic: Topic, messages: list[Message]) -> Series:
    sizes = {len(message.raw) for message in messages}
    raw = [message.raw for message in messages]
    piece: NDArray[np.uint8] | list[bytes] = raw
    if len(sizes) == 1:
        piece = np.frombuffer(b''.join(raw), np.uint8).reshape(len(raw), -1)
    heads = np.zeros(len(messages), HEAD)
    heads['log_time'] = [message.received for message in messages]
    heads['publish_time'] = [message.sent for message in messages]
    return Series(topic.name, topic.type, (Payloads([piece]), heads))


def _column(columns: Mapping[Topic, Series], trace: Trace) -> NDArray[np.float64]:
    return column(columns, trace.topic, trace.column)


def column(columns: Mapping[Topic, Series], topic: Topic, name: str) -> NDArray[np.float64]:
    """Return a column in SI, empty where the topic has no message or its messages lack it."""
    series = columns.get(topic)
    try:
        return np.empty(0) if series is None else np.asarray(series[name], float)
    except (SeriesError, ValueError):
        return np.empty(0)


def _latencies(columns: Mapping[Topic, Series]) -> NDArray[np.float64]:
    """Return the times (s) from when a sample was published to when its answer was."""
    samples, answers = columns.get(DISPLACEMENT), columns.get(CURRENT_SETPOINT)
    if samples is None or answers is None:
        return np.empty(0)
    try:
        _, first, second = np.intersect1d(samples.stamps, answers.stamps, return_indices=True)
    except (SeriesError, ValueError):
        return np.empty(0)
    return np.asarray((answers.publish_times[second] - samples.publish_times[first]) * 1e-9)
