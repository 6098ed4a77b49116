"""The recordings to look at: ordered by a column, with the commands that open them."""

import json

import pytest

from engine_mount.fleet.questions import QueryError, query, result_of, worst
from engine_mount.fleet.tables import COLUMNS, table_of, write_table

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
    for name in 'abcd':
        (drives / name).mkdir(parents=True)
        (drives / name / f'{name}_0.mcap').touch()
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
    return folder


def test_the_largest_come_first_whatever_their_sign_and_unknown_ones_are_left_out(result):
    found = worst(result, BY)
    assert [(one.row['recording'], one.row['mount'], one.value) for one in found] == [
        ('b', 'left', -0.5),
        ('b', 'right', 0.3),
        ('c', '', 0.3),
        ('a', '', 0.1),
    ]
    assert [one.value for one in worst(result, BY, 2, lowest=True)] == [-0.5, 0.1]


def test_the_commands_name_the_place_the_mount_and_the_change(result):
    one = worst(result, BY, 1)[0]
    place = result.parent / 'my drives' / 'b'
    assert one.commands == [
        f"engine-mount report '{place}'",
        f"engine-mount replay '{place}' --mount left --set mount_control.switch_on_level=0.0006 "
        '--set mount_control.policy=switched_viscous',
    ]


def test_recordings_that_were_moved_are_told(result):
    drives = result.parent / 'my drives'
    drives.rename(result.parent / 'moved')
    with pytest.raises(QueryError, match='my drives: No such file or directory; what was moved is found by'):
        worst(result, BY)
    drives.symlink_to(result.parent / 'moved')
    assert worst(result, BY, 1)[0].uri == str(drives / 'b')


def test_a_column_without_numbers_is_refused_with_those_that_have_some(result):
    with pytest.raises(QueryError, match=r'is no column of numbers of result; there are size_bytes, '):
        worst(result, 'recording')
    with pytest.raises(QueryError, match=r'of result; did you mean pad_energy_j or pad_energy_changed_j\?$'):
        worst(result, 'pad_energi_j')


def test_an_unfinished_result_says_how_to_go_on(result):
    (result / 'result.parquet').unlink()
    with pytest.raises(QueryError, match='not finished; the same engine-mount fleet replay goes on with it'):
        result_of(result)


def test_the_catalogue_of_a_result_can_be_asked_with_it(result):
    catalogue = result.parent / 'catalogue'
    catalogue.mkdir()
    rows = [{'recording': 'a', 'mount': '', 'uri': 'x/a', 'scenario': 'bench'}]
    write_table(table_of(COLUMNS['recordings'], rows), catalogue / 'recordings.parquet')
    (result / 'order.json').write_text(json.dumps({'asked_for': [str(catalogue)]}))
    sql = 'select scenario from result join recordings using (recording, mount)'
    assert query(result, sql).to_pylist() == [{'scenario': 'bench'}]
    assert worst(result, BY)[-1].uri == 'x/a'
