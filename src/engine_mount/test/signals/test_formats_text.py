"""Text tables in every dialect: read as they were meant, or refused with line, cell and remedy."""

import csv
import io
import re

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from engine_mount.signals.formats import text as module
from engine_mount.signals.formats.cells import date_in, name_and_unit
from engine_mount.signals.formats.content import Stated
from engine_mount.signals.formats.reading import headings, read
from engine_mount.signals.mapping import mapping_in_file
from engine_mount.signals.selection import select
from engine_mount.signals.signal import SignalError

ROWS = [[0.0, 1.25, -3.5e-3], [0.01, 2.5, 1200.0], [0.02, -0.125, 7.0], [0.03, 0.5, 8.75]]
TITLES = ('t [s]', 'az [g]', 'Höhe [µm]')


@pytest.fixture(params=['pyarrow', 'without pyarrow'])
def _either_parser(request, monkeypatch):
    if request.param != 'pyarrow':
        monkeypatch.setattr(module, '_in_bulk', lambda *_: None)


def _read(tmp_path, text, columns=None, encoding='utf-8', **stated):
    path = tmp_path / 'drive.csv'
    path.write_bytes(text if isinstance(text, bytes) else text.encode(encoding))
    return read(path, columns, Stated(**stated))


def _refusal(tmp_path, text):
    with pytest.raises(SignalError) as caught:
        _read(tmp_path, text)
    assert str(tmp_path / 'drive.csv') in str(caught.value)
    return str(caught.value)


def _is_told(measured, rows=ROWS):
    np.testing.assert_array_equal(np.column_stack([one.values for one in measured.columns.values()]), rows)


@pytest.mark.usefixtures('_either_parser')
@pytest.mark.parametrize('tail', [False, True])
@pytest.mark.parametrize(
    ('delimiter', 'decimal', 'end', 'encoding'),
    [
        (',', '.', '\n', 'utf-8'), (';', '.', '\r', 'cp1252'), (';', ',', '\r\n', 'utf-8-sig'),
        ('\t', '.', '\n', 'cp1252'), ('\t', ',', '\r\n', 'utf-16'), ('|', ',', '\r', 'utf-8'),
    ],
)  # fmt: skip
def test_delimiters_decimal_signs_line_ends_and_encodings(tmp_path, delimiter, decimal, end, encoding, tail):
    cells = [TITLES, *([repr(value).replace('.', decimal) for value in row] for row in ROWS)]
    text = end.join(delimiter.join(row) + delimiter * tail for row in cells) + end
    measured = _read(tmp_path, text, encoding=encoding)
    _is_told(measured)
    told = [(one.name, one.unit, one.number) for one in measured.columns.values()]
    assert told == [('t', 's', 0), ('az', 'g', 1), ('Höhe', 'µm', 2)]
    assert f'decimal {"point" if decimal == "." else "comma"}' in measured.notes[0]


@pytest.mark.usefixtures('_either_parser')
@pytest.mark.parametrize('decimal', ['.', ','])
def test_runs_of_blanks(tmp_path, decimal):
    lines = ['   t    az   weg', *('  '.join(f'{value:12.6g}' for value in row) for row in ROWS)]
    _is_told(_read(tmp_path, '\n'.join(lines).replace('.', decimal)))


@pytest.mark.usefixtures('_either_parser')
@pytest.mark.parametrize(
    ('text', 'names'),
    [
        ('# made by x\n% at 5\n// on y\nt,az\n0,1.5\n# in between\n1,2.5\n\n   \n2,3.5\n', ['t', 'az']),
        ('# t az\n0.0 1.5\n1.0 2.5\n2 3.5\n', ['t', 'az']),
        ('#t,az\n0,1.5\n1,2.5\n2,3.5\n', ['t', 'az']),
        ('0,1.5\n1,2.5\n2,3.5\n', ['0', '1']),
        ('System;Q7\nRate;1000\n\nt;az\ns;g\n0;1.5\n1;2.5\n2;3.5\n', ['t', 'az']),
        ('Time (s)   Acc z (g)\n0.0   1.5\n1.0   2.5\n2.0  3.5\n', ['Time', 'Acc z']),
        ('"t","az"\n"0","1,5"\n"1","2,5"\n"2","3,5"\n', ['t', 'az']),
        (',0,1\n0,0,1.5\n1,1,2.5\n2,2,3.5\n', ['0', '1']),
        ('az\n1,5\n2,5\n3,5\n', ['az']),
        ('t,state,az\n0,on,1.5\n1,off,2.5\n2,on,3.5\n', ['t', 'az']),
    ],
)
def test_where_the_titles_stand(tmp_path, text, names):
    measured = _read(tmp_path, text)
    assert list(measured.columns)[-2:] == names
    np.testing.assert_array_equal(list(measured.columns.values())[-1].values, [1.5, 2.5, 3.5])
    assert ('state: no numbers, left out' in measured.notes) == ('state' in text)


def test_a_row_of_units_gives_the_units(tmp_path):
    measured = _read(tmp_path, 'Q7 recorder\nt;az;k\n[s];[m/s^2];-\n0;1.5;1\n1;2.5;2\n')
    assert [one.unit for one in measured.columns.values()] == ['s', 'm/s^2', '-']
    assert any('1 lines before the titles are left out' in note for note in measured.notes)


@pytest.mark.parametrize(
    ('title', 'name', 'unit'),
    [
        ('Weg [mm]', 'Weg', 'mm'), ('Weg (mm)', 'Weg', 'mm'), ('accel_z/g', 'accel_z', 'g'),
        ('disp_mm', 'disp', 'mm'), ('Kraft in N', 'Kraft', 'N'), ('a / (m/s²)', 'a', 'm/s²'),
        ('acc_m_s2', 'acc', 'm/s2'), ('v_in_per_s', 'v', 'in/s'),
        ('Acc (front left)', 'Acc (front left)', ''), ('m/s', 'm/s', ''), ('acc[0]', 'acc[0]', ''),
        ('phase_a', 'phase_a', ''), ('x_min', 'x_min', ''), ('Time, s', 'Time', 's'),
        ('n [1/min]', 'n', '1/min'),
    ],
)  # fmt: skip
def test_names_and_units_of_titles(title, name, unit):
    assert name_and_unit(title) == (name, unit)


@pytest.mark.usefixtures('_either_parser')
def test_missing_values_are_nan_and_told(tmp_path):
    measured = _read(tmp_path, 't,az\n0,1.5\n1,\n2,NaN\n3,n/a\n4,1.0\n')
    np.testing.assert_array_equal(measured.column('az').values, [1.5, np.nan, np.nan, np.nan, 1.0])
    assert 'az: 3 of 5 samples hold no number' in measured.notes


@pytest.mark.usefixtures('_either_parser')
@pytest.mark.parametrize(
    ('form', 'hours'),
    [
        ('2024-05-01 12:00:0{}.250', 0), ('2024-05-01T12:00:0{}.250Z', 0),
        ('2024-05-01 12:00:0{}.250+01:00', 1), ('1.5.2024 12:00:0{},250', 0),
        ('5/1/2024 12:00:0{}.250 PM', 0), ('2024/5/1 12:00:0{}.250', 0),
    ],
)  # fmt: skip
def test_dates_are_the_times_of_the_other_columns(tmp_path, form, hours):
    lines = ['when;az', *(f'{form.format(place)};{place},5' for place in range(5))]
    column = _read(tmp_path, '\n'.join(lines), ['az']).column('az')
    np.testing.assert_array_equal(column.time.times, np.arange(5.0))
    assert column.time.begin == (1714564800 - 3600 * hours) * 10**9 + 250_000_000


def test_a_day_above_12_is_no_month():
    assert date_in('24/11/2026 9:30') == date_in('11/24/2026 9:30') == date_in('2026-11-24 09:30')


def test_times_of_day_pass_midnight_and_a_clock_slower_than_the_samples_gives_no_times(tmp_path):
    samples = [(f'{hour}:{minute}:{second}.5', place) for place, (hour, minute, second) in enumerate(
        [('23', '59', '58'), ('23', '59', '59'), ('00', '00', '00'), ('00', '00', '01')]
    )]  # fmt: skip
    text = '\n'.join(['day;clock;az', *(f'24.11.2026;{clock};{value}' for clock, value in samples)])
    time = _read(tmp_path, text, ['az']).column('az').time
    assert time.times.tolist() == [86398.5, 86399.5, 86400.5, 86401.5]
    assert time.begin == 0
    text = '\n'.join(['t;clock;az', *(f'{place / 4};10:00:0{place // 4};1' for place in range(16))])
    measured = _read(tmp_path, text)
    assert list(measured.columns) == ['t', 'az']
    assert measured.column('az').time is None
    assert 'clock: one date for several samples, no times of these' in measured.notes


@pytest.mark.parametrize(
    'text',
    [
        '0,1\n2,3\n4,5\n',  # two columns, or one with decimal commas
        't;x\n999;1,000\n1000;1,001\n1001;999\n',  # thousands, or decimal commas
        't;x\n999;1.000\n1000;1.001\n1001;999\n',
    ],
)
def test_what_can_be_read_in_two_ways_is_refused(tmp_path, text):
    refusal = _refusal(tmp_path, text)
    assert ' or ' in refusal
    assert 'state' in refusal


def test_titles_or_what_is_stated_decide(tmp_path):
    assert list(_read(tmp_path, 't,x\n0,1\n2,3\n').columns) == ['t', 'x']
    np.testing.assert_array_equal(_read(tmp_path, 'x\n0,1\n2,3\n').column('x').values, [0.1, 2.3])
    assert list(_read(tmp_path, '0,1\n2,3\n', decimal=',').columns) == ['0']
    assert list(_read(tmp_path, '0,1\n2,3\n', delimiter=',').columns) == ['0', '1']
    values = _read(tmp_path, 't;x\n999;1,000\n1000;1,001\n', decimal=',').column('x').values
    np.testing.assert_array_equal(values, [1.0, 1.001])


@pytest.mark.usefixtures('_either_parser')
@pytest.mark.parametrize(
    ('line', 'reason'),
    [
        ('1.5;x', "column 'az': 'x' is no number; expected is a number with decimal point"),
        ('1.5;2,5', "'2,5' is no number; expected is a number with decimal point; is the decimal sign the"),
        ('1.5;1,234.5', 'export without signs between thousands'),
        ('1.5', "1 cells ('1.5') where the others have 2"),
        ('1.5;2;3', '3 cells'),
        ('1.5;0x10', "'0x10' is no number"),
        ('1.5;1_000', "'1_000' is no number"),
    ],
)
def test_a_wrong_line_is_named(tmp_path, line, reason):
    lines = ['t [s];az', *(f'{place}.5;1.5' for place in range(300)), line, *('301.5;1.5',) * 200]
    refusal = _refusal(tmp_path, '\n'.join(lines))
    assert reason in refusal
    assert 'line 302' in refusal


def test_a_line_far_behind_is_counted_across_blocks(tmp_path, monkeypatch):
    monkeypatch.setattr(module, 'BLOCK', 4096)
    lines = ['# by x', 't;az', *(f'{place};1.5' for place in range(30_000)), '30000;?!', '30001;1.5']
    assert "line 30003, column 'az': '?!' is no number" in _refusal(tmp_path, '\n'.join(lines))


@pytest.mark.parametrize(
    ('text', 'reason'),
    [
        ('\n \n', 'is empty'),
        ('# only\n', 'comments and blank lines only'),
        ('some words\nmore of them here\n', 'is no line of a table of numbers'),
        ('t,x\n0,1,2,3\n1,5,2,5\n', '2 titles (t, x) above lines of 4 cells'),
        ('0,000;1.234,500\n0,001;1.235,250\n', "'1.234,500' is no number; .* signs between thousands"),
        ("t,x\n0.5,1'234.5\n1.5,1'235.5\n", 'signs between thousands'),
        (b'\x00\x01\x02' * 500, 'is no text'),
    ],
)
def test_what_is_no_table_is_refused(tmp_path, text, reason):
    assert re.search(reason.replace('(', r'\(').replace(')', r'\)'), _refusal(tmp_path, text))


# Generated dialects

_VALUES = st.floats(-1e6, 1e6, allow_nan=False).map(lambda value: value + 0.0)


@given(
    st.lists(st.tuples(_VALUES, _VALUES, _VALUES), min_size=3, max_size=20),
    st.sampled_from([(',', '.'), (';', '.'), (';', ','), ('\t', '.'), ('\t', ','), ('  ', '.'), ('  ', ',')]),
    st.booleans(), st.booleans(), st.booleans(), st.sampled_from(['utf-8', 'utf-16', 'cp1252']),
)  # fmt: skip
def test_what_a_writer_wrote_comes_back_or_is_refused(
    tmp_path_factory, rows, signs, titled, quoted, trailing, codec
):
    delimiter, decimal = signs
    path = tmp_path_factory.mktemp('dialect') / 'x.txt'
    stream = io.StringIO()
    cells = [[repr(value).replace('.', decimal) for value in row] for row in rows]
    table = [['t [s]', 'a [g]', 'b [mm]'], *cells] if titled else cells
    if delimiter == '  ':
        stream.write('\n'.join('  '.join(row).replace('t [s]', 't[s]') for row in table))
    else:
        quoting = csv.QUOTE_ALL if quoted else csv.QUOTE_MINIMAL
        csv.writer(stream, delimiter=delimiter, quoting=quoting).writerows(
            [*row, ''] if trailing else row for row in table
        )
    path.write_bytes(stream.getvalue().encode(codec))
    try:
        measured = read(path)
    except SignalError:
        return
    _is_told(measured, np.array(rows))


@given(st.binary(max_size=600))
def test_any_bytes_are_read_or_refused(tmp_path_factory, data):
    path = tmp_path_factory.mktemp('bytes') / 'x.csv'
    path.write_bytes(data)
    try:
        there = headings(path)
        read(path, [one.name for one in there])
    except SignalError as error:
        refusal = str(error)
        assert str(path) in refusal


def test_a_mapping_file_states_what_a_table_leaves_open(tmp_path):
    (tmp_path / 'drive.csv').write_text('0,1\n2,3\n' * 5)
    (tmp_path / 'system.yaml').write_text(
        'decimal: ","\ntime: {rate: 100}\ncolumns: {displacement: {column: "0", unit: mm}}\n'
    )
    found = select(tmp_path / 'drive.csv', mapping_in_file(tmp_path / 'system.yaml'))
    assert found.signals['displacement'].values == pytest.approx(1e-3 * (0.1 + 2.2 * (np.arange(10) % 2)))
