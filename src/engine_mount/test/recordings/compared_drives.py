"""Small drives with known answers, for comparing, cutting and merging."""

from pathlib import Path

import numpy as np
from samples import PERIOD, START, joint_state

import engine_mount
from engine_mount.recordings.recording import Recording
from mount_recorder.bag_writer import BagWriter
from mount_ros.messages.cdr import string_message
from mount_ros.topics import AIR_GAP, CONTROL_TRACE, CURRENT_SETPOINT, DISPLACEMENT, EVENT, SESSION

_DELAY = 200_000  # ns from stamp to reception
_TIME = {'sec': 9223372036, 'nsec': 854775807}
LATCHED = {
    **{'history': 'unknown', 'depth': 0, 'reliability': 'reliable', 'durability': 'transient_local'},
    **{'deadline': _TIME, 'lifespan': _TIME, 'liveliness': 'automatic', 'liveliness_lease_duration': _TIME},
    'avoid_ros_namespace_conventions': False,
}


def bag_of(folder: Path, topic: str, type_name: str, messages) -> Recording:
    """Write a recording of one topic with a message each ms, and open it."""
    writer = BagWriter(folder)
    writer.add_topic(topic, type_name)
    for index, raw in enumerate(messages):
        writer.write(topic, raw, START + index * PERIOD)
    writer.close()
    return engine_mount.open(folder)


def messages_of(recording: Recording) -> dict[str, list[tuple[bytes, int, int]]]:
    """Return bytes, receive time and publish time (ns) of the messages of each topic."""
    return {
        name: list(
            zip(
                map(bytes, series.payloads),
                series.receive_times.tolist(),
                series.publish_times.tolist(),
                strict=True,
            )
        )
        for name in recording
        for series in [recording[name]]
    }


def answers(count: int, *, on: int = 100, off: int = 300, phase: float = 0.0) -> dict[str, np.ndarray]:
    """Return the signals of a drive of `count` ms: 8 Hz, damping from sample `on` to `off`; `phase` in s."""
    time = np.arange(count) * 1e-3
    displacement = 1e-3 * np.sin(2 * np.pi * 8.0 * (time - phase))
    active = ((np.arange(count) >= on) & (np.arange(count) < off)).astype(float)
    return {
        'displacement': displacement,
        'damping_active': active,
        'current': active * (0.5 + 400.0 * np.abs(displacement)),
        'friction_coefficient': np.where(active > 0.0, 0.3, np.nan),
    }


def write_answers(folder: Path, signals: dict[str, np.ndarray], **options) -> Path:
    """Write a recording of one drive."""
    writer = BagWriter(folder)
    add_answers(writer, signals, **options)
    writer.close()
    return folder


def add_answers(
    writer: BagWriter,
    signals: dict[str, np.ndarray],
    *,
    start: int = START,
    period: float = PERIOD,
    session: str = 'scenario: bench\n',
    marks: tuple[tuple[int, str], ...] = (),
    missing: range = range(0),
    namespace: str = '',
) -> None:
    """Add a drive; `marks` are (sample, text), samples in `missing` are left out."""
    latched = (SESSION, AIR_GAP)
    for topic in (*latched, EVENT, DISPLACEMENT, CURRENT_SETPOINT, CONTROL_TRACE):
        writer.add_topic(
            f'{namespace}/{topic.name}', topic.type, lambda topic=topic: [LATCHED] * (topic in latched)
        )
    writer.write(f'{namespace}/{SESSION.name}', string_message(session), start)
    gap = joint_state(start, list(AIR_GAP.names), np.full(len(AIR_GAP.names), 4e-4), np.empty(0))
    writer.write(f'{namespace}/{AIR_GAP.name}', gap, start + 1, start)
    marked = dict(marks)
    for index in range(len(signals['displacement'])):
        stamp = start + round(index * period)
        for topic in (DISPLACEMENT, CURRENT_SETPOINT, CONTROL_TRACE):
            if index not in missing:
                raw = joint_state(stamp, list(topic.names), _row(topic, signals, index), np.empty(0))
                writer.write(f'{namespace}/{topic.name}', raw, stamp + _DELAY, stamp + _DELAY // 2)
        if index in marked:
            writer.write(f'{namespace}/{EVENT.name}', string_message(marked[index]), stamp + _DELAY)


def _row(topic, signals: dict[str, np.ndarray], index: int) -> np.ndarray:
    if topic is DISPLACEMENT:
        return signals['displacement'][index : index + 1]
    if topic is CURRENT_SETPOINT:
        return signals['current'][index : index + 1]
    return np.array([signals[name][index] if name in signals else 0.0 for name in topic.names])
