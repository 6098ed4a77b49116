"""Which topics an MCAP file declares: its schemas and channels, by their numbers."""

from collections.abc import Mapping
from dataclasses import dataclass, field

from mcap.opcode import Opcode
from mcap.records import Channel, Schema

from engine_mount.recordings.container.mcap_reading.summary import parsed
from engine_mount.recordings.container.stored import StoredTopic


@dataclass
class Declarations:
    """Schemas and channels of a file; the first of a number counts."""

    channels: dict[int, Channel] = field(default_factory=dict)
    schemas: dict[int, Schema] = field(default_factory=dict)

    def take(self, opcode: int, content: bytes) -> None:
        """Take the record of a schema or a channel, if it is readable."""
        if opcode == Opcode.SCHEMA:
            schema = parsed(Schema.read, content)
            if schema is not None:
                self.schemas.setdefault(schema.id, schema)
        else:
            channel = parsed(Channel.read, content)
            if channel is not None:
                self.channels.setdefault(channel.id, channel)

    def over(self, others: 'Declarations') -> 'Declarations':
        """Return these, and of `others` what has no such number here."""
        return Declarations(others.channels | self.channels, others.schemas | self.schemas)

    def topics(self) -> dict[int, StoredTopic]:
        """Return the topics by the numbers of their channels."""
        return {number: _topic(channel, self.schemas) for number, channel in self.channels.items()}


def _topic(channel: Channel, schemas: Mapping[int, Schema]) -> StoredTopic:
    schema = schemas.get(channel.schema_id)
    return StoredTopic(
        name=channel.topic,
        type=schema.name if schema else '',
        encoding=channel.message_encoding,
        definition=schema.data if schema else b'',
        definition_encoding=schema.encoding if schema else '',
        details=channel.metadata,
    )
