"""What is listed of a file of others."""

import numpy as np
import pytest
from foreign_files import make_csv, make_mcap, make_mdf

from engine_mount.signals.formats.described import columns_table, described
from engine_mount.signals.formats.reading import is_foreign, read

TIMES = np.arange(11) / 100.0
COLUMNS = {'az': ('g', np.array([np.nan, *range(10)], float))}


def test_columns_are_told_with_unit_rate_span_and_range(tmp_path):
    (facts,) = described(read(make_mdf(tmp_path, 'x', TIMES, COLUMNS).path))
    assert facts == {
        'name': 'az', 'unit': 'g', 'samples': 11, 'missing': 1, 'least': 0.0, 'mean': 4.5, 'greatest': 9.0,
        'rate': pytest.approx(100.0), 'span': pytest.approx(0.1),
    }  # fmt: skip
    (row,) = columns_table([facts]).rows
    assert row == ('az', 'g', '11', '100 Hz', '0.1 s', '0 .. 9', '4.5')


def test_a_column_without_times_of_its_own_has_no_rate(tmp_path):
    facts = described(read(make_csv(tmp_path, 'x', TIMES, COLUMNS).path))
    assert facts[1]['rate'] is None
    assert [row[3:5] for row in columns_table(facts).rows] == [('', ''), ('', '')]


def test_a_recording_of_ros_is_none_of_others(tmp_path):
    assert is_foreign(make_csv(tmp_path, 'x', TIMES, COLUMNS).path)
    folder = make_mcap(tmp_path, 'bag', TIMES, COLUMNS).path
    assert not is_foreign(folder)
    assert not is_foreign(next(folder.glob('*.mcap')))
