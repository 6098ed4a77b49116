"""Writes what a replay was made of and what came of it as a recording that can be replayed again."""

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np

from engine_mount.drives.core import OFF, ControlAnswers, Replayed
from engine_mount.drives.inputs.input import ReplayInput
from mount_recorder.bag_writer import BagWriter
from mount_recorder.mcap_writer import LONG_CHUNK_SIZE
from mount_recorder.session import session_message, session_text
from mount_ros import topics
from mount_ros.messages.scalars import ScalarsLayout
from mount_ros.topics import Topic

_GAPS = (topics.AIR_GAP, topics.CURRENT_FORCE_TABLE)
_WRITTEN = (
    topics.DISPLACEMENT,
    topics.COIL_RIPPLE,
    topics.COIL_TEMPERATURE,
    topics.CURRENT_SETPOINT,
    *_GAPS,
    topics.CONTROL_TRACE,
    topics.SESSION,
)

_Entry = tuple[int, int, Topic, bytes]  # log time ns, place among equals, topic, message


def write_replay(folder: Path, given: ReplayInput, replayed: Replayed, session: dict[str, Any]) -> None:
    """Write the recording; the same replay gives the same messages at the same log times every time."""
    writer = BagWriter(folder, chunk_size=LONG_CHUNK_SIZE)
    prefix = given.messages[topics.DISPLACEMENT.name].name.removesuffix(topics.DISPLACEMENT.name)
    for topic in _WRITTEN:
        writer.add_topic(prefix + topic.name, topic.type)
    entries = [*_inputs(given, replayed), *_answers(given, replayed)]
    entries.sort(key=lambda entry: entry[:2])
    begin = entries[0][0]
    try:
        writer.write(prefix + topics.SESSION.name, session_message(session_text(session)), begin)
        for time, _, topic, raw in entries:
            writer.write(prefix + topic.name, raw, time)
    finally:
        writer.close()


def _inputs(given: ReplayInput, replayed: Replayed) -> Iterator[_Entry]:
    remade = bool(replayed.ramps)
    for topic in (topics.DISPLACEMENT, topics.COIL_RIPPLE, topics.COIL_TEMPERATURE):
        recorded = given.messages.get(topic.name)
        if recorded is None or (topic is not topics.DISPLACEMENT and not remade):
            continue
        for place, time in enumerate(recorded.log_times.tolist()):
            yield time, 0, topic, recorded.payloads[place]
    yield from _gaps(given, replayed)


def _gaps(given: ReplayInput, replayed: Replayed) -> Iterator[_Entry]:
    """Give the two messages of each initialisation: as replayed, else as recorded."""
    gaps = {gap.stamp: gap for gap in [*replayed.gaps, *(ramp.gap for ramp in replayed.ramps)]}
    first = int(given.parts[0].stamps[0]) + given.log_shift
    for stamp, gap in gaps.items():
        # One that is older than what is recorded stands at the head, where readers look for it.
        time = max(stamp + given.log_shift, first - 1)
        for place, (topic, raw) in enumerate(zip(_GAPS, gap.messages(), strict=True), 2):
            yield time, place, topic, raw


def _answers(given: ReplayInput, replayed: Replayed) -> Iterator[_Entry]:
    setpoint = ScalarsLayout(topics.CURRENT_SETPOINT)
    for part in replayed.parts:
        rows = setpoint.pack_rows(part.stamps, part.setpoints[:, None])
        for stamp, row in zip(part.stamps.tolist(), rows, strict=True):
            yield stamp + given.log_shift, 1, topics.CURRENT_SETPOINT, row.tobytes()
        if isinstance(part, ControlAnswers):
            yield from _traces(given, part)
            if part.setpoints[-1] != OFF:  # as mount_control does when it is deactivated
                stamp = int(part.stamps[-1])
                yield stamp + given.log_shift, 5, topics.CURRENT_SETPOINT, setpoint.pack(stamp, (OFF,))


def _traces(given: ReplayInput, run: ControlAnswers) -> Iterator[_Entry]:
    layout = ScalarsLayout(topics.control_trace(run.traces.dtype.names or ()))
    stamps, traces = run.stamps[run.traced], np.ascontiguousarray(run.traces[run.traced])
    rows = layout.pack_rows(stamps, traces.view(np.float64).reshape(len(traces), len(layout.names)))
    for stamp, row in zip(stamps.tolist(), rows, strict=True):
        yield stamp + given.log_shift, 4, topics.CONTROL_TRACE, row.tobytes()
