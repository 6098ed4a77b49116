"""The topics for Foxglove or Lichtblick by Foxglove's own library, with nothing of ROS on their side.

Messages pass as they are, CDR with their `ros2msg` definition. The library has no tokens and checks no
origin, so the server listens on loopback alone and takes no message.
"""

from collections.abc import Mapping

from foxglove import Channel, Context, Schema, start_server
from foxglove.websocket import Capability

from engine_mount.view.feed import FeedError, Message
from engine_mount.view.web import LOOPBACK
from mount_recorder.schemas import schema_text
from mount_ros.topics import Topic

_BACKLOG = 8192  # messages of a viewer, chosen: about a second of all topics
_TIME_STEP = 50_000_000  # ns, chosen: how often viewers receive the time


class FoxgloveServer:
    """Serves the topics of a feed until `stop`."""

    def __init__(self, topics: Mapping[str, Topic], port: int):
        """Begin to serve; raises `FeedError` with the remedy where the port is taken."""
        self._context = context = Context()  # the server holds none of it
        self._channels = {
            topic: Channel(
                name,
                schema=Schema(name=topic.type, encoding='ros2msg', data=schema_text(topic.type).encode()),
                message_encoding='cdr',
                context=context,
            )
            for name, topic in topics.items()
        }
        self._last_time = 0
        host = LOOPBACK[0]
        try:
            self._server = start_server(
                name='engine mount', host=host, port=port, capabilities=[Capability.Time], context=context,
                message_backlog_size=_BACKLOG,
            )  # fmt: skip
        except RuntimeError as error:
            raise FeedError(
                f'the Foxglove server cannot listen at {host}:{port} ({error}): choose another '
                '--foxglove-port, or 0 for none'
            ) from None
        self.address = f'ws://{host}:{port}/'
        self.stop = self._server.stop

    def take(self, message: Message) -> None:
        """Pass a message on to the viewers that have subscribed to its topic."""
        self._channels[message.topic].log(message.raw, log_time=message.received)
        if message.received - self._last_time > _TIME_STEP:
            self._last_time = message.received
            self._server.broadcast_time(message.received)
