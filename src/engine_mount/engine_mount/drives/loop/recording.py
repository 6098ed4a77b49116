"""A simulated drive without middleware, recorded in the topics of the graph."""

import time
from collections.abc import Callable, Mapping
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from engine_mount.drives.loop.car import run_car_into
from engine_mount.drives.loop.messages import Columns, CoreMessages
from engine_mount.drives.loop.run import CoreOutcome, coil_temperature, run_core
from engine_mount.settings.chosen import Parameters
from mount_recorder.bag_writer import WHOLE, BagWriter, SplitRule
from mount_recorder.mcap_writer import LONG_CHUNK_SIZE
from mount_recorder.session import session_message
from mount_ros.topics import SESSION, TOPICS, Delivery, Topic
from mount_sim.excitation.excitation import Excitation
from mount_sim.plant.simulated_car import mount_parameters


def record_core(
    folder: Path,
    parameters: Parameters,
    session: str,
    progress: Callable[[float], None] = lambda share: None,
    *,
    excitation: Excitation | None = None,
    namespace: str = '',
    split: SplitRule = WHOLE,
    begin: int | None = None,
) -> CoreOutcome:
    """Run the scenario in `parameters`, write it to the recording `folder`, and return what happened.

    `session` is the text of the session message; `progress` takes the share that is done. `excitation`
    is that of the scenario where it is built already.
    """
    writer = BagWriter(folder, split=split, chunk_size=LONG_CHUNK_SIZE)
    begin = time.time_ns() if begin is None else begin
    mount = _MountWriter(writer, namespace, begin, set())
    try:
        mount.begin(session)
        return run_core(parameters, mount.write, progress, mount.write_columns, excitation)
    finally:
        writer.close()


def record_car(
    folder: Path,
    parameters: Parameters,
    sessions: Mapping[str, str],
    progress: Callable[[float], None] = lambda share: None,
    *,
    excitation: Excitation | None = None,
    namespace: str = '',
    split: SplitRule = WHOLE,
    begin: int | None = None,
) -> CoreOutcome:
    """Run and record the scenario of a car with several mounts, as `record_core` does for one.

    `sessions` are the texts of the session messages by the names of the mounts, which are namespaces within
    `namespace`.
    """
    writer = BagWriter(folder, split=split, chunk_size=LONG_CHUNK_SIZE)
    begin = time.time_ns() if begin is None else begin
    declared: set[str] = set()
    mounts = {name: _MountWriter(writer, f'{namespace}/{name}', begin, declared) for name in sessions}
    sinks: dict[str, CoreMessages] = {}
    for name, mount in mounts.items():
        celsius = coil_temperature(mount_parameters(parameters['mount_sim'], name))
        sinks[name] = CoreMessages(mount.write, celsius, mount.write_columns)
    try:
        for name, mount in mounts.items():
            mount.begin(sessions[name])
        return run_car_into(sinks, parameters, progress, excitation)
    finally:
        writer.close()


class _MountWriter:
    """Writes the topics of one mount below its namespace; stamps count from the log time `begin` (ns).

    `declared`: full names of topics that the writer knows already, for some are common to all mounts.
    """

    def __init__(self, writer: BagWriter, namespace: str, begin: int, declared: set[str]):
        prefix = f'/{namespace.strip("/")}/'.replace('//', '/')
        self._names = {topic.name: _full_name(topic, prefix) for topic in TOPICS}
        self._writer = writer
        self._begin = begin
        self._declared = declared

    def begin(self, session: str) -> None:
        """Name all topics and write the text of the session."""
        for topic in TOPICS:
            name, latched = self._names[topic.name], topic.delivery is Delivery.LATCHED
            if name not in self._declared:
                self._writer.add_topic(name, topic.type, latched=latched)
        self._declared |= set(self._names.values())
        self._writer.write(self._names[SESSION.name], session_message(session), self._begin)

    def write(self, topic: Topic, raw: bytes, stamp: int) -> None:
        """Write one message."""
        self._writer.write(self._names[topic.name], raw, self._begin + stamp)

    def write_columns(self, columns: Columns, stamps: NDArray[np.int64]) -> None:
        """Write the messages of many samples."""
        names = [self._names[topic.name] for topic, _ in columns]
        self._writer.write_columns(names, [rows for _, rows in columns], self._begin + stamps)


def _full_name(topic: Topic, prefix: str) -> str:
    return topic.name if topic.name.startswith('/') else prefix + topic.name
