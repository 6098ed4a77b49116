"""The page at localhost: HTTP for its files, a WebSocket for what happens."""

import asyncio
import json
import secrets
import threading
from collections.abc import Callable
from importlib.resources import files
from typing import Any

from aiohttp import WSMsgType, web

from mount_view.feed.feed import FeedError
from mount_view.window.model import Interval, Model
from mount_view.window.told import told_intervals, told_panels, told_state, told_window

_STATE_EVERY = 10  # intervals, chosen: three times a second
_QUEUE = 90  # intervals, chosen: 3 s; a viewer that lags behind them misses some
_CLOSE_LIMIT = 2.0  # s, chosen
_KINDS = {'view.html': 'text/html', 'view.js': 'text/javascript', 'view.css': 'text/css'}
_POLICY = "default-src 'self'; connect-src 'self' ws: wss:; img-src 'self' data:; frame-ancestors 'none'"
LOOPBACK = ('127.0.0.1', 'localhost', '::1')


class Web:
    """Serves the page of a model from `start` to `stop`, in a thread of its own."""

    def __init__(self, model: Model, title: str, mark: Callable[[], str], host: str, port: int):
        """Bind to `host`; where others can reach it, only with the token that `address` carries."""
        self._model, self._title, self._mark = model, title, mark
        self._host, self._port = host, port
        self._token = '' if host in LOOPBACK else secrets.token_urlsafe(16)
        self._viewers: set[asyncio.Queue[str]] = set()
        self._loop = asyncio.new_event_loop()
        self._thread = threading.Thread(target=self._serve, name='page', daemon=True)
        self._begun = threading.Event()
        self._refusal = ''

    @property
    def address(self) -> str:
        """What to type into a browser."""
        return f'http://{self._host}:{self._port}/' + (f'?token={self._token}' if self._token else '')

    def start(self) -> None:
        """Begin to serve; raises `FeedError` where the port is taken."""
        self._model.listen(self._tell)
        self._thread.start()
        self._begun.wait()
        if self._refusal:
            raise FeedError(self._refusal)

    def stop(self) -> None:
        """End; safe to call twice."""
        if self._thread.is_alive():
            self._loop.call_soon_threadsafe(self._loop.stop)
            self._thread.join()

    def _serve(self) -> None:
        asyncio.set_event_loop(self._loop)
        runner = web.AppRunner(self._application(), access_log=None, shutdown_timeout=_CLOSE_LIMIT)
        try:
            self._loop.run_until_complete(runner.setup())
            site = web.TCPSite(runner, self._host, self._port)
            self._loop.run_until_complete(site.start())
        except OSError as error:
            self._refusal = (
                f'the page cannot be served at {self._host}:{self._port} ({error.strerror}): '
                'choose another --port'
            )
            return
        finally:
            self._begun.set()
        self._loop.run_forever()
        self._loop.run_until_complete(runner.cleanup())

    def _application(self) -> web.Application:
        application = web.Application(middlewares=[self._guard])
        application.router.add_get('/', _page)
        application.router.add_get('/stream', self._stream)
        application.router.add_get('/{name}', _file)
        application.router.add_post('/mark', self._set_mark)
        return application

    @web.middleware
    async def _guard(self, request: web.Request, handler: Any) -> web.StreamResponse:
        given = request.query.get('token') or request.cookies.get('token') or ''
        if self._token and not secrets.compare_digest(given.encode(errors='replace'), self._token.encode()):
            raise web.HTTPForbidden(text='This page needs the token that `engine-mount view` has printed.')
        if not self._token and request.url.host not in LOOPBACK:
            # A name of somebody else's that leads here lets a page of theirs read this one.
            raise web.HTTPForbidden(text=f'This page is served as localhost alone, not as {request.host}.')
        origin = request.headers.get('Origin')
        if origin is not None and origin.split('://')[-1] != request.host:
            raise web.HTTPForbidden(text='Another page may not look at this one.')
        response = await handler(request)
        if self._token and not response.prepared:
            response.set_cookie('token', self._token, httponly=True, samesite='Strict')
        return response

    async def _set_mark(self, _: web.Request) -> web.Response:
        return web.json_response({'answer': await asyncio.to_thread(self._mark)})

    async def _stream(self, request: web.Request) -> web.WebSocketResponse:
        viewer = web.WebSocketResponse(heartbeat=10.0)
        await viewer.prepare(request)
        queue: asyncio.Queue[str] = asyncio.Queue(_QUEUE)
        await viewer.send_str(self._whole())
        self._viewers.add(queue)
        sender = asyncio.create_task(_send(queue, viewer))
        try:
            async for message in viewer:
                if message.type == WSMsgType.ERROR:
                    break
        finally:
            self._viewers.discard(queue)
            sender.cancel()
        return viewer

    def _whole(self) -> str:
        model = self._model
        content = {
            'title': self._title,
            'window': told_window(),
            'panels': told_panels(model),
            'state': told_state(model),
            'intervals': told_intervals(list(model.intervals)),
        }
        return json.dumps(content)

    def _tell(self, interval: Interval) -> None:
        """Take an interval from the thread of the model."""
        if not self._viewers:
            return
        content: dict[str, Any] = {'intervals': told_intervals([interval])}
        if interval.number % _STATE_EVERY == 0:
            content |= {'state': told_state(self._model), 'panels': told_panels(self._model)}
        text = json.dumps(content)
        self._loop.call_soon_threadsafe(self._hand_out, text)

    def _hand_out(self, text: str) -> None:
        for queue in self._viewers:
            if not queue.full():  # a viewer that reads too slowly misses this one: nothing waits for it
                queue.put_nowait(text)


async def _send(queue: asyncio.Queue[str], viewer: web.WebSocketResponse) -> None:
    while not viewer.closed:
        await viewer.send_str(await queue.get())


async def _page(_: web.Request) -> web.Response:
    return _content('view.html')


async def _file(request: web.Request) -> web.Response:
    name = request.match_info['name']
    if name not in _KINDS:
        raise web.HTTPNotFound
    return _content(name)


def _content(name: str) -> web.Response:
    text = files('mount_view.page').joinpath(name).read_text(encoding='utf-8')
    headers = {'Content-Security-Policy': _POLICY, 'Cache-Control': 'no-store'}
    return web.Response(text=text, content_type=_KINDS[name], headers=headers)
