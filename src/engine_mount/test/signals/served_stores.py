"""Stores that tests fetch from: S3, SFTP and HTTP on this machine, and a way to them that breaks."""

import asyncio
import collections
import contextlib
import functools
import http.client
import http.server
import os
import socket
import threading
from pathlib import Path

import asyncssh

SECRET_KEY = 'a-key-that-nothing-may-write-down'


@contextlib.contextmanager
def s3_server():
    """Give the port of a store of objects."""
    from moto.server import ThreadedMotoServer

    server = ThreadedMotoServer(ip_address='127.0.0.1', port=0, verbose=False)
    server.start()
    try:
        yield server.get_host_and_port()[1]
    finally:
        server.stop()


def name_s3_store(port, patch):
    """Let the environment name the store at `port` and who asks."""
    patch.setenv('AWS_ACCESS_KEY_ID', 'test')
    patch.setenv('AWS_SECRET_ACCESS_KEY', SECRET_KEY)
    patch.setenv('AWS_DEFAULT_REGION', 'us-east-1')
    patch.setenv('AWS_ENDPOINT_URL', f'http://127.0.0.1:{port}')


class Bucket:
    """The bucket `drives` of a store of objects at `port`, made anew."""

    def __init__(self, port):
        import s3fs

        self.port = port
        connection = http.client.HTTPConnection('127.0.0.1', port)
        connection.request('POST', '/moto-api/reset')
        assert connection.getresponse().status == 200
        connection.close()
        s3fs.S3FileSystem.clear_instance_cache()  # those of other tests have other keys
        self._files = s3fs.S3FileSystem(use_listings_cache=False, skip_instance_cache=True)
        self._files.call_s3('create_bucket', Bucket='drives')

    def put(self, key, data, **how):
        self._files.call_s3('put_object', Bucket='drives', Key=key, Body=data, **how)

    def put_folder(self, folder, key):
        for file in folder.iterdir():
            self.put(f'{key}/{file.name}', file.read_bytes())


@contextlib.contextmanager
def sftp_store(folder, home, port=0):
    """Give the port of an SFTP server that shows `folder` as `/` and lets the user of `home` in."""
    loop = asyncio.new_event_loop()
    thread = threading.Thread(target=loop.run_forever, daemon=True)
    thread.start()
    ssh = Path(home, '.ssh')
    if not ssh.is_dir():
        ssh.mkdir(mode=0o700)
        asyncssh.generate_private_key('ssh-ed25519').write_private_key(ssh / 'host')
        key = asyncssh.generate_private_key('ssh-ed25519')
        key.write_private_key(ssh / 'id_ed25519')
        key.write_public_key(ssh / 'authorized_keys')
    served = functools.partial(asyncssh.SFTPServer, chroot=os.fsencode(folder))

    connections = []

    class Kept(asyncssh.SSHServer):
        def connection_made(self, conn):
            connections.append(conn)

    async def begin():
        return await asyncssh.listen(
            '127.0.0.1', port, server_factory=Kept, server_host_keys=[str(ssh / 'host')],
            authorized_client_keys=str(ssh / 'authorized_keys'), sftp_factory=served, allow_scp=False,
        )  # fmt: skip

    async def end():
        server.close()
        for connection in connections:
            connection.abort()
            await connection.wait_closed()
        await server.wait_closed()
        await asyncio.sleep(0)

    server = asyncio.run_coroutine_threadsafe(begin(), loop).result()
    try:
        yield server.get_port()
    finally:
        asyncio.run_coroutine_threadsafe(end(), loop).result(10)
        loop.call_soon_threadsafe(loop.stop)
        thread.join()


def know_host(home, port, key='host'):
    """Let the user of `home` know the key of the server at `port`."""
    public = asyncssh.read_private_key(Path(home, '.ssh', key)).export_public_key().decode()
    with Path(home, '.ssh', 'known_hosts').open('a') as file:
        file.write(f'[127.0.0.1]:{port} {public}')


class HttpStore:
    """A server of the files in `folder`, with sizes or without.

    `asked` counts the requests by method; answers to GET wait for `gate`.
    """

    def __init__(self, folder, *, sizes=True):
        self.asked = collections.Counter()
        self.gate = threading.Event()
        self.gate.set()
        self.status = 0
        handler = functools.partial(_Handler, self, str(folder))
        self.sizes = sizes
        self._server = http.server.ThreadingHTTPServer(('127.0.0.1', 0), handler)
        self.port = self._server.server_address[1]
        self.uri = f'http://127.0.0.1:{self.port}'
        self._thread = threading.Thread(target=self._server.serve_forever, daemon=True)
        self._thread.start()

    def close(self):
        self.gate.set()
        self._server.shutdown()
        self._server.server_close()
        self._thread.join()


class _Handler(http.server.SimpleHTTPRequestHandler):
    protocol_version = 'HTTP/1.1'

    def __init__(self, store, folder, *args):
        self._store = store
        super().__init__(*args, directory=folder)

    def log_message(self, *args):
        pass

    def do_HEAD(self):
        self._store.asked['HEAD'] += 1
        if self._store.status:
            self.send_error(self._store.status)
        else:
            super().do_HEAD()

    def do_GET(self):
        self._store.asked['GET'] += 1
        self._store.gate.wait()
        if self._store.status:
            self.send_error(self._store.status)
        else:
            super().do_GET()

    def send_header(self, keyword, value):
        if keyword == 'Content-Length' and not self._store.sizes:
            keyword, value = 'Connection', 'close'
        super().send_header(keyword, value)


class BreakingWay:
    """A way to a server here that breaks: every connection after `bytes_each`, or all while `away`."""

    def __init__(self, port, bytes_each):
        self._target = port
        self.bytes_each = bytes_each
        self.away = False
        self.broken = 0
        self.refused = 0
        self._listening = socket.create_server(('127.0.0.1', 0))
        self.port = self._listening.getsockname()[1]
        self._thread = threading.Thread(target=self._serve, daemon=True)
        self._thread.start()

    def close(self):
        self._listening.shutdown(socket.SHUT_RDWR)
        self._listening.close()
        self._thread.join()

    def _serve(self):
        while True:
            try:
                here, _ = self._listening.accept()
            except OSError:
                return
            if self.away:
                self.refused += 1
                here.close()
                continue
            there = socket.create_connection(('127.0.0.1', self._target))
            for source, target, most in ((here, there, None), (there, here, self.bytes_each)):
                threading.Thread(target=self._pass, args=(source, target, most), daemon=True).start()

    def _pass(self, source, target, most):
        passed = 0
        with contextlib.suppress(OSError):
            while data := source.recv(16384):
                passed += len(data)
                if self.away or (most is not None and passed > most):
                    self.broken += 1
                    break
                target.sendall(data)
        for end in (source, target):
            with contextlib.suppress(OSError):
                end.shutdown(socket.SHUT_RDWR)
            end.close()
