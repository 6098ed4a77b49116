"""Files that are cut off, damaged or something else than their names say are read truly, or refused."""

import json

import numpy as np
import pytest
from foreign_files import MAKERS
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from engine_mount.signals.formats import excel
from engine_mount.signals.formats.content import Stated
from engine_mount.signals.formats.reading import headings, read
from engine_mount.signals.signal import SignalError
from engine_mount.signals.sources.source import SourceError

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


def _true(measured):
    """Whether the columns hold the numbers that were written, perhaps fewer of them."""
    for place, (name, (_, values)) in enumerate(COLUMNS.items()):
        found = [
            one for one in measured.columns.values() if one.name.rpartition('/')[2].split('.')[-1] == name
        ]
        found = found or [
            one for one in measured.columns.values() if one.name in (str(place), f'{name}.values')
        ]
        for column in found:
            known = column.values[~np.isnan(column.values)]
            assert np.isin(known.round(9), values.round(9)).all()


@pytest.mark.parametrize('kind', FILES)
def test_a_file_that_is_cut_off_is_refused_or_read_as_far_as_it_goes(whole, kind, tmp_path):
    file, content = whole[kind]
    for share in (0.0, 0.02, 0.3, 0.7, 0.97):
        path = tmp_path / file.path.name
        path.write_bytes(content[: int(share * len(content))])
        measured = _read_or_refused(path, file.stated)
        if measured is not None and kind not in ('csv', 'german_csv', 'text'):
            _true(measured)


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


def _refusal(path, columns=None, **stated):
    with pytest.raises(SignalError) as caught:
        read(path, columns, Stated(**stated))
    return str(caught.value)


def test_what_is_not_there_or_not_read_is_named(tmp_path):
    with pytest.raises(SourceError, match=r'no\.csv: no such file or folder'):
        read(tmp_path / 'no.csv')
    (tmp_path / 'empty.mf4').write_bytes(b'')
    assert 'is empty' in _refusal(tmp_path / 'empty.mf4')
    (tmp_path / 'a.wav').write_bytes(b'RIFF\0\0\0\0WAVE')
    assert 'a.wav: files of type .wav are not read; read are CSV' in _refusal(tmp_path / 'a.wav')
    (tmp_path / 'old.xls').write_bytes(b'\xd0\xcf\x11\xe0\xa1\xb1\x1a\xe1' + bytes(600))
    assert 'save it as .xlsx' in _refusal(tmp_path / 'old.xls')
    (tmp_path / 'folder').mkdir()
    assert 'is a folder without a recording' in _refusal(tmp_path / 'folder')


def test_a_log_without_its_database_or_with_another_is_refused(whole, tmp_path):
    file, _ = whole['blf']
    assert 'holds CAN frames; name the database that decodes them' in _refusal(file.path)
    other = tmp_path / 'other.dbc'
    other.write_text('VERSION ""\nBU_: A\nBO_ 9 Other: 8 A\n SG_ x : 0|8@1+ (1,0) [0|0] "" A\n')
    assert 'holds no frame that other.dbc names (0x100 (60), 0x101 (60))' in _refusal(file.path, dbc=other)
    other.write_text('nonsense')
    assert 'other.dbc is no readable database of CAN messages' in _refusal(file.path, dbc=other)


def test_times_and_values_of_different_length_are_refused(tmp_path):
    np.save(tmp_path / 'a_t.npy', TIMES[:-1])
    np.save(tmp_path / 'a_value.npy', TIMES)
    assert 'a_value.npy holds 60 samples, a_t.npy beside it 59 times' in _refusal(tmp_path / 'a_value.npy')


def test_a_cell_of_text_in_a_workbook_is_named(tmp_path):
    import openpyxl

    book = openpyxl.Workbook()
    for row in (['t', 'az'], [0.0, 1.0], [0.1, '1,5'], [0.2, 2.0]):
        book.active.append(row)
    book.save(tmp_path / 'x.xlsx')
    assert "sheet 'Sheet', cell B3: '1,5' is no number" in _refusal(tmp_path / 'x.xlsx')


def test_an_ambiguous_name_is_refused_with_the_full_ones(tmp_path):
    path = tmp_path / 'x.json'
    values = TIMES.tolist()
    path.write_text(json.dumps({'front': {'az': values}, 'rear': {'az': values}}))
    assert "column 'az' is ambiguous: front.az, rear.az" in _refusal(path, ['az'])
    assert headings(path)[1].name == 'rear.az'
    assert list(read(path, ['rear.az']).columns) == ['rear.az']
    assert list(read(path, ['1']).columns) == ['rear.az']


def test_json_names_line_and_column_of_a_fault(tmp_path):
    path = tmp_path / 'x.json'
    path.write_text('{"t": [0, 1],\n "az": [1 2]}')
    assert 'line 2, column 11: Expecting' in _refusal(path)
    path.write_text('{"data": [[0, 1], [1]]}')
    assert 'data[1] holds 1 values where others hold 2' in _refusal(path)
    path.write_text('{"a": 1}')
    assert 'holds no columns of numbers' in _refusal(path)


def test_rows_with_a_far_cell_are_refused_with_their_width(tmp_path, monkeypatch):
    import openpyxl

    monkeypatch.setattr(excel, 'MOST_CELLS', 100_000)
    book = openpyxl.Workbook()
    for row in range(1, 11):
        book.active[f'XFD{row}'] = 1.0
    book.save(tmp_path / 'wide.xlsx')
    assert 'more than 100000 cells (limit), 16384 in a row: remove' in _refusal(tmp_path / 'wide.xlsx')
