"""Questions to a fleet: answered from its tables, and from nothing else."""

import pytest

from engine_mount.fleet.job import Column, table_of, write_table
from engine_mount.fleet.questions import QueryError, query

COLUMNS = (Column('uri', 'string', '', 'which'), Column('peak', 'double', 'm', 'largest displacement'))


@pytest.fixture
def catalogue(tmp_path):
    rows = [{'uri': 'a', 'peak': 0.001}, {'uri': 'b', 'peak': float('nan')}, {'uri': 'c', 'peak': 0.003}]
    write_table(table_of(COLUMNS, rows), tmp_path / 'recordings.parquet')
    (tmp_path / 'secret.csv').write_text('a,b\n1,2\n')
    return tmp_path


def test_a_question_is_answered_and_what_is_unknown_is_not_the_largest(catalogue):
    answer = query(catalogue, 'select max(peak) as peak, count(*) as n from recordings')
    assert answer.to_pylist() == [{'peak': 0.003, 'n': 3}]
    assert query(catalogue, 'select uri from recordings').column('uri').to_pylist() == ['a', 'b', 'c']


@pytest.mark.parametrize(
    ('file', 'sql', 'words'),
    [
        ('', 'select peek from recordings', r'"peek".*; recordings has uri, peak$'),
        ('', 'select * from events', r'events.*; tables: recordings$'),
        ('', 'selct uri', r'syntax error.*; tables: recordings$'),
        ('recordings.parquet', 'select 1', 'is a file; name the folder that it is in, {folder}$'),
        ('empty', 'select 1', 'engine-mount fleet index or replay makes one'),
        ('wrong', 'select 1', 'cannot be read'),
    ],
)
def test_a_wrong_question_is_refused_in_one_sentence_with_what_there_is(catalogue, file, sql, words):
    for name in ('empty', 'wrong'):
        (catalogue / name).mkdir()
    (catalogue / 'wrong' / 'result.parquet').write_text('nothing')
    with pytest.raises(QueryError, match=words.format(folder=catalogue)) as caught:
        query(catalogue / file, sql)
    assert '\n' not in str(caught.value)


@pytest.mark.parametrize(
    'sql',
    [
        "select * from '{folder}/secret.csv'",
        "select * from read_csv('{folder}/secret.csv')",
        "select * from read_parquet('{folder}/recordings.parquet')",
        "select * from glob('{folder}/*')",
        "select * from 'https://127.0.0.1:9/a.parquet'",
        "copy recordings to '{folder}/out.csv'",
        "attach '{folder}/other.db'",
        'install httpfs',
        'load httpfs',
        'set enable_external_access = true',
        'create table mine as select 1',
        'select 1; select 2',
        'delete from recordings',
        'select * from variable',
        '',
    ],
)
def test_a_question_reads_no_other_file_and_writes_nothing(catalogue, sql):
    before, variable = {file: file.read_bytes() for file in catalogue.iterdir()}, table_of(COLUMNS, [])
    with pytest.raises(QueryError) as caught:
        query(catalogue, sql.format(folder=catalogue))
    assert '\n' not in str(caught.value)
    assert {file: file.read_bytes() for file in catalogue.iterdir()} == before
    assert len(variable) == 0


def test_a_question_without_an_end_is_refused_after_a_time(catalogue):
    sql = 'select sum(a.range * b.range) from range(1000000000000) a, range(1000000) b'
    with pytest.raises(QueryError, match=r'^no answer within 0\.3 s \(limit\): .* --time-limit$'):
        query(catalogue, sql, time_limit=0.3)


def test_an_answer_of_too_many_rows_is_refused(catalogue):
    assert len(query(catalogue, 'select * from range(1000000)')) == 1_000_000
    with pytest.raises(QueryError, match=r'more than 1000000 rows \(limit\): aggregate, or add LIMIT$'):
        query(catalogue, 'select * from range(1000000000000)')
