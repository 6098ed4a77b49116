"""A Foxglove WebSocket server: Foxglove or Lichtblick show the topics, with nothing of ROS on their side.

The protocol is that of github.com/foxglove/ws-protocol, as far as a viewer of topics uses it. Messages pass
as they are, CDR with their `ros2msg` definition.
"""

import json
import struct
from collections.abc import Mapping
from typing import Any

from aiohttp import web

from engine_mount.view.feed import Message
from engine_mount.view.server import LocalServer, Viewer
from mount_recorder.schemas import schema_text
from mount_ros.topics import Topic

_MESSAGE = struct.Struct('<BIQ')  # opcode, subscription, ns
_TIME = struct.Struct('<BQ')  # opcode, ns
_MESSAGE_OPCODE, _TIME_OPCODE = 1, 2
_TIME_STEP = 50_000_000  # ns, chosen: how often viewers receive the time


class FoxgloveServer(LocalServer):
    """Serves the topics of a feed from `start` to `stop`."""

    name = 'Foxglove server'
    remedy = 'choose another --foxglove-port, or 0 for none'
    backlog = 8192  # messages, chosen: about a second of all topics
    protocols = ('foxglove.sdk.v1', 'foxglove.websocket.v1')
    origins = ('https://app.foxglove.dev', 'file://')
    """Pages that may connect on loopback: Foxglove in the browser, the programs Foxglove and Lichtblick."""

    def __init__(self, topics: Mapping[str, Topic], host: str, port: int):
        super().__init__(host, port)
        self._topics = topics
        self._numbers = {topic: number for number, topic in enumerate(topics.values(), 1)}
        self._last_time = 0
        self.address = f'ws://{host}:{port}/{self.query}'

    def routes(self) -> list[web.RouteDef]:
        """Return the only address."""
        return [web.get('/', self.stream)]

    def greeting(self) -> list[str]:
        """Return what the server can do, and its channels with their definitions."""
        channels = [
            {
                'id': self._numbers[topic],
                'topic': name,
                'encoding': 'cdr',
                'schemaName': topic.type,
                'schemaEncoding': 'ros2msg',
                'schema': schema_text(topic.type),
            }
            for name, topic in self._topics.items()
        ]
        server = {
            'op': 'serverInfo',
            'name': 'engine mount',
            'capabilities': ['time'],
            'supportedEncodings': ['cdr'],
            'metadata': {},
        }
        return [json.dumps(server), json.dumps({'op': 'advertise', 'channels': channels})]

    def receive(self, viewer: Viewer, text: str) -> None:
        """Change the subscriptions of a viewer; what is no such request changes nothing."""
        try:
            request: dict[str, Any] = json.loads(text)
            if request['op'] == 'subscribe':
                viewer.subscriptions |= {
                    int(each['channelId']): int(each['id']) & 0xFFFFFFFF for each in request['subscriptions']
                }
            elif request['op'] == 'unsubscribe':
                ended, known = set(request['subscriptionIds']), viewer.subscriptions.items()
                viewer.subscriptions = {channel: number for channel, number in known if number not in ended}
        except (ValueError, KeyError, TypeError):
            pass

    def take(self, message: Message) -> None:
        """Pass a message on to the viewers that have subscribed to its topic."""
        number = self._numbers.get(message.topic)
        if number is not None and self.viewers:
            self.loop.call_soon_threadsafe(self._deliver, number, message)

    def _deliver(self, number: int, message: Message) -> None:
        time_due = message.received - self._last_time > _TIME_STEP
        if time_due:
            self._last_time = message.received
        for viewer in self.viewers:
            subscription = viewer.subscriptions.get(number)
            if subscription is not None:
                viewer.add(_MESSAGE.pack(_MESSAGE_OPCODE, subscription, message.received) + message.raw)
            if time_due:
                viewer.add(_TIME.pack(_TIME_OPCODE, message.received))
