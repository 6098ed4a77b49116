"""A fleet that is ended in the middle: a sentence, and the same command goes on to the same table."""

import json
import resource
import shutil
import signal
import subprocess
import sys

import pytest
from references import REFERENCES_FOLDER
from served_stores import BreakingWay, Bucket, name_s3_store, s3_server

from engine_mount.drives.replay import parsed_changes
from engine_mount.fleet import job
from engine_mount.fleet.job import OUTAGES, WritingError
from engine_mount.fleet.replay import replay_fleet
from engine_mount.fleet.runner import Done
from engine_mount.signals.sources import remote
from engine_mount.signals.sources.uris import StoreAwayError

pytestmark = pytest.mark.slow

CHANGES = parsed_changes({'highest_current': 0.7})
NAMES = [f'{number}_{name}' for number in range(3) for name in ('gap', 'opening', 'rough')]
DONE = 2
"""Recordings that are finished when something happens."""
PATIENCE = 120.0  # s
GOES_ON = 'the same command goes on where it stopped'
GIVEN_UP = (
    rf'given up after {OUTAGES} recordings in a row \(what was done stands, and {GOES_ON}\): '
    r's3://drives/2026/.* \(2 attempts within'
)
COMMAND = """
import os, sys
from engine_mount.fleet import job

line, lines = job._line, []

def interrupted(*given):
    if len(lines) == {done}:
        os.kill({process}, {blow})
    lines.append(given)
    return line(*given)

if __name__ == '__main__':
    job._line = interrupted
    from engine_mount.cli.command import main
    main(sys.argv[1:])
"""


@pytest.fixture(scope='module')
def drives(tmp_path_factory):
    folder = tmp_path_factory.mktemp('fleet') / 'drives'
    for name in NAMES:
        shutil.copytree(REFERENCES_FOLDER / name[2:], folder / name)
    return folder


@pytest.fixture(scope='module')
def whole(drives):
    """Return the bytes of the table of a run that nothing ended."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(job, 'run_tasks', in_this_process)
        replayed(drives, drives.parent / 'whole')
        return table_in(drives.parent / 'whole')


@pytest.fixture
def inside(monkeypatch):
    """Let tasks run in this process, one after the other."""
    monkeypatch.setattr(job, 'run_tasks', in_this_process)


@pytest.fixture
def away(drives, tmp_path, monkeypatch):
    """Return the way to a store of objects with the recordings in `s3://drives/2026`."""
    monkeypatch.setenv('HOME', str(tmp_path))
    monkeypatch.setenv('ENGINE_MOUNT_CACHE', str(tmp_path / 'copies'))
    monkeypatch.delenv('AWS_PROFILE', raising=False)
    with s3_server() as port:
        name_s3_store(port, monkeypatch)
        bucket = Bucket(port)
        for name in NAMES:
            bucket.put_folder(drives / name, f'2026/{name}')
        way = BreakingWay(port, None)
        name_s3_store(way.port, monkeypatch)
        yield way
        way.close()


@pytest.fixture
def limited():
    """Give what limits the size of files of this process; the limit ends with the test."""
    before = resource.getrlimit(resource.RLIMIT_FSIZE)

    def limit(size):
        resource.setrlimit(resource.RLIMIT_FSIZE, (size if size else before[0], before[1]))

    yield limit
    limit(None)


def in_this_process(work, items, **_):
    """Do what `run_tasks` does, one after the other."""
    for place, item in enumerate(items):
        try:
            yield Done(place, work(item))
        except StoreAwayError as error:
            yield Done(place, None, str(error), error)


def replayed(place, out, **options):
    return replay_fleet([str(place)], CHANGES, out, **options)


def table_in(folder):
    return (folder / 'result.parquet').read_bytes()


def at(count, action):
    """Return what takes the progress of a run and calls `action` once, when `count` recordings are done."""

    def report(done, of):
        if done == count:
            action()

    return report


@pytest.mark.parametrize(
    ('blow', 'code', 'sentence'),
    [
        (signal.SIGKILL, -signal.SIGKILL, ''),
        (signal.SIGINT, 130, f'interrupted; what was done stands, and {GOES_ON}'),
    ],
)
def test_a_command_that_is_ended_goes_on_where_it_was(drives, whole, tmp_path, blow, code, sentence):
    ended = command(tmp_path, drives, 'os.getpid()', blow)
    assert ended.returncode == code
    assert sentence in ended.stderr
    gone_on_with(drives, tmp_path, whole, DONE)


def gone_on_with(drives, folder, whole, done=None):
    """Let the command go on without being ended, and hold its table against the uninterrupted one."""
    again = command(folder, drives, 0, 0, '--json', folder / 'figures.json')
    assert again.returncode == 0, again.stderr
    assert 'distributed' not in again.stdout + again.stderr
    before = json.loads((folder / 'figures.json').read_text())['done_before']
    assert DONE <= before < len(NAMES)
    assert done in (None, before)
    assert (folder / 'result' / 'result.parquet').read_bytes() == whole


def test_a_store_that_stays_away_ends_the_run_in_a_sentence(away, whole, tmp_path, inside, monkeypatch):
    monkeypatch.setattr(remote, 'ATTEMPTS', 2)
    monkeypatch.setattr(remote, 'FIRST_PAUSE', 1e-3)

    def goes():
        away.away = True

    with pytest.raises(StoreAwayError, match=GIVEN_UP):
        replayed('s3://drives/2026', tmp_path / 'result', progress=at(DONE, goes))
    away.away = False
    outcome = replayed('s3://drives/2026', tmp_path / 'result')
    assert outcome.figures['done_before'] == DONE
    assert table_in(tmp_path / 'result') == whole


def test_a_result_without_room_is_told_and_gone_on_with(drives, whole, tmp_path, inside, limited):
    sentence = rf'journal\.jsonl cannot be written: File too large; .*{GOES_ON}$'
    with pytest.raises(WritingError, match=sentence):
        replayed(
            drives,
            tmp_path / 'result',
            progress=at(DONE, lambda: limited((tmp_path / 'result' / 'journal.jsonl').stat().st_size + 100)),
        )
    limited(None)
    again = replayed(drives, tmp_path / 'result')
    assert again.figures['done_before'] == DONE
    assert table_in(tmp_path / 'result') == whole


def command(folder, drives, process, blow, *options):
    """Return what came of the command, in which `process` is ended by `blow` once `DONE` are finished."""
    script = folder / 'command.py'
    done = DONE if blow else -1
    script.write_text(COMMAND.format(done=done, process=process, blow=int(blow)), encoding='utf-8')
    settings = ['--set', 'highest_current=0.7', '--workers', '1']
    arguments = ['fleet', 'replay', drives, *settings, '--out', folder / 'result', *options]
    return subprocess.run(
        [sys.executable, str(script), *map(str, arguments)],
        capture_output=True,
        text=True,
        check=False,
        timeout=PATIENCE,
    )
