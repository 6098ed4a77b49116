"""Questions to a fleet: answered from its tables, and from nothing else."""

import pytest

from engine_mount.fleet.questions import QueryError, query
from engine_mount.fleet.tables import Column, table_of, write_table

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


def test_a_wrong_column_is_told_in_one_sentence_with_those_that_exist(catalogue):
    with pytest.raises(QueryError) as caught:
        query(catalogue, 'select peek from recordings')
    sentence = str(caught.value)
    assert '"peek"' in sentence
    assert sentence.endswith('recordings has uri, peak')
    assert '\n' not in sentence


def test_a_wrong_table_is_told_with_those_that_exist(catalogue):
    with pytest.raises(QueryError, match=r'events.*; tables: recordings$'):
        query(catalogue, 'select * from events')


def test_a_question_that_names_no_table_is_told_the_tables_alone(catalogue):
    with pytest.raises(QueryError, match=r'syntax error.*; tables: recordings$'):
        query(catalogue, 'selct uri')


def test_a_file_in_place_of_its_folder_is_refused_with_the_folder(catalogue):
    with pytest.raises(QueryError, match=f'is a file; name the folder that it is in, {catalogue}$'):
        query(catalogue / 'recordings.parquet', 'select uri from recordings')


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
        '',
    ],
)
def test_a_question_reads_no_other_file_and_writes_nothing(catalogue, sql):
    before = {file: file.read_bytes() for file in catalogue.iterdir()}
    with pytest.raises(QueryError) as caught:
        query(catalogue, sql.format(folder=catalogue))
    assert '\n' not in str(caught.value)
    assert {file: file.read_bytes() for file in catalogue.iterdir()} == before


def test_no_variable_of_the_program_is_a_table(catalogue):
    catalogue_table = table_of(COLUMNS, [])
    assert len(catalogue_table) == 0
    with pytest.raises(QueryError):
        query(catalogue, 'select * from catalogue_table')


def test_a_folder_without_tables_is_refused(tmp_path):
    with pytest.raises(QueryError, match='engine-mount fleet index or replay makes one'):
        query(tmp_path, 'select 1')


def test_a_file_that_is_no_parquet_is_refused_in_a_sentence(tmp_path):
    (tmp_path / 'result.parquet').write_text('nothing')
    with pytest.raises(QueryError, match='cannot be read'):
        query(tmp_path, 'select * from result')


def test_a_question_without_an_end_is_refused_after_a_time(catalogue):
    sql = 'select sum(a.range * b.range) from range(1000000000000) a, range(1000000) b'
    with pytest.raises(QueryError, match=r'^no answer within 0\.3 s \(limit\): .* --time-limit$'):
        query(catalogue, sql, time_limit=0.3)


def test_an_answer_of_too_many_rows_is_refused(catalogue):
    assert len(query(catalogue, 'select * from range(1000000)')) == 1_000_000
    with pytest.raises(QueryError, match=r'more than 1000000 rows \(limit\): aggregate, or add LIMIT$'):
        query(catalogue, 'select * from range(1000000000000)')
