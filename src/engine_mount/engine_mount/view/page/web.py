"""The page at localhost: HTTP for its files, a WebSocket for what happens."""

import asyncio
import json
from collections.abc import Callable
from importlib.resources import files
from typing import Any

from aiohttp import WSMsgType, web

from engine_mount.view.local_server import LocalServer
from engine_mount.view.window.model import Interval, Model
from engine_mount.view.window.told import told_intervals, told_panels, told_state, told_window

_STATE_EVERY = 10  # intervals, chosen: three times a second
_QUEUE = 90  # intervals, chosen: 3 s; a viewer that lags behind them misses some
_KINDS = {'view.html': 'text/html', 'view.js': 'text/javascript', 'view.css': 'text/css'}
_POLICY = "default-src 'self'; connect-src 'self' ws: wss:; img-src 'self' data:; frame-ancestors 'none'"


class Web:
    """Serves the page of a model from `start` to `stop`, in a thread of its own."""

    def __init__(self, model: Model, title: str, mark: Callable[[], str], host: str, port: int):
        """Bind to `host`; where others can reach it, only with the token that `address` carries."""
        self._model, self._title, self._mark = model, title, mark
        self._viewers: set[asyncio.Queue[str]] = set()
        self._server = LocalServer('page', host, port)
        self.address = f'http://{host}:{port}/{self._server.query}'
        """What to type into a browser."""

    def start(self) -> None:
        """Begin to serve; raises `FeedError` where the port is taken."""
        self._model.listen(self._tell)
        routes = [
            web.get('/', _page),
            web.get('/stream', self._stream),
            web.get('/{name}', _file),
            web.post('/mark', self._set_mark),
        ]
        self._server.start(routes, 'choose another --port')

    def stop(self) -> None:
        """End; safe to call twice."""
        self._server.stop()

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
        self._server.loop.call_soon_threadsafe(self._hand_out, text)

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
    text = files('engine_mount.view.page').joinpath(name).read_text(encoding='utf-8')
    headers = {'Content-Security-Policy': _POLICY, 'Cache-Control': 'no-store'}
    return web.Response(text=text, content_type=_KINDS[name], headers=headers)
