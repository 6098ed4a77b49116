"""What is listed of a file of others."""

import numpy as np
import pytest
from foreign_files import make_csv, make_mcap, make_mdf

from engine_mount.reports.listing import describe_measured
from engine_mount.signals.formats.reading import is_foreign, read

TIMES = np.arange(11) / 100.0
COLUMNS = {'az': ('g', np.array([np.nan, *range(10)], float))}


def described(recording):
    """Return facts and row of the last column of a file."""
    found = describe_measured(read(recording.path))
    return found.figures['columns'][-1], found.tables[0].rows[-1]


def test_columns_are_told_with_unit_rate_span_and_range(tmp_path):
    facts, row = described(make_mdf(tmp_path, 'x', TIMES, COLUMNS))
    assert (facts['missing'], facts['rate']) == (1, pytest.approx(100.0))
    assert row == ('az', 'g', '11', '100 Hz', '0.1 s', '0 .. 9', '4.5')
    facts, row = described(make_csv(tmp_path, 'x', TIMES, COLUMNS))
    assert (facts['rate'], facts['span'], *row[3:5]) == (None, None, '', '')


def test_a_recording_of_ros_is_none_of_others(tmp_path):
    folder = make_mcap(tmp_path, 'bag', TIMES, COLUMNS).path
    places = (make_csv(tmp_path, 'x', TIMES, COLUMNS).path, folder, next(folder.glob('*.mcap')))
    assert list(map(is_foreign, places)) == [True, False, False]
