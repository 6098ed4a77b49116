"""The page about a fleet: made of a table and the looks at single recordings."""

import json

import numpy as np
import pytest

from engine_mount.reports.fleet.distributions import pairs_of, spread
from engine_mount.reports.fleet.looks import Look, Signals, handy_unit, number, quantity
from engine_mount.reports.fleet.report import fleet_report

pyarrow = pytest.importorskip('pyarrow')

NUMBERS = {
    'duration_s': ('s', [4.0, 4.0, None, 2.0]),
    'as_recorded_largest_a': ('A', [0.0, 0.02, None, 0.0]),
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


def look(name='a', *, moved=False, **row):
    time = np.arange(0.0, 6.0, 0.001)
    after = np.where((time > 3.0) & (time < 3.1), 1.0, 0.0)
    setpoints = np.zeros_like(time), after
    displacements = (0.002 * np.sin(time), 0.002 * np.sin(time) + np.where(time > 4.0, 5e-5, 0.0))
    signals = Signals(time, np.sin(time), setpoints, displacements if moved else None)
    whole = {'recording': name, 'mount': '', 'asked': 'displacement' if moved else 'setpoints', **row}
    return Look(whole, [f'engine-mount report {name}'], signals)


def page_with(row):
    """Return a page about one row more."""
    table = pyarrow.concat_tables([result(), pyarrow.Table.from_pylist([row])], promote_options='permissive')
    return fleet_report(table, [], '', 'F')


def sections_of(page):
    return {section.name: section for section in page.sections}


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
    (rows,) = section.chart.panels
    for curve in rows.curves:
        assert curve.y.sum() == 2 * 2  # each count at both ends of its bin
    assert section.words[0].endswith('1 of 2 rows have another value with the change.')


def test_the_page_tells_what_was_asked_what_failed_and_what_did_not_move():
    away = Look({'recording': 'b', 'mount': '', 'asked': 'setpoints', 'peak_current_a': 2.0}, reason='away')
    page = fleet_report(result(), [look(peak_current_a=1.0), away], 'peak_current_a', 'tuned')
    assert page.title == 'Fleet tuned: setpoints for the recorded displacement'
    renamed = result().rename_columns([each.replace('peak', 'mean') for each in result().column_names])
    assert fleet_report(renamed, [], 'mean_current_a', 'tuned').title == 'Fleet tuned: mean current +17 %'
    sections = sections_of(page)
    assert list(sections) == ['overview', 'worst', 'peak_current_a', 'look_1', 'look_2', 'failures']
    assert 'is another question' in sections['overview'].words[0]
    told = {
        finding.what: (finding.judgement, str(finding.text[0])) for finding in sections['overview'].findings
    }
    assert told['Recordings'][0] == 'have a look'
    assert told['Replay without the change'] == (
        'bad',
        'does not give the recorded setpoints of 1 of 3 rows, by up to 0.0200 A: they were recorded with '
        'other parameters, another version, or losses',
    )
    assert 'No picture: away' in sections['look_2'].words
    assert sections['failures'].tables[0].rows == [('1', 'broken/<b> is no MCAP file', 'broken')]


def test_recordings_with_another_policy_are_no_failures():
    rows = result().to_pylist()
    told = dict.fromkeys(NUMBERS) | {'reason': 'fifth: no effect', 'outcome': 'another policy'}
    sections = sections_of(page_with({**rows[0], **told, 'recording': 'fifth'}))
    text = [str(getattr(cell, 'text', cell)) for cell in sections['overview'].findings[0].text]
    assert ' '.join(text) == '5 recordings: 3 replayed (10 s), 1 with another policy and 1 failed'
    assert sections['another_policy'].tables[0].rows == [('1', 'fifth: no effect', 'fifth')]
    assert sections['failures'].tables[0].rows == [('1', 'broken/<b> is no MCAP file', 'broken')]


def test_a_reason_of_several_recordings_stands_once_with_all_of_them():
    row = {**result().to_pylist()[2], 'reason': 'sixth/<b> is no MCAP file', 'recording': 'sixth'}
    assert sections_of(page_with(row))['failures'].tables[0].rows == [
        ('2', '.../<b> is no MCAP file', 'broken\nsixth')
    ]


@pytest.mark.parametrize(('at', 'view'), [(0.1, (0.0, 0.8)), (3.0, (2.6, 3.4)), (5.95, (5.199, 5.999))])
def test_the_picture_shows_nothing_beyond_the_ends_of_the_recording(at, view):
    time = np.arange(0.0, 5.9995, 0.001)
    signals = Signals(time, np.sin(time), (np.zeros_like(time), np.where(abs(time - at) < 1e-6, 1.0, 0.0)))
    row = {'recording': 'a', 'mount': '', 'asked': 'setpoints', 'peak_current_a': 1.0}
    page = fleet_report(result(), [Look(row, signals=signals)], 'peak_current_a', 'Fleet')
    section = sections_of(page)['look_1']
    assert section.chart.view == pytest.approx(view)
    assert section.chart.panels[0].label == 'recorded displacement (mm)'


def test_in_a_closed_loop_the_picture_shows_both_motions_over_the_acceleration():
    row = {'peak_current_a': 1.0, 'displacement_difference_largest_m': 5e-5}
    page = fleet_report(result('displacement'), [look(moved=True, **row)], 'peak_current_a', 'Fleet')
    assert page.title == 'Fleet Fleet: displacement in a closed loop'
    assert 'Both motions are simulated' in page.sections[0].words[0]
    chart = sections_of(page)['look_1'].chart
    assert [panel.label for panel in chart.panels] == [
        'recorded acceleration of the chassis (m/s²)',
        'simulated displacement (mm)',
        'simulated displacement, changed minus as recorded (µm)',
        'setpoint in the simulation (A)',
    ]
    motion, difference = chart.panels[1:3]
    assert [curve.name for curve in motion.curves] == ['as recorded', 'changed']
    assert difference.curves[0].y.max() == pytest.approx(50.0)


def test_the_worst_are_told_by_the_column_asked_for():
    row = {'setpoint_difference_largest_a': -0.5, 'setpoint_difference_largest_at_s': 3.0015}
    page = fleet_report(result(), [look(peak_current_a=1.0, **row)], 'peak_current_a', 'Fleet')
    (table,) = page.sections[1].tables
    assert table.head[2:] == ('peak_current_a (A)', 'largest difference of the setpoints (A)', 'at (s)')
    assert table.rows[0][2:] == ('1.00', '-0.500', '3.002')


def test_numbers_are_told_with_three_digits_in_handy_units():
    assert [number(each) for each in (0.0, 0.04123, 1.2349, 12345.6)] == ['0', '0.0412', '1.23', '12346']
    assert quantity(-2.5e-5, 'm', signed=True) == '-25.0 µm'
    assert handy_unit('m', [1e-6, 2e-3]) == (1e3, 'mm')
    assert quantity(0.25, 'A') == '0.250 A'


def test_figures_stand_side_by_side_and_single_recordings_are_listed_with_the_worst_alone(tmp_path):
    file = tmp_path / 'page.html'
    fleet_report(result(), [look(peak_current_a=1.0)], 'peak_current_a', 'Fleet').write_page(file)
    text = file.read_text(encoding='utf-8')
    assert text.count('<div class="halves"><section id="peak_current_a">') == 1
    assert '<pre>engine-mount report a</pre>' in text
    top = text[text.index('<nav>') : text.index('</nav>')]
    assert 'href="#worst"' in top
    assert 'href="#look_1"' not in top
    assert text.count('href="#look_1"') == 1


def test_no_text_of_a_recording_becomes_part_of_the_page(tmp_path):
    file = tmp_path / 'page.html'
    fleet_report(
        result(reason='<script>alert(1)</script>'), [look('<img>')], 'peak_current_a', 'Fleet'
    ).write_page(file)
    text = file.read_text(encoding='utf-8')
    assert '<script>alert' not in text
    assert '<img>' not in text
    assert 'http' not in text.replace('http-equiv', '').replace('http://www.w3.org', '')
