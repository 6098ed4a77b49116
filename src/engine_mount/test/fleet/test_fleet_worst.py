"""The recordings to look at: ordered by a column, with the commands that open them."""

import json

import pytest

from engine_mount.fleet.job import COLUMNS, table_of, write_table
from engine_mount.fleet.questions import QueryError, query, result_of, worst

CHANGES = json.dumps({'mount_control': {'switch_on_level': 0.0006, 'policy': 'switched_viscous'}})
BY = 'setpoint_difference_largest_a'


def row(recording, value, mount=''):
    return {
        'recording': recording,
        'mount': mount,
        'reason': '',
        'asked': 'setpoints',
        'changes': CHANGES,
        BY: value,
    }


@pytest.fixture
def result(tmp_path):
    drives = tmp_path / 'my drives'
    folder = tmp_path / 'result'
    folder.mkdir()
    rows = [
        row('a', 0.1),
        row('b', -0.5, 'left'),
        row('c', 0.3),
        row('d', float('nan')),
        row('b', 0.3, 'right'),
    ]
    write_table(table_of(COLUMNS['result'], rows), folder / 'result.parquet')
    (folder / 'order.json').write_text(json.dumps({'asked_for': [str(drives)]}))
    lines = [[str(drives / row['recording']), 'mark', {'result': [row]}] for row in rows]
    (folder / 'journal.jsonl').write_text('\n'.join(map(json.dumps, [{}, *lines])) + '\n')
    return folder


def test_the_largest_come_first_whatever_their_sign_and_unknown_ones_are_left_out(result):
    found = worst(result, BY)
    assert [(one.row['recording'], one.row['mount'], one.row[BY]) for one in found] == [
        ('b', 'left', -0.5),
        ('b', 'right', 0.3),
        ('c', '', 0.3),
        ('a', '', 0.1),
    ]


def test_the_commands_name_the_place_the_mount_and_the_change(result):
    one = worst(result, BY, 1)[0]
    place = result.parent / 'my drives' / 'b'
    assert one.commands == [
        f"engine-mount report '{place}'",
        f"engine-mount replay '{place}' --position left --set mount_control.switch_on_level=0.0006 "
        '--set mount_control.policy=switched_viscous',
    ]


def test_a_column_without_numbers_is_refused_with_those_that_have_some(result):
    with pytest.raises(QueryError, match=r'is no column of numbers of result; known are size_bytes, '):
        worst(result, 'recording')


def test_an_unfinished_result_says_how_to_go_on(result):
    (result / 'result.parquet').unlink()
    with pytest.raises(QueryError, match='replay makes one, or goes on where it stopped'):
        result_of(result)


def test_the_catalogue_of_a_result_can_be_asked_with_it(result):
    catalogue = result.parent / 'catalogue'
    catalogue.mkdir()
    rows = [{'recording': 'a', 'mount': '', 'uri': 'x/a', 'scenario': 'bench'}]
    write_table(table_of(COLUMNS['recordings'], rows), catalogue / 'recordings.parquet')
    (result / 'order.json').write_text(json.dumps({'asked_for': [str(catalogue)]}))
    sql = 'select scenario from result join recordings using (recording, mount)'
    assert query(result, sql).to_pylist() == [{'scenario': 'bench'}]
