"""A Foxglove WebSocket server: Foxglove or Lichtblick show the topics, with nothing of ROS on their side.

The protocol is that of github.com/foxglove/ws-protocol, as far as a viewer of topics uses it. Messages pass
as they are, CDR with their `ros2msg` definition.
"""

import asyncio
import json
import struct
from collections import deque
from collections.abc import Mapping
from typing import Any

from aiohttp import WSMsgType, web

from engine_mount.view.feed.feed import Message
from engine_mount.view.local_server import LocalServer
from mount_recorder.schemas import schema_text
from mount_ros.topics import Topic

PROTOCOLS = ('foxglove.sdk.v1', 'foxglove.websocket.v1')
ORIGINS = ('https://app.foxglove.dev', 'file://')
"""Pages that may connect on loopback: Foxglove in the browser, and the programs Foxglove and Lichtblick."""
_MESSAGE = struct.Struct('<BIQ')  # opcode, subscription, ns
_TIME = struct.Struct('<BQ')  # opcode, ns
_MESSAGE_OPCODE, _TIME_OPCODE = 1, 2
_WARNING = 1  # level of a status
_TIME_STEP = 50_000_000  # ns, chosen: how often clients receive the time
_BACKLOG = 8192  # messages of a client, chosen: about a second of all topics; the oldest are dropped


class FoxgloveServer:
    """Serves the topics of a feed from its making to `stop`; raises `FeedError` where the port is taken."""

    def __init__(self, topics: Mapping[str, Topic], host: str, port: int):
        self._numbers = {topic: number for number, topic in enumerate(topics.values(), 1)}
        self._channels = [
            {
                'id': self._numbers[topic],
                'topic': name,
                'encoding': 'cdr',
                'schemaName': topic.type,
                'schemaEncoding': 'ros2msg',
                'schema': schema_text(topic.type),
            }
            for name, topic in topics.items()
        ]
        self._clients: tuple[_Client, ...] = ()
        self._last_time = 0
        self._server = LocalServer('Foxglove server', host, port, ORIGINS)
        self._server.start([web.get('/', self._serve)], 'choose another --foxglove-port, or 0 for none')
        self.address = f'ws://{host}:{port}/{self._server.query}'

    def take(self, message: Message) -> None:
        """Pass a message on to the clients that have subscribed to its topic."""
        number = self._numbers.get(message.topic)
        if number is not None and self._clients:
            self._server.loop.call_soon_threadsafe(self._deliver, number, message)

    def stop(self) -> None:
        """End the server; safe to call twice."""
        self._clients = ()
        self._server.stop()

    def _deliver(self, number: int, message: Message) -> None:
        time_due = message.received - self._last_time > _TIME_STEP
        if time_due:
            self._last_time = message.received
        for client in self._clients:
            subscription = client.subscriptions.get(number)
            if subscription is not None:
                client.add(_MESSAGE.pack(_MESSAGE_OPCODE, subscription, message.received) + message.raw)
            if time_due:
                client.add(_TIME.pack(_TIME_OPCODE, message.received))

    async def _serve(self, request: web.Request) -> web.WebSocketResponse:
        socket = web.WebSocketResponse(protocols=PROTOCOLS, heartbeat=10.0)
        await socket.prepare(request)
        encodings = {'capabilities': ['time'], 'supportedEncodings': ['cdr'], 'metadata': {}}
        await socket.send_json({'op': 'serverInfo', 'name': 'engine mount', **encodings})
        await socket.send_json({'op': 'advertise', 'channels': self._channels})
        client = _Client(socket)
        self._clients += (client,)
        sender = asyncio.create_task(client.send())
        try:
            async for message in socket:
                if message.type == WSMsgType.TEXT and not client.change_subscriptions(message.data):
                    text = 'a request that this server does not know was ignored'
                    await socket.send_json({'op': 'status', 'level': _WARNING, 'message': text})
        finally:
            self._clients = tuple(each for each in self._clients if each is not client)
            sender.cancel()
        return socket


class _Client:
    """A viewer: the channels it has subscribed to, and what it has yet to receive."""

    def __init__(self, socket: web.WebSocketResponse):
        self.subscriptions: dict[int, int] = {}  # {channel: subscription}
        self._socket = socket
        self._waiting: deque[bytes] = deque(maxlen=_BACKLOG)
        self._ready = asyncio.Event()

    def add(self, frame: bytes) -> None:
        """Let `send` send a frame."""
        self._waiting.append(frame)
        self._ready.set()

    async def send(self) -> None:
        """Send what is added, until the task is cancelled or the connection ends."""
        while not self._socket.closed:
            await self._ready.wait()
            self._ready.clear()
            while self._waiting:
                await self._socket.send_bytes(self._waiting.popleft())

    def change_subscriptions(self, text: str) -> bool:
        """Take a request; return False where it is none that this server knows."""
        try:
            request: dict[str, Any] = json.loads(text)
            if request['op'] == 'subscribe':
                self.subscriptions |= {
                    int(each['channelId']): int(each['id']) & 0xFFFFFFFF for each in request['subscriptions']
                }
            elif request['op'] == 'unsubscribe':
                ended = set(request['subscriptionIds'])
                self.subscriptions = {
                    channel: number for channel, number in self.subscriptions.items() if number not in ended
                }
            else:
                return False
        except (ValueError, KeyError, TypeError):
            return False
        return True
