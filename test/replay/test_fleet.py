"""A fleet from the first to the last command: the same result from a disk, from S3 and from SFTP."""

import json
import re
from pathlib import Path

import pyarrow.parquet as pq
import pytest
from command_line import command, refused
from served_stores import Bucket, name_s3_store, s3_server

from engine_mount.fleet import Fleet
from engine_mount.fleet.example import make_example

pytestmark = pytest.mark.slow

SETTINGS = {'continuous_viscous.half_amplitude': 0.00024}
RECORDINGS = 12
OF_THE_PLACE = ('uri', 'fingerprint')


@pytest.fixture(scope='module')
def drives(tmp_path_factory):
    folder = tmp_path_factory.mktemp('fleet') / 'drives'
    reasons = [done.reason for done in make_example(folder, RECORDINGS)]
    assert not any(reasons)
    return folder


@pytest.fixture(scope='module')
def local(drives):
    """Return the folder with catalogue and result of the drives on the disk, by two workers."""
    return asked(str(drives), drives.parent, workers=2)


@pytest.fixture
def home(tmp_path, monkeypatch):
    folder = tmp_path / 'home'
    folder.mkdir()
    monkeypatch.setenv('HOME', str(folder))
    monkeypatch.setenv('ENGINE_MOUNT_CACHE', str(folder / 'copies'))
    for name in ('AWS_PROFILE', 'SSH_AUTH_SOCK'):
        monkeypatch.delenv(name, raising=False)
    return folder


def asked(place, folder, workers):
    """Index and replay what lies at `place` into `folder`, which is returned."""
    fleet = Fleet([place], folder / 'catalogue', workers=workers)
    assert fleet.index().num_rows == fleet.replay(SETTINGS, folder / 'result').num_rows
    return folder


def table_of(folder):
    return (folder / 'result' / 'result.parquet').read_bytes()


def catalogue_of(folder):
    """Return both tables of a catalogue without what tells where the recordings lie."""
    tables = [pq.read_table(folder / 'catalogue' / f'{name}.parquet') for name in ('recordings', 'events')]
    return [table.drop([name for name in OF_THE_PLACE if name in table.schema.names]) for table in tables]


def test_every_recording_has_a_row_and_the_damaged_ones_a_reason(local):
    rows = pq.read_table(local / 'result' / 'result.parquet').to_pylist()
    assert len({row['recording'] for row in rows}) == RECORDINGS
    reasons = {row['recording'].partition('/')[2]: row['reason'] for row in rows}
    assert 'is no MCAP file' in reasons['19_garbage']
    assert 'holds no MCAP file' in reasons['19_no_data']
    assert reasons['19_truncated'] == ''
    told = {row['recording'].partition('/')[2]: row['reason'] for row in catalogue_of(local)[0].to_pylist()}
    assert 'without its footer' in told['19_truncated']
    assert 'metadata.yaml is missing' in told['19_no_metadata']
    assert re.search('lost|checksum', told['19_wrong_checksum'])  # in a chunk, or in an index between two
    done = [row for row in rows if not row['reason']]
    assert any(row['setpoints_differing'] for row in done)
    assert all(row['as_recorded'] for row in done if not row['recording'].endswith('18_middle'))  # too short


def test_one_worker_gives_the_bytes_of_two(drives, local, tmp_path):
    assert table_of(asked(str(drives), tmp_path, workers=1)) == table_of(local)


def test_a_store_of_objects_gives_the_bytes_of_the_disk(drives, local, tmp_path, home, monkeypatch):
    with s3_server() as port:
        name_s3_store(port, monkeypatch)
        bucket = Bucket(port)
        for file in drives.rglob('*'):
            if file.is_file():
                bucket.put(f'2026/{file.relative_to(drives)}', file.read_bytes())
        folder = asked('s3://drives/2026', tmp_path, workers=2)
        assert table_of(folder) == table_of(local)
        assert catalogue_of(folder) == catalogue_of(local)
        worst = command(
            'fleet', 'worst', folder / 'result', '--by', 'setpoint_difference_rms_a', '--count', 1
        )
        assert 'engine-mount report s3://drives/2026/' in worst


def test_the_commands_ask_and_report(local):
    result, found, page = (local / name for name in ('result', 'worst.json', 'page.html'))
    sql = "select recording, setpoint_difference_rms_a as rms from result where reason = '' order by rms desc"
    rows = json.loads(command('fleet', 'query', result, sql, '--format', 'json'))
    assert command('fleet', 'query', result, sql, '--format', 'csv').splitlines()[0] == '"recording","rms"'
    table = command('fleet', 'query', result, f'{sql} limit 1')
    assert rows[0]['recording'] in table
    assert table.endswith('1 row\n')
    assert all(len(line) <= 80 for line in table.splitlines())
    command('fleet', 'worst', result, '--by', 'setpoint_difference_rms_a', '--count', 2, '--json', found)
    worst = json.loads(found.read_text())['worst']
    assert [one['recording'] for one in worst] == [row['recording'] for row in rows[:2]]
    assert all(Path(one['uri']).is_dir() for one in worst)
    command('fleet', 'report', result, '--out', page, '--count', 1)
    text = page.read_text(encoding='utf-8')
    assert 'is no MCAP file' in text
    assert 'No picture' not in text
    said = refused('fleet', 'query', result, 'select nothing from result', codes=(2,))
    assert 'result has recording, mount, reason' in said
