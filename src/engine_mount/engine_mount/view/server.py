"""An HTTP server in a thread of its own, for the viewers of this machine or with a token for others."""

import asyncio
import secrets
import threading
from collections import deque
from collections.abc import Sequence
from typing import Any

from aiohttp import WSMsgType, web

from engine_mount.view.feed import FeedError

LOOPBACK = ('127.0.0.1', 'localhost', '::1')
_CLOSE_LIMIT = 2.0  # s, chosen


class Viewer:
    """A connection with the messages that it has yet to receive; of too many the oldest are dropped."""

    def __init__(self, socket: web.WebSocketResponse, backlog: int):
        self.subscriptions: dict[int, int] = {}  # {channel: subscription}
        self._socket = socket
        self._waiting: deque[str | bytes] = deque(maxlen=backlog)
        self._ready = asyncio.Event()

    def add(self, message: str | bytes) -> None:
        """Let `send` send a message."""
        self._waiting.append(message)
        self._ready.set()

    async def send(self) -> None:
        """Send what is added, until the task is cancelled or the connection ends."""
        while not self._socket.closed:
            await self._ready.wait()
            self._ready.clear()
            while self._waiting:
                message = self._waiting.popleft()
                if isinstance(message, str):
                    await self._socket.send_str(message)
                else:
                    await self._socket.send_bytes(message)


class LocalServer:
    """Serves `routes` and sockets from `start` to `stop`.

    On loopback it answers requests to the name of this machine from no page, from a page of its own, or from
    one of `origins`; where others can reach it, requests with the token that `query` carries.
    """

    name = 'server'
    remedy = ''  # where its port is taken
    backlog = 0  # messages of a viewer
    protocols: Sequence[str] = ()
    origins: Sequence[str] = ()

    def __init__(self, host: str, port: int):
        self.loop = asyncio.new_event_loop()
        """Serves the requests; other threads hand work to it by `call_soon_threadsafe`."""
        self.viewers: tuple[Viewer, ...] = ()
        self._host, self._port = host, port
        self._token = '' if host in LOOPBACK else secrets.token_urlsafe(16)
        self.query = f'?token={self._token}' if self._token else ''
        """The end of the address of a server that needs a token."""
        self._thread = threading.Thread(target=self._serve, name=self.name, daemon=True)
        self._begun = threading.Event()
        self._refusal = ''

    def routes(self) -> list[web.RouteDef]:
        """Return what is served."""
        raise NotImplementedError

    def greeting(self) -> list[str]:
        """Return the first messages of a viewer."""
        raise NotImplementedError

    def receive(self, viewer: Viewer, text: str) -> None:
        """Take a message of a viewer."""

    def start(self) -> None:
        """Begin to serve; raises `FeedError` with the remedy where the port is taken."""
        self._thread.start()
        self._begun.wait()
        if self._refusal:
            raise FeedError(f'{self._refusal}: {self.remedy}')

    def stop(self) -> None:
        """End; safe to call twice."""
        self.viewers = ()
        if self._thread.is_alive():
            self.loop.call_soon_threadsafe(self.loop.stop)
            self._thread.join()

    async def stream(self, request: web.Request) -> web.WebSocketResponse:
        """Serve a viewer until it leaves."""
        socket = web.WebSocketResponse(protocols=self.protocols, heartbeat=10.0)
        await socket.prepare(request)
        for text in self.greeting():
            await socket.send_str(text)
        viewer = Viewer(socket, self.backlog)
        self.viewers += (viewer,)
        sender = asyncio.create_task(viewer.send())
        try:
            async for message in socket:
                if message.type == WSMsgType.TEXT:
                    self.receive(viewer, message.data)
        finally:
            self.viewers = tuple(each for each in self.viewers if each is not viewer)
            sender.cancel()
        return socket

    def _serve(self) -> None:
        asyncio.set_event_loop(self.loop)
        application = web.Application(middlewares=[self._guard])
        application.router.add_routes(self.routes())
        runner = web.AppRunner(application, access_log=None, shutdown_timeout=_CLOSE_LIMIT)
        try:
            self.loop.run_until_complete(runner.setup())
            self.loop.run_until_complete(web.TCPSite(runner, self._host, self._port).start())
        except OSError as error:
            self._refusal = f'the {self.name} cannot listen at {self._host}:{self._port} ({error.strerror})'
            return
        finally:
            self._begun.set()
        self.loop.run_forever()
        self.loop.run_until_complete(runner.cleanup())

    @web.middleware
    async def _guard(self, request: web.Request, handler: Any) -> web.StreamResponse:
        origin = request.headers.get('Origin')
        if self._token:
            given = request.query.get('token') or request.cookies.get('token') or ''
            if not secrets.compare_digest(given.encode(errors='replace'), self._token.encode()):
                raise web.HTTPForbidden(text=f'The {self.name} needs the token that the command printed.')
        elif request.url.host not in LOOPBACK:
            # A foreign name that leads here would let a page of its owner read what is served.
            raise web.HTTPForbidden(text=f'The {self.name} answers to localhost, not to {request.host}.')
        if origin is not None and origin.split('://')[-1] != request.host and origin not in self.origins:
            raise web.HTTPForbidden(text=f'A page of {origin} has no access to the {self.name}.')
        response = await handler(request)
        if self._token and not response.prepared:
            response.set_cookie('token', self._token, httponly=True, samesite='Strict')
        return response
