"""Tables of a fleet: declared columns, unknown is null, the same bytes from the same rows."""

import math

import pytest

from engine_mount.fleet.job import COLUMNS as DECLARED
from engine_mount.fleet.job import Column, schema_of, table_of, write_table

COLUMNS = (
    Column('recording', 'string', '', 'URI of the recording'),
    Column('peak', 'double', 'm', 'largest displacement'),
    Column('events', 'int64', '', 'how many there are'),
)


def test_unknown_is_null():
    table = table_of(COLUMNS, [{'recording': 'a', 'peak': math.nan, 'events': 3}, {'recording': 'b'}])
    assert table.to_pylist() == [
        {'recording': 'a', 'peak': None, 'events': 3},
        {'recording': 'b', 'peak': None, 'events': None},
    ]


def test_a_name_that_is_no_column_is_refused():
    with pytest.raises(ValueError, match=r'peek: no such column; there are events, peak, recording'):
        table_of(COLUMNS, [{'peek': 1.0}])


def test_unit_and_meaning_are_read_back_and_the_bytes_are_the_same_each_time(tmp_path):
    pq = pytest.importorskip('pyarrow.parquet')
    files = [tmp_path / 'a.parquet', tmp_path / 'b.parquet']
    for file in files:
        write_table(table_of(COLUMNS, [{'recording': 'a', 'peak': 0.001, 'events': 1}]), file)
    read = pq.read_schema(files[0])
    assert read.field('peak').metadata[b'unit'] == b'm'
    assert read.equals(schema_of(COLUMNS), check_metadata=True)
    assert files[0].read_bytes() == files[1].read_bytes()
    assert sorted(tmp_path.iterdir()) == files


def test_what_has_a_unit_in_its_name_has_the_same_in_its_metadata():
    units = {
        '_m': 'm',
        '_s': 's',
        '_a': 'A',
        '_j': 'J',
        '_n': 'N',
        '_degc': 'degC',
        '_bytes': 'B',
        '_ns': 'ns',
    }
    for name, _, unit, meaning in (column for columns in DECLARED.values() for column in columns):
        assert unit == units.get(name[name.rfind('_') :], ''), name
        assert meaning
