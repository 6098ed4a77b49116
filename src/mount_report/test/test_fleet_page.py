"""The page about a fleet: made of a table and the looks at single recordings."""

import json

import numpy as np
import pytest

from mount_report.fleet.distributions import pairs_of, spread
from mount_report.fleet.looks import Look
from mount_report.fleet.report import fleet_report

pyarrow = pytest.importorskip('pyarrow')

NUMBERS = {
    'duration_s': ('s', [4.0, 4.0, None, 2.0]),
    'as_recorded_largest_a': ('A', [0.0, 0.02, None, 0.0]),
    'setpoints_differing': ('', [10, 0, None, 5]),
    'switchings_appeared': ('', [1, 0, None, 0]),
    'switchings_vanished': ('', [0, 0, None, 0]),
    'switchings_moved': ('', [0, 0, None, 0]),
    'peak_current_a': ('A', [1.0, 2.0, None, 0.5]),
    'peak_current_changed_a': ('A', [1.5, 2.0, None, None]),
    'switched_on': ('', [1, 2, None, 3]),
    'switched_on_changed': ('', [1, 2, None, 3]),
}


def result(asked='setpoints', reason='broken/<b> is no MCAP file'):
    changes = json.dumps({'mount_control': {'switch_on_level': 0.0006}})
    columns = {
        'recording': ['a', 'b', 'broken', 'd'],
        'mount': ['', '', '', 'left'],
        'reason': ['', '', reason, ''],
        'asked': [asked] * 4,
        'changes': [changes] * 4,
        'as_recorded': [True, False, None, True],
        **{name: values for name, (_, values) in NUMBERS.items()},
    }
    table = pyarrow.table(columns)
    fields = [
        field.with_metadata(
            {'unit': NUMBERS.get(field.name, ('',))[0], 'meaning': f'meaning of {field.name}'}
        )
        for field in table.schema
    ]
    return table.cast(pyarrow.schema(fields))


def look(name='a'):
    time = np.arange(0.0, 6.0, 0.001)
    after = np.where((time > 3.0) & (time < 3.1), 1.0, 0.0)
    return Look(name, 'peak 1', ['engine-mount report a'], time, np.sin(time), np.zeros_like(time), after)


def test_a_figure_is_paired_with_itself_after_the_change_where_both_are_known():
    (current, switched) = pairs_of(result())
    assert (current.name, current.unit, current.meaning) == (
        'peak_current_a',
        'A',
        'meaning of peak_current_a',
    )
    np.testing.assert_array_equal(current.before, [1.0, 2.0])
    np.testing.assert_array_equal(current.after, [1.5, 2.0])
    assert current.moved
    assert not switched.moved


def test_a_distribution_counts_every_row_once():
    section = spread(pairs_of(result())[0])
    rows, shares = section.chart.panels
    for curve in rows.curves:
        assert curve.y[:-1].sum() == 2
    assert all(curve.y[-1] == 1.0 for curve in shares.curves)
    assert section.words == ['1 of 2 rows have another value.']


def test_the_page_tells_what_was_asked_what_failed_and_what_did_not_move():
    page = fleet_report(result(), [look(), Look('b', 'peak 0', [], reason='it is away')], 'peak', 'Fleet')
    sections = {section.name: section for section in page.sections}
    assert list(sections) == ['overview', 'worst', 'peak_current_a', 'look_1', 'look_2', 'failures']
    assert 'is another question' in sections['overview'].words[0]
    told = {
        finding.what: (finding.judgement, str(finding.text[0])) for finding in sections['overview'].findings
    }
    assert told['Recordings'][0] == 'look'
    assert told['Replay without the change'] == (
        'bad',
        'does not give the recorded setpoints of 1 of 3, by up to 0.02 A: they were recorded with other '
        'parameters, another version, or losses',
    )
    assert 'No picture: it is away' in sections['look_2'].words
    assert sections['failures'].tables[0].rows == [('.../<b> is no MCAP file', '1', 'broken')]


def test_the_picture_shows_the_stretch_around_the_largest_difference():
    page = fleet_report(result(), [look()], 'peak', 'Fleet')
    chart = next(section.chart for section in page.sections if section.name == 'look_1')
    setpoints = chart.panels[1]
    assert abs(setpoints.dots[0].x[0] - 3.001) < 1e-9
    assert (setpoints.curves[0].x[0], setpoints.curves[0].x[-1]) == pytest.approx((2.001, 4.0))


def test_a_simulated_displacement_is_told_apart_from_a_replayed_one():
    words = fleet_report(result('displacement'), [], 'peak', 'Fleet').sections[0].words
    assert 'simulated anew' in words[0]


def test_no_text_of_a_recording_becomes_part_of_the_page(tmp_path):
    file = tmp_path / 'page.html'
    fleet_report(result(reason='<script>alert(1)</script>'), [look('<img>')], 'peak', 'Fleet').write_page(
        file
    )
    text = file.read_text(encoding='utf-8')
    assert '<script>alert' not in text
    assert '<img>' not in text
    assert 'http' not in text.replace('http-equiv', '').replace('http://www.w3.org', '')
