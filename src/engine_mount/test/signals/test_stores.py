"""Recordings out of stores: what comes is whole and right, or nothing comes, with one sentence."""

import shutil
import subprocess
import sys
import threading

import pytest
from served_stores import SECRET_KEY, BreakingWay, HttpStore, know_host

from engine_mount.signals.sources import remote
from engine_mount.signals.sources.stores import entries, fetched, local_copy, uri_of
from engine_mount.signals.sources.uris import SourceError, StoreAwayError

DATA = bytes(range(256)) * 8192  # 2 MB
FETCH = 'import sys; from engine_mount.signals.sources.stores import fetched; print(fetched(sys.argv[1]))'


@pytest.fixture(autouse=True)
def _short_pauses(monkeypatch):
    monkeypatch.setattr(remote, 'ATTEMPTS', 4)
    monkeypatch.setattr(remote, 'FIRST_PAUSE', 1e-3)


def files_of(folder):
    return {str(path.relative_to(folder)): path.read_bytes() for path in folder.rglob('*') if path.is_file()}


def wait_for(condition):
    pause = threading.Event()
    while not condition():
        pause.wait(0.01)


@pytest.fixture(params=['s3', 'sftp', 'http', 'memory'])
def store(request, reference):
    """Return the URI of a folder `drives` that holds the recording `run/gap`, in a store of each kind."""
    if request.param == 's3':
        request.getfixturevalue('s3').put_folder(reference, 'run/gap')
        yield 's3://drives'
        return
    if request.param == 'memory':
        import fsspec

        fsspec.filesystem('memory').put(str(reference), '/drives/run/gap', recursive=True)
        yield 'memory://drives'
        fsspec.filesystem('memory').rm('/drives', recursive=True)
        return
    served, folder = request.getfixturevalue({'sftp': 'sftp', 'http': 'web'}[request.param])
    shutil.copytree(reference, folder / 'drives' / 'run' / 'gap')
    yield f'sftp://127.0.0.1:{served}/drives' if request.param == 'sftp' else f'{served.uri}/drives'


@pytest.fixture(params=['sftp', 'http', 's3'])
def breaking(request, own_home, monkeypatch):
    """Return a way that can break to a store with the file `a.bin`, and its URI by that way."""
    served = request.getfixturevalue({'sftp': 'sftp', 'http': 'web', 's3': 's3'}[request.param])
    if request.param == 's3':
        served.put('a.bin', DATA)
        way = BreakingWay(served.port, None)
        monkeypatch.setenv('AWS_ENDPOINT_URL', f'http://127.0.0.1:{way.port}')
        yield way, 's3://drives/a.bin'
    else:
        server, folder = served
        (folder / 'a.bin').write_bytes(DATA)
        way = BreakingWay(server if request.param == 'sftp' else server.port, None)
        if request.param == 'sftp':
            know_host(own_home, way.port)
        yield way, f'{request.param}://127.0.0.1:{way.port}/a.bin'
    way.close()


def test_a_folder_and_a_file_of_it_come_whole_and_once(store, reference, monkeypatch):
    folder = fetched(f'{store}/run/gap/')
    assert folder.name == 'gap'
    assert files_of(folder) == files_of(reference)
    assert uri_of(folder / 'gap_0.mcap') == f'{store}/run/gap/'
    assert not uri_of(reference)
    done = []
    file = fetched(f'{store}/run/gap/gap_0.mcap', lambda *progress: done.append(progress))
    assert file.read_bytes() == (reference / 'gap_0.mcap').read_bytes()
    assert done[-1] == (file.stat().st_size, file.stat().st_size)
    monkeypatch.setattr(remote, '_fetch', None)
    assert fetched(f'{store}/run/gap/gap_0.mcap') == file


def test_the_files_of_a_store_are_listed_by_their_uris(store, reference):
    found = list(entries(f'{store}/run/'))
    names = ('accepted.yaml', 'gap_0.mcap', 'metadata.yaml')
    assert [entry.uri for entry in found] == [f'{store}/run/gap/{name}' for name in names]
    assert [entry.size for entry in found] == [(reference / name).stat().st_size for name in names]
    assert all(entry.etag for entry in found)
    for uri in (f'{store}/run/nothing.mcap', f'{store}/nothing'):
        with pytest.raises(SourceError, match='nothing of this name is there'):
            fetched(uri)


def test_what_is_changed_in_the_store_comes_anew(s3):
    s3.put('a.txt', b'one')
    first = fetched('s3://drives/a.txt')
    s3.put('a.txt', b'two')
    assert fetched('s3://drives/a.txt').read_bytes() == b'two'
    assert first.read_bytes() == b'one'


def test_a_connection_that_breaks_is_tried_again(breaking):
    way, uri = breaking
    way.bytes_each = 500_000

    def mend():
        wait_for(lambda: way.broken)
        way.bytes_each = None

    wait = threading.Thread(target=mend)
    wait.start()
    assert fetched(uri).read_bytes() == DATA
    wait.join()


def test_a_store_that_stays_away_ends_in_a_sentence_and_leaves_nothing(breaking, own_home):
    way, uri = breaking
    way.bytes_each = 500_000  # of a file of 2 MB
    with pytest.raises(StoreAwayError, match=r'a\.bin: .+ \(4 attempts within .*is the store reach') as end:
        fetched(uri)
    assert str(end.value).startswith(uri)
    assert not files_of(own_home / 'copies')
    way.away = True
    with pytest.raises(StoreAwayError, match='4 attempts'):
        fetched(uri)
    assert way.refused >= 3  # one attempt by the connection that was there


@pytest.mark.parametrize('status', [403, 404, 503])
def test_only_what_may_pass_is_tried_again(web, status):
    server, _ = web
    server.status = status
    with pytest.raises(SourceError) as refusal:
        fetched(f'{server.uri}/a.bin')
    assert ('attempts' in str(refusal.value)) == (status == 503)
    assert ('fsspec' in str(refusal.value)) == (status == 403)


def test_nobody_may_read_without_keys(s3, monkeypatch):
    s3.put('a.bin', b'x')
    for name in ('AWS_ACCESS_KEY_ID', 'AWS_SECRET_ACCESS_KEY'):
        monkeypatch.delenv(name)
    monkeypatch.setenv('AWS_EC2_METADATA_DISABLED', 'true')
    with pytest.raises(SourceError, match=r'AWS_ACCESS_KEY_ID'):
        fetched('s3://drives/a.bin')


def test_a_host_whose_key_is_not_known_is_refused(sftp, own_home):
    (own_home / '.ssh' / 'known_hosts').unlink()
    with pytest.raises(SourceError, match=r'not trusted.*known_hosts'):
        fetched(f'sftp://127.0.0.1:{sftp[0]}/a')


@pytest.mark.parametrize('change', ['a.bin', 'b.bin'])
def test_a_folder_that_changes_while_it_is_fetched_is_refused(sftp, own_home, change):
    port, folder = sftp
    (folder / 'run').mkdir()
    (folder / 'run' / 'a.bin').write_bytes(DATA)
    with pytest.raises(SourceError, match=r'was changed while it was fetched|bytes came instead of'):
        fetched(
            f'sftp://127.0.0.1:{port}/run',
            lambda done, of: (folder / 'run' / change).write_bytes(DATA + b'xyz'),
        )
    assert not files_of(own_home / 'copies')


def test_a_server_that_tells_no_size_is_refused(reference):
    server = HttpStore(reference, sizes=False)
    try:
        with pytest.raises(SourceError, match='does not tell the size'):
            fetched(f'{server.uri}/gap_0.mcap')
    finally:
        server.close()


def test_hidden_names_and_those_that_lead_out_of_the_folder_are_left_out(monkeypatch):
    class Files:
        def info(self, path):
            return {'type': 'directory'}

        def find(self, path, detail):
            return {
                f'drives/run/{name}': {'type': 'file', 'size': 1} for name in ('../../b', '.part/c', 'd/e')
            }

    monkeypatch.setattr(remote, '_filesystem', lambda uri: (Files(), 'drives/run'))
    assert [entry.uri for entry in entries('s3://drives/run')] == ['s3://drives/run/d/e']


def test_keys_are_written_nowhere(s3, own_home, caplog):
    caplog.set_level('DEBUG', logger='engine_mount.signals')
    s3.put('a.txt', b'content')
    with local_copy('s3://drives/a.txt'):
        written = [path.read_bytes() for path in own_home.rglob('*') if path.is_file()]
    assert b'content' in written
    assert not any(SECRET_KEY.encode() in data for data in written)
    assert SECRET_KEY not in caplog.text


def test_links_of_sftp_are_followed_and_letters_of_names_stay_as_they_are(sftp):
    port, folder = sftp
    (folder / 'run').mkdir()
    name = 'what? #1 100%25 é.txt'
    (folder / 'a.txt').write_bytes(b'behind the link')
    (folder / 'run' / name).symlink_to('../a.txt')
    assert files_of(fetched(f'sftp://127.0.0.1:{port}/run')) == {name: b'behind the link'}
    (entry,) = entries(f'sftp://127.0.0.1:{port}/run')
    assert fetched(entry.uri).name == name


def test_what_a_killed_process_left_is_not_taken_for_a_file(web, own_home):
    server, folder = web
    (folder / 'a.bin').write_bytes(DATA)
    server.gate.clear()
    with subprocess.Popen([sys.executable, '-c', FETCH, f'{server.uri}/a.bin']) as process:
        wait_for(lambda: server.asked['GET'] >= 1)
        process.kill()
    server.gate.set()
    assert [name.startswith('.part-') for name in files_of(own_home / 'copies')] == [True]
    assert fetched(f'{server.uri}/a.bin').read_bytes() == DATA
