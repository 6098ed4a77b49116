"""Stores that tests fetch from: S3, SFTP and HTTP on this machine, and a way to them that breaks."""

import asyncio
import contextlib
import functools
import http.server
import os
import socket
import threading
from pathlib import Path

import asyncssh


@contextlib.contextmanager
def s3_store(patch):
    """Give the port of a store of objects with a bucket `drives`, and a client to fill it."""
    import boto3
    from moto.server import ThreadedMotoServer

    server = ThreadedMotoServer(ip_address='127.0.0.1', port=0)
    server.start()
    port = server.get_host_and_port()[1]
    patch.setenv('AWS_ACCESS_KEY_ID', 'test')
    patch.setenv('AWS_SECRET_ACCESS_KEY', 'test')
    patch.setenv('AWS_DEFAULT_REGION', 'eu-central-1')
    patch.setenv('AWS_ENDPOINT_URL', f'http://127.0.0.1:{port}')
    client = boto3.client('s3')
    client.create_bucket(Bucket='drives', CreateBucketConfiguration={'LocationConstraint': 'eu-central-1'})
    try:
        yield port, client
    finally:
        server.stop()


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

    async def begin():
        return await asyncssh.listen(
            '127.0.0.1', port, server_host_keys=[str(ssh / 'host')],
            authorized_client_keys=str(ssh / 'authorized_keys'), sftp_factory=served, allow_scp=False,
        )  # fmt: skip

    server = asyncio.run_coroutine_threadsafe(begin(), loop).result()
    try:
        yield server.get_port()
    finally:
        loop.call_soon_threadsafe(server.close)
        asyncio.run_coroutine_threadsafe(server.wait_closed(), loop).result(10)
        loop.call_soon_threadsafe(loop.stop)
        thread.join()


def know_host(home, port, key='host'):
    """Let the user of `home` know the key of the server at `port`."""
    public = asyncssh.read_private_key(Path(home, '.ssh', key)).export_public_key().decode()
    with Path(home, '.ssh', 'known_hosts').open('a') as file:
        file.write(f'[127.0.0.1]:{port} {public}')


@contextlib.contextmanager
def http_store(folder, *, stretches=True, sizes=True):
    """Give the port of a server of the files in `folder`, with stretches of files or only whole ones."""

    class Handler(http.server.SimpleHTTPRequestHandler):
        protocol_version = 'HTTP/1.1'

        def __init__(self, *args):
            super().__init__(*args, directory=str(folder))

        def log_message(self, *args):
            pass

        def do_GET(self):
            wanted = self.headers.get('Range')
            if not (wanted and stretches):
                super().do_GET()
                return
            data = Path(self.translate_path(self.path)).read_bytes()
            begin, _, last = wanted.removeprefix('bytes=').partition('-')
            part = data[int(begin) : int(last) + 1 if last else None]
            self.send_response(206)
            self.send_header('Content-Length', str(len(part)))
            self.send_header('Content-Range', f'bytes {begin}-{int(begin) + len(part) - 1}/{len(data)}')
            self.end_headers()
            self.wfile.write(part)

        def send_header(self, keyword, value):
            if sizes or keyword != 'Content-Length':
                super().send_header(keyword, value)
            if keyword == 'Content-Length' and not sizes:
                super().send_header('Connection', 'close')

    server = http.server.ThreadingHTTPServer(('127.0.0.1', 0), Handler)
    thread = threading.Thread(target=server.serve_forever, daemon=True)
    thread.start()
    try:
        yield server.server_address[1]
    finally:
        server.shutdown()
        server.server_close()
        thread.join()


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
