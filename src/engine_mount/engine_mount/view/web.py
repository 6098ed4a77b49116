"""The page at localhost: HTTP for its files, a WebSocket for what happens."""

import json
from importlib.resources import files
from typing import Any

from aiohttp import web

from engine_mount.reports.drawing.page import asset
from engine_mount.view.model import INTERVALS_PER_SECOND, WINDOW, Interval, Model
from engine_mount.view.server import LocalServer

_STATE_EVERY = 10  # intervals, chosen: three times a second
_OWN, _OF_REPORTS = ('view.html', 'view.js', 'view.css'), ('chart.js', 'page.css')
_TYPES = {'html': 'text/html', 'js': 'text/javascript', 'css': 'text/css'}
_POLICY = "default-src 'self'; connect-src 'self' ws: wss:; img-src 'self' data:; frame-ancestors 'none'"


class Web(LocalServer):
    """Serves the page of a model from `start` to `stop`."""

    name = 'page'
    remedy = 'choose another --port'
    backlog = 90  # intervals, chosen: 3 s; a viewer that lags behind them misses some

    def __init__(self, model: Model, title: str, host: str, port: int):
        """Bind to `host`; where others can reach it, only with the token that `address` carries."""
        super().__init__(host, port)
        self._model, self._title = model, title
        self.address = f'http://{host}:{port}/{self.query}'
        """What to type into a browser."""
        model.on_interval = self._add

    def routes(self) -> list[web.RouteDef]:
        """Return the files of the page and its stream."""
        return [
            web.get('/stream', self.stream),
            web.get('/{name:.*}', _file),
        ]

    def greeting(self) -> list[str]:
        """Return all that is known."""
        model = self._model
        content = {
            'title': self._title,
            'window': {'seconds': WINDOW, 'per_second': INTERVALS_PER_SECOND},
            'chart': model.chart(),
            'state': model.state_json(),
            'intervals': [interval.as_json() for interval in list(model.intervals)],
        }
        return [json.dumps(content)]

    def _add(self, interval: Interval) -> None:
        """Take an interval from the thread of the model."""
        if not self.viewers:
            return
        content: dict[str, Any] = {'intervals': [interval.as_json()]}
        if interval.number % _STATE_EVERY == 0:
            content |= {'state': self._model.state_json(), 'chart': self._model.chart()}
        text = json.dumps(content)
        for viewer in self.viewers:
            self.loop.call_soon_threadsafe(viewer.add, text)


async def _file(request: web.Request) -> web.Response:
    name = request.match_info['name'] or 'view.html'
    if name not in (*_OWN, *_OF_REPORTS):
        raise web.HTTPNotFound
    own = files('engine_mount.view') / 'page' / name
    text = asset(name) if name in _OF_REPORTS else own.read_text(encoding='utf-8')
    headers = {'Content-Security-Policy': _POLICY, 'Cache-Control': 'no-store'}
    return web.Response(text=text, content_type=_TYPES[name.rpartition('.')[2]], headers=headers)
