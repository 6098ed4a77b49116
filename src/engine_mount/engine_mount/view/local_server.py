"""An HTTP server in a thread of its own, for the viewers of this machine or with a token for others."""

import asyncio
import secrets
import threading
from collections.abc import Sequence
from typing import Any

from aiohttp import web

from engine_mount.view.feed.feed import FeedError

LOOPBACK = ('127.0.0.1', 'localhost', '::1')
_CLOSE_LIMIT = 2.0  # s, chosen


class LocalServer:
    """Serves from `start` to `stop`.

    On loopback it answers requests to the name of this machine from no page, from a page of its own, or from
    one of `origins`; where others can reach it, requests with the token that `query` carries.
    """

    def __init__(self, name: str, host: str, port: int, origins: Sequence[str] = ()):
        self.loop = asyncio.new_event_loop()
        """Serves the requests; other threads hand work to it by `call_soon_threadsafe`."""
        self.query = ''
        """The end of the address of a server that needs a token."""
        self._name, self._host, self._port = name, host, port
        self._origins = origins
        self._token = '' if host in LOOPBACK else secrets.token_urlsafe(16)
        if self._token:
            self.query = f'?token={self._token}'
        self._thread = threading.Thread(target=self._serve, name=name, daemon=True)
        self._begun = threading.Event()
        self._refusal = ''
        self._routes: Sequence[web.RouteDef] = ()

    def start(self, routes: Sequence[web.RouteDef], remedy: str) -> None:
        """Begin to serve; raises `FeedError` with the remedy where the port is taken."""
        self._routes = routes
        self._thread.start()
        self._begun.wait()
        if self._refusal:
            raise FeedError(f'{self._refusal}: {remedy}')

    def stop(self) -> None:
        """End; safe to call twice."""
        if self._thread.is_alive():
            self.loop.call_soon_threadsafe(self.loop.stop)
            self._thread.join()

    def _serve(self) -> None:
        asyncio.set_event_loop(self.loop)
        application = web.Application(middlewares=[self._guard])
        application.router.add_routes(self._routes)
        runner = web.AppRunner(application, access_log=None, shutdown_timeout=_CLOSE_LIMIT)
        try:
            self.loop.run_until_complete(runner.setup())
            self.loop.run_until_complete(web.TCPSite(runner, self._host, self._port).start())
        except OSError as error:
            self._refusal = f'the {self._name} cannot listen at {self._host}:{self._port} ({error.strerror})'
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
                raise web.HTTPForbidden(text=f'The {self._name} needs the token that the command printed.')
        elif request.url.host not in LOOPBACK:
            # A foreign name that leads here would let a page of its owner read what is served.
            raise web.HTTPForbidden(text=f'The {self._name} answers to localhost, not to {request.host}.')
        if origin is not None and origin.split('://')[-1] != request.host and origin not in self._origins:
            raise web.HTTPForbidden(text=f'A page of {origin} has no access to the {self._name}.')
        response = await handler(request)
        if self._token and not response.prepared:
            response.set_cookie('token', self._token, httponly=True, samesite='Strict')
        return response
