"""A simulated drive without middleware, recorded in the topics of the graph."""

import time
from collections.abc import Callable, Mapping
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from engine_mount.drives.loop.messages import Columns, CoreMessages
from engine_mount.drives.loop.run import CoreOutcome, run_core_into
from engine_mount.settings.chosen import Parameters
from mount_recorder.bag_writer import BagWriter
from mount_recorder.mcap_writer import LONG_CHUNK_SIZE
from mount_ros.messages.cdr import string_message
from mount_ros.topics import SESSION, TOPICS, Topic
from mount_sim.excitation.excitation import Excitation
from mount_sim.plant.mounts import ALONE


def record_core(
    folder: Path,
    parameters: Parameters,
    session: str | Mapping[str, str],
    progress: Callable[[float], None] = lambda share: None,
    *,
    excitation: Excitation | None = None,
    namespace: str = '',
    split_size: int = 0,
    begin: int | None = None,
) -> CoreOutcome:
    """Run the scenario in `parameters`, write it to the recording `folder`, and return what happened.

    `session` is the text of the session message, of several mounts by their names, which are namespaces
    within `namespace`. `progress` takes the share that is done. `excitation` is that of the scenario where it
    is built already; stamps count from the log time `begin` (ns), by default the present.
    """
    begin = time.time_ns() if begin is None else begin
    writer = BagWriter(folder, split_size=split_size, chunk_size=LONG_CHUNK_SIZE)
    sessions = {ALONE: session} if isinstance(session, str) else session
    sinks, sim = {}, parameters.get('mount_sim', {})
    try:
        writers = {mount: _MountWriter(writer, f'{namespace}/{mount}', begin) for mount in sessions}
        declared: set[str] = set()  # some topics are common to all mounts
        for mount, own in writers.items():
            for topic in TOPICS:
                if own.names[topic.name] not in declared:
                    writer.add_topic(own.names[topic.name], topic.type)
            declared |= set(own.names.values())
            own.write(SESSION, string_message(sessions[mount]), 0)
            sinks[mount] = CoreMessages(sim, own.write, own.write_columns, mount)
        return run_core_into(sinks, parameters, progress, excitation)
    finally:
        writer.close()


class _MountWriter:
    """Writes the topics of one mount below its namespace; stamps count from the log time `begin` (ns)."""

    def __init__(self, writer: BagWriter, namespace: str, begin: int):
        prefix = f'/{namespace.strip("/")}/'.replace('//', '/')
        self.names = {
            topic.name: topic.name if topic.name.startswith('/') else prefix + topic.name for topic in TOPICS
        }
        self._writer, self._begin = writer, begin

    def write(self, topic: Topic, raw: bytes, stamp: int) -> None:
        """Write one message."""
        self._writer.write(self.names[topic.name], raw, self._begin + stamp)

    def write_columns(self, columns: Columns, stamps: NDArray[np.int64]) -> None:
        """Write the messages of many samples."""
        names = [self.names[topic.name] for topic, _ in columns]
        self._writer.write_columns(names, [rows for _, rows in columns], self._begin + stamps)
