"""Stores that break, lie, change or are full: what is fetched is whole and right, or nothing is."""

import errno
import logging
import subprocess
import sys
import threading
from dataclasses import replace
from itertools import count

import pytest
from served_stores import BreakingWay, know_host

from engine_mount.signals.sources import fetching, patience, reading
from engine_mount.signals.sources.filesystems import forget_connections
from engine_mount.signals.sources.patience import Attempts, Patience
from engine_mount.signals.sources.reasons import is_lasting
from engine_mount.signals.sources.remote import RemoteStore
from engine_mount.signals.sources.source import SourceError, StoreAwayError
from engine_mount.signals.sources.stores import fetched, traffic

pytestmark = pytest.mark.slow

DATA = bytes(range(256)) * 8192  # 2 MB
SHORT = Patience(attempts=4, first=1e-3, longest=1e-3, seed=1)
FETCH = 'import sys; from engine_mount.signals.sources.stores import fetched; print(fetched(sys.argv[1]))'


@pytest.fixture
def copies(own_home):
    return own_home / 'copies'


def left_in(copies):
    return [path for path in copies.rglob('*') if path.is_file() and path.name not in ('lock', '.room')]


def wait_for(condition):
    pause = threading.Event()
    while not condition():
        pause.wait(0.01)


@pytest.fixture(params=['sftp', 'http'])
def breaking(request, own_home):
    """Return a way that breaks to a store with the file `a.bin`, and its URI by that way."""
    served, folder = request.getfixturevalue({'sftp': 'sftp', 'http': 'web'}[request.param])
    (folder / 'a.bin').write_bytes(DATA)
    way = BreakingWay(served if request.param == 'sftp' else served.port, None)
    if request.param == 'sftp':
        know_host(own_home, way.port)
    yield way, f'{request.param}://127.0.0.1:{way.port}/a.bin'
    way.close()


def test_a_connection_that_breaks_is_gone_on_with(breaking, copies, monkeypatch):
    way, uri = breaking
    monkeypatch.setattr(reading, 'BLOCK', 50_000)
    way.bytes_each = 350_000  # so that it breaks more often than there are attempts
    by_http = uri.startswith('http')
    # What aiohttp has not handed over when the connection breaks is lost: an attempt may bring nothing.
    patient = replace(SHORT, attempts=1000) if by_http else SHORT
    before = traffic().bytes
    assert RemoteStore(patient).fetch(uri, copies).read_bytes() == DATA
    assert way.broken > SHORT.attempts
    assert traffic().bytes - before < 1.7 * len(DATA)  # from where it broke, not from the beginning


def test_a_store_that_is_away_for_a_while_is_waited_for(breaking, copies):
    way, uri = breaking
    way.away = True
    patient = Patience(attempts=1000, first=0.01, longest=0.01)
    fetching_it = threading.Thread(target=RemoteStore(patient).fetch, args=(uri, copies))
    fetching_it.start()
    wait_for(lambda: way.refused >= 3)
    way.away = False
    fetching_it.join()
    assert [path.read_bytes() for path in left_in(copies)] == [DATA]


def test_a_store_that_stays_away_ends_in_a_sentence(breaking, copies):
    way, uri = breaking
    way.away = True
    with pytest.raises(SourceError, match=r'a\.bin: .+ \(4 attempts.*\); is the store reachable') as end:
        RemoteStore(SHORT).fetch(uri, copies)
    assert str(end.value).startswith(uri)
    assert way.refused >= 4
    assert not left_in(copies)


def test_a_store_that_goes_away_in_the_middle_for_ever_leaves_nothing(breaking, copies, monkeypatch):
    way, uri = breaking
    monkeypatch.setattr(reading, 'BLOCK', 100_000)

    def tell(done, of):
        way.away = done > 500_000

    with pytest.raises(SourceError, match='4 attempts'):
        RemoteStore(SHORT).hold(uri, copies, tell)
    assert not left_in(copies)


def test_a_connection_that_breaks_is_told_by_the_error_alone(breaking, copies, caplog):
    way, uri = breaking
    way.bytes_each = 500_000
    with pytest.raises(SourceError):
        RemoteStore(replace(SHORT, attempts=1)).fetch(uri, copies)
    logging.getLogger('asyncio').error('Task exception was never retrieved\nfuture: one of several requests')
    logging.getLogger('asyncio').error('another fault')
    assert [record.getMessage() for record in caplog.records] == ['another fault']


@pytest.mark.parametrize('seed', range(20))
def test_the_pauses_outlast_a_store_that_is_away_for_20_s(seed):
    assert 20.0 < sum(Patience(seed=seed).pauses()) < 60.0
    assert list(Patience(seed=seed).pauses()) == list(Patience(seed=seed).pauses())
    assert list(Patience(seed=seed).pauses()) != list(Patience(seed=seed + 1).pauses())


def test_progress_gives_new_patience(monkeypatch):
    paused = []
    attempts = Attempts('https://host/a', SHORT, paused.append)
    for _ in range(5):
        attempts.failed(ConnectionError('reset'))
        attempts.progress()
    assert len(paused) == 5
    for _ in range(3):
        attempts.failed(ConnectionError('reset'))
    with pytest.raises(SourceError, match=r'ConnectionError: reset \(4 attempts'):
        attempts.failed(ConnectionError('reset'))


def test_a_store_that_takes_requests_and_never_answers_uses_up_the_time_not_the_attempts(monkeypatch):
    now, silence = [0.0], 30.0
    monkeypatch.setattr(patience.time, 'monotonic', lambda: now[0])
    limits = Patience(seed=1)

    def wait_in_vain(attempts, times=limits.attempts):
        for _ in range(times):
            now[0] += silence
            attempts.failed(TimeoutError('no byte'))

    attempts = Attempts('https://host/a', limits, lambda pause: None)
    wait_in_vain(attempts, 1)
    attempts.progress()
    begin = now[0]
    with pytest.raises(StoreAwayError, match='4 attempts'):
        wait_in_vain(attempts)
    assert now[0] - begin <= limits.standstill + silence


@pytest.mark.parametrize(('status', 'requests'), [(404, 2), (403, 2), (503, 8)])
def test_only_what_may_pass_is_asked_for_again(web, copies, monkeypatch, status, requests):
    store, _ = web
    store.status = status
    with pytest.raises(SourceError) as refusal:
        RemoteStore(SHORT).fetch(f'{store.uri}/a.bin', copies)
    assert sum(store.asked.values()) == requests  # HEAD, and GET where HEAD fails
    assert ('attempts' in str(refusal.value)) == (status == 503)
    assert ('fsspec' in str(refusal.value)) == (status == 403)


def test_refusals_of_the_libraries_are_known_as_such():
    import asyncssh
    from aiohttp import ClientConnectionError, ServerDisconnectedError

    lasting = [asyncssh.HostKeyNotVerifiable('x'), asyncssh.PermissionDenied('x')]
    passing = [
        asyncssh.ConnectionLost('x'),
        ClientConnectionError(),
        ServerDisconnectedError(),
        TimeoutError(),
        OSError(errno.EIO, 'x'),
    ]
    assert all(map(is_lasting, lasting))
    assert not any(
        map(is_lasting, [*passing, ClientConnectionError(), ServerDisconnectedError(), OSError(5, 'x')])
    )


def test_nobody_may_read_without_keys(s3, copies, monkeypatch):
    s3.put('a.bin', b'x')
    for name in ('AWS_ACCESS_KEY_ID', 'AWS_SECRET_ACCESS_KEY'):
        monkeypatch.delenv(name)
    monkeypatch.setenv('AWS_EC2_METADATA_DISABLED', 'true')
    forget_connections('s3://drives')
    with pytest.raises(SourceError, match=r'AWS_ACCESS_KEY_ID'):
        RemoteStore(SHORT).fetch('s3://drives/a.bin', copies)


def spoiled(monkeypatch, times):
    """Let the first blocks that come, so many `times`, have a wrong byte."""
    plain, numbers = fetching.blocks, count()

    def blocks(uri, begin, size):
        for block in plain(uri, begin, size):
            yield bytes([block[0] ^ 1]) + block[1:] if next(numbers) < times else block

    monkeypatch.setattr(fetching, 'blocks', blocks)
    return numbers


@pytest.mark.parametrize('how', [{}, {'ChecksumAlgorithm': 'SHA256'}, {'ChecksumAlgorithm': 'CRC32'}])
def test_a_spoiled_file_is_fetched_again_and_a_damaged_one_refused(s3, copies, monkeypatch, how):
    s3.put('a.bin', DATA, **how)
    spoiled(monkeypatch, 1)
    assert RemoteStore(SHORT).fetch('s3://drives/a.bin', copies).read_bytes() == DATA
    spoiled(monkeypatch, 100)
    with pytest.raises(SourceError, match='another checksum'):
        RemoteStore(SHORT).fetch('s3://drives/a.bin', copies.with_name('others'))
    assert not left_in(copies.with_name('others'))


def test_a_file_that_was_stored_in_parts_comes_although_its_tag_is_no_checksum(s3, copies):
    s3.put_in_parts('a.bin', DATA * 4, 5 << 20)
    assert RemoteStore(SHORT).fetch('s3://drives/a.bin', copies).read_bytes() == DATA * 4


def test_a_file_that_is_changed_while_it_is_fetched_is_refused(sftp, s3, copies, monkeypatch):
    port, folder = sftp
    (folder / 'a.bin').write_bytes(DATA)
    with pytest.raises(SourceError, match='was changed while it was fetched'):
        RemoteStore(SHORT).hold(
            f'sftp://127.0.0.1:{port}/a.bin', copies, lambda *_: (folder / 'a.bin').write_bytes(DATA[:100])
        )
    s3.put('a.bin', DATA)
    plain = fetching.blocks

    def blocks(uri, begin, size):
        s3.put('a.bin', DATA[::-1])
        yield from plain(uri, begin, size)

    monkeypatch.setattr(fetching, 'blocks', blocks)
    with pytest.raises(SourceError, match='was changed while it was fetched'):
        RemoteStore(SHORT).fetch('s3://drives/a.bin', copies)
    assert not left_in(copies)


def test_a_folder_that_grows_while_it_is_fetched_is_refused(sftp, copies):
    port, folder = sftp
    (folder / 'run').mkdir()
    (folder / 'run' / 'a.bin').write_bytes(DATA)
    with pytest.raises(SourceError, match='was changed while it was fetched'):
        RemoteStore(SHORT).hold(
            f'sftp://127.0.0.1:{port}/run', copies, lambda *_: (folder / 'run' / 'b.bin').write_bytes(b'x')
        )
    assert not left_in(copies)


def test_a_disk_that_becomes_full_leaves_no_half_file(web, copies, monkeypatch):
    store, folder = web
    (folder / 'a.bin').write_bytes(DATA)
    plain, numbers = fetching.write_whole, count()

    def write(handle, data, place):
        if next(numbers) == 0:
            plain(handle, data[: len(data) // 2], place)
            raise OSError(errno.ENOSPC, 'No space left on device')
        plain(handle, data, place)

    monkeypatch.setattr(fetching, 'write_whole', write)
    with pytest.raises(SourceError, match=r'2.1 MB are needed in .*copies, .* are free on its disk'):
        fetched(f'{store.uri}/a.bin')
    assert not left_in(copies)
    assert fetched(f'{store.uri}/a.bin').read_bytes() == DATA


def started(uri):
    return subprocess.Popen([sys.executable, '-c', FETCH, uri], stdout=subprocess.PIPE, text=True)


def test_two_processes_fetch_a_file_once(web, copies):
    store, folder = web
    (folder / 'a.bin').write_bytes(DATA)
    store.gate.clear()
    both = [started(f'{store.uri}/a.bin') for _ in range(2)]
    wait_for(lambda: store.asked['HEAD'] >= 2 and store.asked['GET'] >= 1)
    store.gate.set()
    places = {process.communicate()[0] for process in both}
    assert [process.returncode for process in both] == [0, 0]
    assert len(places) == 1
    assert store.asked['GET'] == 1
    assert [path.read_bytes() for path in left_in(copies)] == [DATA]


def test_what_a_killed_process_left_is_not_taken_for_a_file(web, copies):
    store, folder = web
    (folder / 'a.bin').write_bytes(DATA)
    store.gate.clear()
    with started(f'{store.uri}/a.bin') as process:
        wait_for(lambda: store.asked['GET'] >= 1)
        process.kill()
    (part,) = left_in(copies)
    assert part.parent.name == 'part'
    assert part.stat().st_size == len(DATA)  # its room was taken
    store.gate.set()
    assert fetched(f'{store.uri}/a.bin').read_bytes() == DATA
    assert [path.read_bytes() for path in left_in(copies)] == [DATA]
