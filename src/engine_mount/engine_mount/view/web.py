"""What viewers connect to: the page at localhost, and a server for Foxglove or Lichtblick.

The page is HTTP for its files and a WebSocket for what happens, both in a thread of their own. Foxglove's own
library passes messages as they are, CDR with their `ros2msg` definition. It has no tokens and checks no
origin, so its server listens on loopback alone and takes no message.
"""

import asyncio
import json
import secrets
import threading
from collections.abc import Mapping
from importlib.resources import files
from typing import Any

from aiohttp import web
from foxglove import Channel, Context, Schema, start_server
from foxglove.websocket import Capability

from engine_mount.reports.drawing.page import asset
from engine_mount.view.feed import FeedError, Message
from engine_mount.view.model import INTERVALS_PER_SECOND, WINDOW, Interval, Model
from mount_control.policy.registry import DEFAULT
from mount_recorder.schemas import schema_text
from mount_ros.topics import Topic

LOOPBACK = ('127.0.0.1', 'localhost', '::1')
_CLOSE_LIMIT = 2.0  # s, chosen
_BACKLOG = 90  # intervals of a viewer, chosen: 3 s; one that lags behind them misses some
_STATE_EVERY = 10  # intervals, chosen: three times a second
_OWN, _OF_REPORTS = ('view.html', 'view.js', 'view.css'), ('chart.js', 'page.css')
_TYPES = {'html': 'text/html', 'js': 'text/javascript', 'css': 'text/css'}
_FOXGLOVE_BACKLOG = 8192  # messages of a viewer, chosen: about a second of all topics
_TIME_STEP = 50_000_000  # ns, chosen: how often viewers receive the time
_POLICY = "default-src 'self'; connect-src 'self' ws: wss:; img-src 'self' data:; frame-ancestors 'none'"


class Viewer(asyncio.Queue[str]):
    """The messages that a connection has yet to receive; of too many the oldest are dropped."""

    def __init__(self, socket: web.WebSocketResponse):
        super().__init__(_BACKLOG)
        self._socket = socket

    def add(self, message: str) -> None:
        """Let `send` send a message."""
        if self.full():
            self.get_nowait()
        self.put_nowait(message)

    async def send(self) -> None:
        """Send what is added, until the task is cancelled or the connection ends."""
        while not self._socket.closed:
            await self._socket.send_str(await self.get())


class Web:
    """Serves the page of a model from `start` to `stop`.

    On loopback it answers requests to the name of this machine from no page, or from a page of its own; where
    others can reach it, requests with the token that `address` carries.
    """

    def __init__(self, model: Model, title: str, host: str, port: int):
        self._loop = asyncio.new_event_loop()  # other threads hand work to it by `call_soon_threadsafe`
        self._viewers: tuple[Viewer, ...] = ()
        self._model, self._title, self._host, self._port = model, title, host, port
        self._token = '' if host in LOOPBACK else secrets.token_urlsafe(16)
        self.address = f'http://{host}:{port}/' + (f'?token={self._token}' if self._token else '')
        """What to type into a browser."""
        self._thread = threading.Thread(target=self._serve, name='page', daemon=True)
        self._begun = threading.Event()
        self._refusal, self._count = '', 0
        model.on_interval = self._add

    def start(self) -> None:
        """Begin to serve; raises `FeedError` with the remedy where the port is taken."""
        self._thread.start()
        self._begun.wait()
        if self._refusal:
            raise FeedError(
                f'the page cannot listen at {self._host}:{self._port} ({self._refusal}): choose another '
                '--port'
            )

    def stop(self) -> None:
        """End; safe to call twice."""
        self._viewers = ()
        if self._thread.is_alive():
            self._loop.call_soon_threadsafe(self._loop.stop)
            self._thread.join()

    async def _stream(self, request: web.Request) -> web.WebSocketResponse:
        """Serve a viewer until it leaves: all that is known, then each interval."""
        socket = web.WebSocketResponse(heartbeat=10.0)
        await socket.prepare(request)
        model = self._model
        content = {
            'title': self._title,
            'window': {'seconds': WINDOW, 'per_second': INTERVALS_PER_SECOND},
            'chart': model.chart(),
            'state': model.state_json(),
            'intervals': [interval.as_json() for interval in list(model.intervals)],
        }
        await socket.send_json(content)
        viewer = Viewer(socket)
        self._viewers += (viewer,)
        sender = asyncio.create_task(viewer.send())
        try:
            async for _ in socket:
                pass  # a viewer has nothing to say
        finally:
            self._viewers = tuple(each for each in self._viewers if each is not viewer)
            sender.cancel()
        return socket

    async def _layout(self, request: web.Request) -> web.Response:
        """Answer with the layout for Lichtblick of the policy and the namespace of this drive."""
        state = self._model.state
        policy = state.parameters.get('mount_control', {}).get('policy', DEFAULT)
        file = files('engine_mount.view') / 'layouts' / f'lichtblick_{policy}.json'
        text = file.read_text(encoding='utf-8').replace('"/', f'"{state.namespace}/')
        return web.Response(text=text, content_type='application/json')

    def _add(self, interval: Interval) -> None:
        """Take an interval from the thread of the model."""
        if not self._viewers:
            return
        content: dict[str, Any] = {'intervals': [interval.as_json()] if interval.extents else []}
        self._count += 1
        if self._count % _STATE_EVERY == 0:
            content |= {'state': self._model.state_json(), 'chart': self._model.chart()}
        text = json.dumps(content)
        for viewer in self._viewers:
            self._loop.call_soon_threadsafe(viewer.add, text)

    def _serve(self) -> None:
        asyncio.set_event_loop(self._loop)
        application = web.Application(middlewares=[self._guard])
        application.router.add_routes(
            [
                web.get('/stream', self._stream),
                web.get('/layout.json', self._layout),
                web.get('/{name:.*}', _file),
            ]
        )
        runner = web.AppRunner(application, access_log=None, shutdown_timeout=_CLOSE_LIMIT)
        try:
            self._loop.run_until_complete(runner.setup())
            self._loop.run_until_complete(web.TCPSite(runner, self._host, self._port).start())
        except OSError as error:
            self._refusal = str(error.strerror)
            return
        finally:
            self._begun.set()
        self._loop.run_forever()
        self._loop.run_until_complete(runner.cleanup())

    @web.middleware
    async def _guard(self, request: web.Request, handler: Any) -> web.StreamResponse:
        origin = request.headers.get('Origin')
        if self._token:
            given = request.query.get('token') or request.cookies.get('token') or ''
            if not secrets.compare_digest(given.encode(errors='replace'), self._token.encode()):
                raise web.HTTPForbidden(text='The page needs the token that the command printed.')
        elif request.url.host not in LOOPBACK:
            # A foreign name that leads here would let a page of its owner read what is served.
            raise web.HTTPForbidden(text=f'The page answers to localhost, not to {request.host}.')
        if origin is not None and origin.split('://')[-1] != request.host:
            raise web.HTTPForbidden(text=f'A page of {origin} has no access to this one.')
        response = await handler(request)
        if self._token and not response.prepared:
            response.set_cookie('token', self._token, httponly=True, samesite='Strict')
        return response


async def _file(request: web.Request) -> web.Response:
    name = request.match_info['name'] or 'view.html'
    if name not in (*_OWN, *_OF_REPORTS):
        raise web.HTTPNotFound
    own = files('engine_mount.view') / 'page' / name
    text = asset(name) if name in _OF_REPORTS else own.read_text(encoding='utf-8')
    headers = {'Content-Security-Policy': _POLICY, 'Cache-Control': 'no-store'}
    return web.Response(text=text, content_type=_TYPES[name.rpartition('.')[2]], headers=headers)


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
                message_backlog_size=_FOXGLOVE_BACKLOG,
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
