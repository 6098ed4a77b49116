"""Writes a replay, its inputs and its answers, as a recording that can be replayed again."""

from collections.abc import Iterable
from pathlib import Path
from typing import Any

import numpy as np

from engine_mount.drives.core import OFF, ControlAnswers, Replayed
from engine_mount.drives.inputs.input import ReplayInput
from mount_recorder.bag_writer import BagWriter
from mount_recorder.mcap_writer import LONG_CHUNK_SIZE
from mount_recorder.session import session_text
from mount_ros import topics
from mount_ros.messages.cdr import string_message
from mount_ros.messages.scalars import ScalarsLayout
from mount_ros.topics import Topic

_INPUTS = (topics.DISPLACEMENT, topics.COIL_RIPPLE, topics.COIL_TEMPERATURE)
_GAPS = (topics.AIR_GAP, topics.CURRENT_FORCE_TABLE)
_WRITTEN = (*_INPUTS, topics.CURRENT_SETPOINT, *_GAPS, topics.CONTROL_TRACE, topics.SESSION)


def write_replay(folder: Path, given: ReplayInput, replayed: Replayed, session: dict[str, Any]) -> None:
    """Write the recording; the same replay gives the same messages at the same log times every time."""
    entries: list[tuple[int, int, Topic, bytes]] = []  # log time ns, place among equals, topic, message

    def add(place: int, topic: Topic, times: Iterable[int], messages: Iterable[bytes]) -> None:
        entries.extend((time, place, topic, raw) for time, raw in zip(times, messages, strict=True))

    for topic in _INPUTS if replayed.ramps else _INPUTS[:1]:
        if recorded := given.messages.get(topic.name):
            times = recorded.receive_times.tolist()
            add(0, topic, times, (recorded.payloads[place] for place in range(len(times))))
    gaps = {gap.stamp: gap for gap in [*replayed.gaps, *(ramp.gap for ramp in replayed.ramps)]}
    first = int(given.parts[0].stamps[0]) + given.log_shift
    for stamp, gap in gaps.items():
        # One that is older than what is recorded stands at the head, where readers look for it.
        time = max(stamp + given.log_shift, first - 1)
        for place, (topic, raw) in enumerate(zip(_GAPS, gap.messages(), strict=True), 2):
            add(place, topic, [time], [raw])
    setpoint = ScalarsLayout(topics.CURRENT_SETPOINT)
    for part in replayed.parts:
        rows = setpoint.pack_rows(part.stamps, part.setpoints[:, None])
        logged = part.stamps + given.log_shift
        add(1, topics.CURRENT_SETPOINT, logged.tolist(), (row.tobytes() for row in rows))
        if not isinstance(part, ControlAnswers):
            continue
        layout = ScalarsLayout(topics.control_trace(part.traces.dtype.names or ()))
        traces = np.ascontiguousarray(part.traces[part.traced]).view(np.float64)
        rows = layout.pack_rows(part.stamps[part.traced], traces.reshape(-1, len(layout.names)))
        add(4, topics.CONTROL_TRACE, logged[part.traced].tolist(), (row.tobytes() for row in rows))
        if part.setpoints[-1] != OFF:  # as mount_control does when it is deactivated
            off = setpoint.pack(int(part.stamps[-1]), (OFF,))
            add(5, topics.CURRENT_SETPOINT, [int(logged[-1])], [off])
    entries.sort(key=lambda entry: entry[:2])
    prefix = given.messages[topics.DISPLACEMENT.name].topic.removesuffix(topics.DISPLACEMENT.name)
    writer = BagWriter(folder, chunk_size=LONG_CHUNK_SIZE)
    try:
        for topic in _WRITTEN:
            writer.add_topic(prefix + topic.name, topic.type)
        writer.write(prefix + topics.SESSION.name, string_message(session_text(session)), entries[0][0])
        for time, _, topic, raw in entries:
            writer.write(prefix + topic.name, raw, time)
    finally:
        writer.close()
