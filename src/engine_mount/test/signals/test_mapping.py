"""What a mapping file and options say of a recording, and which of them goes first."""

import pytest

from engine_mount.signals.mapping import (
    ColumnChoice,
    Mapping,
    TimeChoice,
    mapping_in_file,
    with_options,
)
from engine_mount.signals.signal import SignalError

RACK = """
system: rack 2, string potentiometer
time: {column: Zeit, unit: ms}
columns:
  displacement: {column: Weg, unit: mm, offset: mean}
  acceleration: {column: az, unit: g, scale: -1}
others:
  valve_pressure: {column: p2, unit: bar}
"""


def in_file(folder, text):
    path = folder / 'rack.yaml'
    path.write_text(text, encoding='utf-8')
    return mapping_in_file(path)


def test_a_mapping_file_says_columns_units_and_times(tmp_path):
    found = in_file(tmp_path, RACK)
    assert found.system == 'rack 2, string potentiometer'
    assert found.time == TimeChoice('Zeit', 'ms')
    assert found.columns['displacement'] == ColumnChoice('Weg', 'mm', None, 'mean')
    assert found.columns['acceleration'] == ColumnChoice('az', 'g', -1.0)
    assert found.others['valve_pressure'] == ColumnChoice('p2', 'bar')


@pytest.mark.parametrize(
    ('text', 'reason'),
    [
        ('colums: {}', 'colums is not known; known are system, time, columns, others'),
        ('columns: {displacment: {column: x}}', "'displacment' is no quantity; did you mean displacement"),
        ('columns: {displacement: {colum: x}}', 'displacement: colum is not known'),
        ('columns: {displacement: x}', 'displacement must have keys'),
        ('columns: {displacement: {unit: mm}}', 'names no column'),
        ('columns: {displacement: {column: x, unit: furlong}}', "unit 'furlong' is not known"),
        ('columns: {displacement: {column: x, scale: 0}}', 'must be a number other than 0'),
        ('time: {rate: -1}', 'above 0'),
        ('time: {column: t, unit: mm}', 'must be s, ms'),
        ('others: {force: {column: F}}', 'a quantity stands below columns'),
        ('columns: {force: {column: a}, force: {column: b}}', 'stands there twice'),
    ],
)
def test_what_a_mapping_file_cannot_mean_is_refused_with_the_file(tmp_path, text, reason):
    with pytest.raises(SignalError, match=reason) as caught:
        in_file(tmp_path, text)
    assert 'rack.yaml' in str(caught.value)


def test_an_option_goes_before_the_file_and_leaves_what_it_does_not_say(tmp_path):
    found = with_options(in_file(tmp_path, RACK), ['displacement=Weg:um'], 't:s')
    assert found.columns['displacement'] == ColumnChoice('Weg', 'um', None, 'mean')
    assert found.columns['acceleration'].unit == 'g'
    assert found.time == TimeChoice('t', 's')
    other = with_options(in_file(tmp_path, RACK), ['displacement=x'], rate=500.0)
    assert other.columns['displacement'] == ColumnChoice('x')
    assert other.time == TimeChoice(rate=500.0)


@pytest.mark.parametrize(
    ('option', 'quantity', 'column', 'unit'),
    [
        ('acceleration=az:g', 'acceleration', 'az', 'g'),
        ('F1:lbf', 'force', 'F1', 'lbf'),
        ('Weg', 'displacement', 'Weg', ''),
        ('force=/rig/load.wrench.force.z', 'force', '/rig/load.wrench.force.z', ''),
        ('normal_force=a:b', 'normal_force', 'a:b', ''),
    ],
)
def test_quantity_and_unit_of_an_option(option, quantity, column, unit):
    found = with_options(Mapping(), [option])
    assert found.columns == {quantity: ColumnChoice(column, unit)}


@pytest.mark.parametrize(
    ('options', 'reason'),
    [
        ({'columns': ['foo']}, 'say what it is, as in displacement=foo'),
        ({'columns': ['foo:KN']}, 'for kilonewtons write kN'),
        ({'columns': ['a:mm', 'b:um']}, 'displacement is named twice'),
        ({'time': 't', 'rate': 100.0}, 'both say the times'),
    ],
)
def test_an_option_that_tells_nothing_is_refused(options, reason):
    with pytest.raises(SignalError, match=reason):
        with_options(Mapping(), **options)
