"""One file of a recording, from its creation to its summary."""

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path

import yaml

from mount_recorder.chunk_groups import chunk_group
from mount_recorder.mcap_writer import ChunkedMcap
from mount_recorder.metadata import NO_TIME, FileInformation
from mount_recorder.offered_qos import OfferedQos, qos_text
from mount_recorder.record_file import RecordFile
from mount_recorder.schemas import schema_text
from mount_recorder.told_units import units_text

PROFILE = 'ros2'
LIBRARY = 'engine-mount mount_recorder 0.1.0'
SCHEMA_ENCODING = 'ros2msg'
MESSAGE_ENCODING = 'cdr'
PIECE_RECORD = 'engine_mount_piece'
"""Name of the writer's note in every file but the first: which latched topics it repeats there."""

Offers = Callable[[], Sequence[OfferedQos]]


@dataclass
class BagTopic:
    """A topic of a recording."""

    name: str
    type: str
    offers: Offers
    schema: int  # the same in all pieces
    type_hash: str
    latched: bool
    channel: int = 0  # the same in all pieces; 0 until the first message: only then is its publisher known
    offered_qos: tuple[OfferedQos, ...] = ()
    units: Mapping[str, str] = field(default_factory=dict)  # by field


@dataclass(frozen=True)
class Repetition:
    """The last message of a latched topic, to stand at the head of a piece."""

    topic: BagTopic
    raw: bytes
    publish_time: int


class Piece:
    """File number `number` of a recording; every `OSError` leaves whole records behind."""

    def __init__(
        self,
        folder: Path,
        number: int,
        *,
        chunk_size: int,
        open_file: Callable[[Path], RecordFile],
        after_chunk: Callable[[], None],
    ):
        self.number = number
        self.path = folder / f'{folder.name}_{number}.mcap'
        self.repeated: dict[int, int] = {}  # channel -> messages that stand in an earlier piece too
        self.file = open_file(self.path)
        self.container = ChunkedMcap(self.file, chunk_size)
        try:
            self.container.start(PROFILE, LIBRARY)
        except OSError:
            self.file.close()
            self.path.unlink(missing_ok=True)
            raise
        self.container.after_chunk = after_chunk

    @property
    def kept(self) -> int:
        """How many messages stand in complete chunks, repetitions not counted."""
        return sum(self.container.message_counts.values()) - sum(self.repeated.values())

    @property
    def empty(self) -> bool:
        """Whether the piece has nothing but repetitions."""
        return not self.container.pending and not self.kept

    @property
    def room_needed(self) -> int:
        """How many bytes the file would have after one more chunk and its end, estimated from above."""
        return self.file.size + self.container.room_needed

    def declare_type(self, type_name: str) -> int:
        """Declare a message type and return its number; raises `SchemaError` if it is not installed."""
        return self.container.add_schema(type_name, SCHEMA_ENCODING, schema_text(type_name).encode())

    def declare(self, topic: BagTopic) -> int:
        """Declare a topic and return the number of its channel."""
        details = {'offered_qos_profiles': qos_text(topic.offered_qos), 'topic_type_hash': topic.type_hash}
        details |= units_text(topic.units)
        group = chunk_group(topic.name, topic.type)
        return self.container.add_channel(topic.name, MESSAGE_ENCODING, topic.schema, details, group)

    def repeat(self, repetitions: Iterable[Repetition], time: int) -> None:
        """Write the latched messages with log time `time` (ns) and their own publish times.

        A metadata record before them names their topics, so that who reads all pieces counts each once.
        """
        repetitions = list(repetitions)
        names = [repetition.topic.name for repetition in repetitions]
        values = {'number': str(self.number), 'repeated': yaml.safe_dump(names, default_flow_style=True)}
        self.container.add_metadata(PIECE_RECORD, values)
        try:
            for entry in repetitions:
                self.container.add_message(entry.topic.channel, entry.raw, time, entry.publish_time)
            self.container.flush()
        finally:
            self.repeated = dict(self.container.message_counts)

    def information(self) -> FileInformation:
        """Return what `metadata.yaml` says of this file: what is physically there."""
        start, end = self.container.start_time, self.container.end_time
        count = sum(self.container.message_counts.values())
        if start is None or end is None:
            return FileInformation(self.path.name, NO_TIME, 0, count)
        return FileInformation(self.path.name, start, end - start, count)

    def finish(self, records: Mapping[str, Mapping[str, str]]) -> None:
        """Write the metadata records and the summary behind the last chunk, and close the file."""
        try:
            self.file.release_room()
            for name, values in records.items():
                self.container.add_metadata(name, values)
            self.container.finish()
        finally:
            self.file.close()
