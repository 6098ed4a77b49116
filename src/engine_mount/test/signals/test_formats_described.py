"""What is listed of a file of others."""

import numpy as np
import pytest
from foreign_files import make_csv, make_mcap, make_mdf

from engine_mount.signals.formats.measured import columns_table, described
from engine_mount.signals.formats.reading import is_foreign, read

TIMES = np.arange(11) / 100.0
COLUMNS = {'az': ('g', np.array([np.nan, *range(10)], float))}


def test_columns_are_told_with_unit_rate_span_and_range(tmp_path):
    (facts,) = described(read(make_mdf(tmp_path, 'x', TIMES, COLUMNS).path))
    assert (facts['missing'], facts['rate']) == (1, pytest.approx(100.0))
    (row,) = columns_table([facts]).rows
    assert row == ('az', 'g', '11', '100 Hz', '0.1 s', '0 .. 9', '4.5')
    without_times = described(read(make_csv(tmp_path, 'x', TIMES, COLUMNS).path))[1]
    assert columns_table([without_times]).rows[0][3:5] == ('', '')


def test_a_recording_of_ros_is_none_of_others(tmp_path):
    folder = make_mcap(tmp_path, 'bag', TIMES, COLUMNS).path
    places = (make_csv(tmp_path, 'x', TIMES, COLUMNS).path, folder, next(folder.glob('*.mcap')))
    assert list(map(is_foreign, places)) == [True, False, False]
