"""What the tests share: an environment without keys and copies of the user, and stores to fetch from."""

from pathlib import Path

import pytest
from references import REFERENCES_FOLDER
from served_stores import Bucket, HttpStore, know_host, name_s3_store, s3_server, sftp_store


@pytest.fixture(autouse=True)
def own_home(tmp_path_factory, monkeypatch):
    """Give a home of its own, where copies go and keys are looked for."""
    home = tmp_path_factory.mktemp('home')
    for name in ('AWS_PROFILE', 'AWS_ENDPOINT_URL', 'SSH_AUTH_SOCK', 'ENGINE_MOUNT_CACHE_LIMIT'):
        monkeypatch.delenv(name, raising=False)
    monkeypatch.setenv('HOME', str(home))
    monkeypatch.setenv('XDG_CACHE_HOME', str(home / 'cache'))
    monkeypatch.setenv('ENGINE_MOUNT_CACHE', str(home / 'copies'))
    return home


@pytest.fixture
def reference() -> Path:
    """Return a recording of this project, a rosbag2 folder with one MCAP file."""
    return REFERENCES_FOLDER / 'gap'


@pytest.fixture(scope='session')
def s3_port():
    with s3_server() as port:
        yield port


@pytest.fixture
def s3(s3_port, monkeypatch) -> Bucket:
    """Return an empty bucket `drives` of a store of objects, which the environment names."""
    name_s3_store(s3_port, monkeypatch)
    return Bucket(s3_port)


@pytest.fixture
def sftp(tmp_path, own_home):
    """Return port and folder of an SFTP server whose key the user knows."""
    folder = tmp_path / 'served'
    folder.mkdir()
    with sftp_store(folder, own_home) as port:
        know_host(own_home, port)
        yield port, folder


@pytest.fixture
def web(tmp_path):
    """Return a server by HTTP and its folder."""
    folder = tmp_path / 'served'
    folder.mkdir()
    store = HttpStore(folder)
    yield store, folder
    store.close()
