"""Files that are cut off, damaged or something else than their names say are read truly, or refused."""

import json

import numpy as np
import pytest
from foreign_files import MAKERS
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from engine_mount.signals.formats import excel
from engine_mount.signals.formats.content import Stated
from engine_mount.signals.formats.reading import read
from engine_mount.signals.signal import SignalError
from engine_mount.signals.sources.uris import SourceError

N = 60
TIMES = np.arange(N) / 100.0
COLUMNS = {'az': ('g', np.sin(TIMES)), 'travel': ('mm', np.cos(TIMES))}
FILES = sorted(set(MAKERS) - {'npy', 'comma2k19', 'mcap', 'db3_zstd'})
SUFFIXES = (
    'csv', 'txt', 'json', 'jsonl', 'npy', 'npz', 'parquet', 'mat', 'h5', 'xlsx', 'mf4', 'mdf', 'blf', 'asc',
    'log', 'trc', 'mcap', 'db3', 'db3.zstd', 'dat',
)  # fmt: skip


@pytest.fixture(scope='module')
def whole(tmp_path_factory):
    """Return every format once: its file, and its bytes."""
    made = {kind: MAKERS[kind](tmp_path_factory.mktemp(kind), 'x', TIMES, COLUMNS) for kind in FILES}
    return {kind: (file, file.path.read_bytes()) for kind, file in made.items()}


def _read_or_refused(path, stated):
    try:
        return read(path, None, stated)
    except SignalError as error:
        assert str(path) in str(error) or path.name in str(error)  # noqa: PT017
        assert '\n' not in str(error)  # noqa: PT017
        return None


@pytest.mark.parametrize('kind', FILES)
def test_a_file_that_is_cut_off_is_refused_or_read_as_far_as_it_goes(whole, kind, tmp_path):
    file, content = whole[kind]
    for share in (0.0, 0.02, 0.3, 0.7, 0.97):
        path = tmp_path / file.path.name
        path.write_bytes(content[: int(share * len(content))])
        measured = _read_or_refused(path, file.stated)
        if measured is None or kind in ('csv', 'german_csv', 'text'):
            continue
        for place, (name, (_, values)) in enumerate(COLUMNS.items()):
            names = (name, f'{name}.values', str(place))
            for column in measured.columns.values():
                if column.name in names or column.name.endswith((f'/{name}', f'.{name}')):
                    known = column.values[~np.isnan(column.values)]
                    assert np.isin(known.round(9), values.round(9)).all()


@pytest.mark.parametrize('suffix', SUFFIXES)
@given(data=st.binary(min_size=1, max_size=400))
@settings(max_examples=15, suppress_health_check=[HealthCheck.function_scoped_fixture])
def test_garbage_is_refused_in_a_sentence_by_every_format(tmp_path, suffix, data, whole):
    path = tmp_path / f'x.{suffix}'
    path.write_bytes(data)
    _read_or_refused(path, Stated(dbc=whole['blf'][0].stated.dbc))


@pytest.mark.parametrize('kind', FILES)
@given(place=st.floats(0.0, 0.999), noise=st.binary(min_size=1, max_size=30))
@settings(max_examples=8, suppress_health_check=[HealthCheck.function_scoped_fixture])
def test_a_damaged_file_is_refused_or_read(whole, kind, tmp_path, place, noise):
    file, content = whole[kind]
    path = tmp_path / file.path.name
    begin = int(place * len(content))
    path.write_bytes(content[:begin] + noise + content[begin + len(noise) :])
    _read_or_refused(path, file.stated)


# nothing of a library reaches the screen, its failing destructors included
pytestmark = pytest.mark.filterwarnings('error::pytest.PytestUnraisableExceptionWarning')


def _refusal(path, columns=None, **stated):
    with pytest.raises(SignalError) as caught:
        read(path, columns, Stated(**stated))
    return str(caught.value)


def test_what_is_not_there_or_not_read_is_named(tmp_path):
    with pytest.raises(SourceError, match=r'no\.csv: no such file or folder'):
        read(tmp_path / 'no.csv')
    contents = {
        'empty.mf4': (b'', 'is empty'),
        'a.wav': (b'RIFF\0\0\0\0WAVE', 'type .wav are not read; read are CSV'),
        'old.xls': (b'\xd0\xcf\x11\xe0', 'save it as .xlsx'), 'a.bag': (b'#ROSBAG V2.0\n', 'rosbags-convert'),
        'ride.fit': (b'\x0e\x10\0\0\0\0\0\0.FIT\0\0', 'export it as CSV'),
        'a.csv': (b'version https://git-lfs.github.com/spec/v1\n', 'git lfs pull'),
    }  # fmt: skip
    for name, (content, reason) in contents.items():
        (tmp_path / name).write_bytes(content)
        assert reason in _refusal(tmp_path / name)
    (tmp_path / 'folder').mkdir()
    assert 'is a folder without a recording' in _refusal(tmp_path / 'folder')


def test_times_and_values_of_different_length_are_refused(tmp_path):
    np.save(tmp_path / 'a_t.npy', TIMES[:-1])
    np.save(tmp_path / 'a_value.npy', TIMES)
    assert 'a_value.npy holds 60 samples, a_t.npy beside it 59 times' in _refusal(tmp_path / 'a_value.npy')


def _book(path, *rows):
    import openpyxl

    book = openpyxl.Workbook()
    for row in rows:
        book.active.append(row)
    book.save(path)
    return path


def test_a_column_of_a_workbook_that_begins_late_is_read_and_a_cell_of_text_is_named(tmp_path):
    rows = (['t', 'az', None, 'sum'], ['s', 'g'], [0.0, 1.0], [0.1, 1.5, 7.0], [0.2, 2.0])
    measured = read(_book(tmp_path / 'x.xlsx', *rows))
    units = {one.name: one.unit for one in measured.columns.values()}
    assert units == {'t': 's', 'az': 'g', '2': '', 'sum': ''}
    np.testing.assert_array_equal(measured.column('2').values, [np.nan, 7.0, np.nan])
    assert 'sum: 3 of 3 samples hold no number' in measured.notes
    path = _book(tmp_path / 'x.xlsx', ['t', 'az'], [0.0, 1.0], [0.1, '1,5'], [0.2, 2.0], [0.3, 3.0])
    assert f"{path}, sheet Sheet, line 3, column 'az': '1,5' is no number" in _refusal(path)


def test_rows_with_a_far_cell_are_refused_with_their_width(tmp_path, monkeypatch):
    monkeypatch.setattr(excel, 'MOST_CELLS', 100_000)
    path = _book(tmp_path / 'wide.xlsx', *([1.0, *[None] * 16382, 1.0] for _ in range(10)))
    assert 'more than 100000 cells (limit), 16384 in a row: remove' in _refusal(path)


def test_invalid_samples_of_mdf_have_their_times_and_a_channel_of_text_is_left_out(tmp_path):
    from asammdf import MDF, Signal

    path, invalid = tmp_path / 'x.mf4', TIMES < 0.1
    words = np.array([b'on'] * N)
    with MDF(version='4.10') as file:
        file.append([
            Signal(np.cos(TIMES), TIMES, name='az', invalidation_bits=invalid),
            Signal(np.sin(TIMES), TIMES, name='travel'), Signal(words, TIMES, name='state', encoding='utf-8'),
        ])  # fmt: skip
        file.save(path)
    measured = read(path)
    assert list(measured.columns) == ['az', 'travel']
    np.testing.assert_array_equal(measured.column('az').values, np.where(invalid, np.nan, np.cos(TIMES)))
    np.testing.assert_array_equal(measured.column('az').time.times, TIMES)
    assert "channel 'state'" in ' '.join(measured.notes)
    assert "channel 'state': |S2 of shape (60,) is no number" in _refusal(path, ['state'])
    plain = path.read_bytes()
    path.write_bytes(b'UnFinMF ' + plain[8:60] + b'\x20\0' + plain[62:])
    np.testing.assert_array_equal(read(path, ['travel']).column('travel').values, np.sin(TIMES))
    assert path.read_bytes()[:8] == b'UnFinMF '


def test_an_ambiguous_name_is_refused_with_the_full_ones(tmp_path):
    path = tmp_path / 'x.json'
    values = TIMES.tolist()
    path.write_text(json.dumps({'front': {'az': values}, 'rear': {'az': values}}))
    assert "column 'az' is ambiguous: front.az, rear.az" in _refusal(path, ['az'])
    for name in ('rear.az', '1'):
        assert list(read(path, [name]).columns) == ['rear.az']


@pytest.mark.parametrize(
    ('text', 'reason'),
    [
        ('{"t": [0, 1],\n "az": [1 2]}', 'line 2, column 11: Expecting'),
        ('{"data": [[0, 1], [1]]}', 'data[1] holds 1 values where others hold 2'),
        ('{"a": 1}', 'holds no columns of numbers'),
    ],
)
def test_json_names_the_place_of_a_fault(tmp_path, text, reason):
    (tmp_path / 'x.json').write_text(text)
    assert reason in _refusal(tmp_path / 'x.json')
