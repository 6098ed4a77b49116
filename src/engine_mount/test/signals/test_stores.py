"""Recordings out of real stores: what comes is what lies there, once, and only as much as is needed."""

import shutil

import pytest
from served_stores import SECRET_KEY, HttpStore

from engine_mount.recordings.place import open_run
from engine_mount.recordings.session import recorded_session
from engine_mount.signals.sources import looking, outlines
from engine_mount.signals.sources.source import SourceError
from engine_mount.signals.sources.stores import entries, fetched, local_copy, outline, traffic, uri_of


def files_of(folder):
    return {str(path.relative_to(folder)): path.read_bytes() for path in folder.rglob('*') if path.is_file()}


def of_a_list(path):
    """Return what a list tells of a recording, and whether it is whole once that was read."""
    recording = open_run(path)
    counts = {name: topic.message_count for name, topic in recording.topics.items()}
    return recorded_session(recording), counts, recording.time_range, recording.whole


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


def test_a_file_comes_as_it_lies_in_the_store_and_once(store, reference):
    file = fetched(f'{store}/run/gap/gap_0.mcap')
    assert file.name == 'gap_0.mcap'
    assert file.read_bytes() == (reference / 'gap_0.mcap').read_bytes()
    before = traffic().bytes
    assert fetched(f'{store}/run/gap/gap_0.mcap') == file
    assert traffic().bytes == before


def test_a_folder_comes_whole(store, reference):
    folder = fetched(f'{store}/run/gap/')
    assert folder.name == 'gap'
    assert files_of(folder) == files_of(reference)
    assert uri_of(folder / 'gap_0.mcap') == f'{store}/run/gap/'
    assert not uri_of(reference)


def test_the_files_of_a_store_are_listed_by_their_uris(store, reference):
    found = list(entries(f'{store}/run/'))
    assert [entry.uri for entry in found] == [
        f'{store}/run/gap/{name}' for name in ('accepted.yaml', 'gap_0.mcap', 'metadata.yaml')
    ]
    assert [entry.size for entry in found] == [
        (reference / entry.uri.split('/')[-1]).stat().st_size for entry in found
    ]
    assert all(entry.etag or entry.modified > 0 for entry in found)
    assert fetched(found[1].uri).read_bytes() == (reference / 'gap_0.mcap').read_bytes()


def test_what_is_changed_in_the_store_comes_anew(s3):
    s3.put('a.txt', b'one')
    first = fetched('s3://drives/a.txt')
    s3.put('a.txt', b'two')
    assert fetched('s3://drives/a.txt').read_bytes() == b'two'
    assert first.read_bytes() == b'one'


def test_what_is_not_there_is_told(store):
    for uri in (f'{store}/run/nothing.mcap', f'{store}/nothing'):
        with pytest.raises(SourceError, match='nothing of this name is there'):
            fetched(uri)


def test_an_outline_lists_as_the_recording_does_and_reads_less(store, reference):
    before = traffic().bytes
    with outline(f'{store}/run/gap/') as folder:
        assert of_a_list(folder) == of_a_list(reference)
    read = traffic().bytes - before
    assert read < 0.6 * (reference / 'gap_0.mcap').stat().st_size  # a session and a summary of a short one
    assert not folder.exists()


@pytest.mark.parametrize('kept', [0.5, 0.97])
def test_a_recording_without_its_end_is_given_whole(s3, reference, kept):
    data = (reference / 'gap_0.mcap').read_bytes()
    s3.put('cut/cut_0.mcap', data[: int(kept * len(data))])
    with outline('s3://drives/cut') as folder:
        assert (folder / 'cut_0.mcap').read_bytes() == data[: int(kept * len(data))]


def test_an_outline_reads_the_session_behind_the_beginning_of_a_long_file(s3, reference, monkeypatch):
    monkeypatch.setattr(outlines, '_TAIL', 512)  # the summary is longer
    s3.put_folder(reference, 'gap')
    before = traffic().bytes
    with outline('s3://drives/gap') as folder:
        assert of_a_list(folder) == of_a_list(reference)
    assert traffic().bytes - before < 0.6 * (reference / 'gap_0.mcap').stat().st_size


def test_a_recording_with_a_damaged_summary_is_given_whole(s3, reference):
    data = bytearray((reference / 'gap_0.mcap').read_bytes())
    data[-1000] ^= 1
    s3.put('bad/bad_0.mcap', bytes(data))
    with outline('s3://drives/bad') as folder:
        assert (folder / 'bad_0.mcap').read_bytes() == data


def test_a_server_that_knows_no_stretches_serves_all_the_same(tmp_path, reference):
    store = HttpStore(reference, stretches=False)
    try:
        assert files_of(fetched(f'{store.uri}/').parent)
        with outline(f'{store.uri}/gap_0.mcap') as file:
            assert of_a_list(file) == of_a_list(reference)
    finally:
        store.close()


def test_a_server_that_tells_no_size_is_refused(tmp_path, reference):
    store = HttpStore(reference, sizes=False)
    try:
        with pytest.raises(SourceError, match='does not tell the size'):
            fetched(f'{store.uri}/gap_0.mcap')
    finally:
        store.close()


def test_a_host_whose_key_is_not_known_is_refused(sftp, own_home):
    (own_home / '.ssh' / 'known_hosts').unlink()
    with pytest.raises(SourceError, match=r'not trusted.*known_hosts'):
        fetched(f'sftp://127.0.0.1:{sftp[0]}/a')


def test_hidden_names_and_those_that_lead_out_of_the_folder_are_left_out(monkeypatch):
    class Files:
        def find(self, path, detail):
            return {
                f'drives/run/{name}': {'type': 'file', 'size': 1} for name in ('../../b', '.part/c', 'd/e')
            }

    monkeypatch.setattr(looking, 'filesystem', lambda uri: (Files(), 'drives/run'))
    assert [found.entry.uri for found in looking.look_inside('s3://drives/run')] == ['s3://drives/run/d/e']


def test_keys_are_written_nowhere(s3, own_home, caplog):
    caplog.set_level('DEBUG', logger='engine_mount.signals')
    s3.put('a.txt', b'content')
    with local_copy('s3://drives/a.txt'):
        written = [path.read_bytes() for path in own_home.rglob('*') if path.is_file()]
    assert b'content' in written
    assert not any(SECRET_KEY.encode() in data for data in written)
    assert SECRET_KEY not in caplog.text


def test_links_of_sftp_are_followed_to_files(sftp):
    port, folder = sftp
    (folder / 'run').mkdir()
    (folder / 'a.txt').write_bytes(b'behind the link')
    (folder / 'run' / 'link.txt').symlink_to('../a.txt')
    assert files_of(fetched(f'sftp://127.0.0.1:{port}/run')) == {'link.txt': b'behind the link'}


def test_letters_of_names_stay_as_they_are(sftp):
    port, folder = sftp
    name = 'what? #1 100%25 é.txt'
    (folder / name).write_bytes(b'x')
    (entry,) = entries(f'sftp://127.0.0.1:{port}/')
    assert fetched(entry.uri).name == name


def test_the_recordings_of_a_folder_in_a_store_are_found(s3):
    for key in (
        'day/a/metadata.yaml', 'day/a/a_0.mcap', 'day/b/recording/metadata.yaml', 'day/b/summary.json',
        'day/b/log/x.txt', 'day/c/notes.txt', 'day/d/deeper/d_0.mcap', 'day/e.csv',
    ):  # fmt: skip
        s3.put(key, b'x')
    assert outlines.recordings_at('s3://drives/day') == ['s3://drives/day/a', 's3://drives/day/b']
    assert outlines.recordings_at('s3://drives/day/b') == ['s3://drives/day/b']
    assert outlines.recordings_at('s3://drives/day/a/a_0.mcap') == ['s3://drives/day/a/a_0.mcap']
