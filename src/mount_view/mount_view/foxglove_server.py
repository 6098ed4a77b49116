"""A Foxglove WebSocket server: Foxglove or Lichtblick show the topics, with nothing of ROS on their side.

Messages pass as they are, CDR with their `ros2msg` definition. The server of the SDK drops the oldest ones
of a client that reads too slowly, so that neither the feed nor another client waits for it.
"""

from collections.abc import Mapping

import foxglove
from foxglove import Channel, Schema
from foxglove.websocket import Capability, WebSocketServer

from mount_recorder.schemas import schema_text
from mount_ros.topics import Topic
from mount_view.feed.feed import FeedError, Message

_TIME_STEP = 50_000_000  # ns, chosen: how often clients are told the time
_BACKLOG = 8192  # messages of a client, chosen: about a second of all topics


class FoxgloveServer:
    """Serves the topics of a feed from its making to `stop`; bound to `host`, without protection."""

    def __init__(self, topics: Mapping[str, Topic], host: str, port: int):
        """Raises `FeedError` where the port is taken."""
        self._context = foxglove.Context()
        try:
            self._server: WebSocketServer | None = foxglove.start_server(
                name='engine mount',
                host=host,
                port=port,
                capabilities=[Capability.Time],
                supported_encodings=['cdr'],
                context=self._context,
                message_backlog_size=_BACKLOG,
            )
        except RuntimeError as error:
            raise FeedError(
                f'the Foxglove server cannot listen at {host}:{port} ({error}): '
                'choose another --foxglove-port, or 0 for none'
            ) from None
        schemas = {kind: schema_text(kind) for kind in {topic.type for topic in topics.values()}}
        self._channels = {
            topic: Channel(
                name,
                schema=Schema(name=topic.type, encoding='ros2msg', data=schemas[topic.type].encode()),
                message_encoding='cdr',
                context=self._context,
            )
            for name, topic in topics.items()
        }
        self.address = f'ws://{host}:{self._server.port}'
        self._told = 0

    def take(self, message: Message) -> None:
        """Pass a message on to who wants its topic."""
        channel = self._channels.get(message.topic)
        if self._server is None or channel is None:
            return
        channel.log(message.raw, log_time=message.received)
        if message.received - self._told > _TIME_STEP:
            self._told = message.received
            self._server.broadcast_time(message.received)

    def stop(self) -> None:
        """End the server; safe to call twice."""
        server, self._server = self._server, None
        if server is not None:
            server.stop()
