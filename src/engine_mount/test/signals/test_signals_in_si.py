"""Columns as signals in SI: units and times that are said, those that are not, and those that cannot be."""

import numpy as np
import pytest
from measured_columns import SHAKING, TIMES, TRAVEL, measured

from engine_mount.signals.mapping import Mapping, with_options
from engine_mount.signals.selection import select
from engine_mount.signals.signal import SignalError

GRAVITY, LBF = 9.80665, 4.4482216152605


def read(columns, *options, **more):
    return select(measured(columns), with_options(Mapping(), options, **more)).signals


def refusal(columns, *options, **more):
    with pytest.raises(SignalError) as caught:
        read(columns, *options, **more)
    sentence = str(caught.value)
    assert 'drive.csv' in sentence
    return sentence


def test_what_is_said_becomes_si():
    found = read(
        {'t': 1e3 * TIMES, 'az': SHAKING / GRAVITY + 1.0, 'Weg': 1e3 * TRAVEL, 'F': TRAVEL * 1e6 / LBF},
        'acceleration=az:g', 'displacement=Weg:mm', 'force=F:lbf', time='t:ms',
    )  # fmt: skip
    assert found['acceleration'].values == pytest.approx(SHAKING + GRAVITY)
    assert found['displacement'].values == pytest.approx(TRAVEL)
    assert found['force'].values == pytest.approx(TRAVEL * 1e6)
    assert found['force'].times == pytest.approx(TIMES)
    assert found['force'].clock == "column 't' in ms"
    assert not found['force'].notes


def test_the_header_says_it_too_and_the_hand_goes_before_it():
    found = read({'Zeit [ms]': 1e3 * TIMES, 'Weg [mm]': 1e3 * TRAVEL}, 'displacement=Weg')
    assert found['displacement'].values == pytest.approx(TRAVEL)
    assert found['displacement'].times == pytest.approx(TIMES)
    found = read({'t [s]': TIMES, 'Weg [m]': 1e3 * TRAVEL / 25.4}, 'displacement=Weg:in')
    assert found['displacement'].values == pytest.approx(TRAVEL)
    assert found['displacement'].notes == ('Weg: its header says m; taken as in, as you say',)


@pytest.mark.parametrize(
    ('values', 'guess'),
    [
        (-SHAKING / GRAVITY - 1.0, 'g'),
        ((SHAKING + GRAVITY) / 0.3048, 'ft/s^2'),
        (1e3 * (SHAKING + GRAVITY), 'mm/s^2'),
    ],
)
def test_gravity_tells_the_unit_of_an_acceleration_in_the_refusal(values, guess):
    sentence = refusal({'t': TIMES, 'az': values}, 'acceleration=az')
    assert f'is gravity in {guess}' in sentence
    assert f'write --column acceleration=az:{guess}' in sentence


def test_gravity_in_si_is_taken_with_a_note_and_what_could_be_g_is_refused():
    found = read({'t': TIMES, 'az': SHAKING + 9.66}, 'acceleration=az')
    assert any('gravity in m/s^2: taken as m/s^2' in note for note in found['acceleration'].notes)
    sentence = refusal({'t': TIMES, 'az': SHAKING}, 'acceleration=az')
    assert 'it could be m/s^2, g' in sentence
    assert read({'t': TIMES, 'az': SHAKING}, 'acceleration=az', scale=-1.0)[
        'acceleration'
    ].values == pytest.approx(-SHAKING)


@pytest.mark.parametrize(
    ('header', 'values', 'reason', 'remedy'),
    [
        ('az [m/s^2]', 1e3 * SHAKING, 'no chassis is shaken', 'az:'),
        ('az [mm]', SHAKING, 'is in mm', 'name another column'),
    ],
)
def test_an_acceleration_in_the_wrong_unit_is_refused(header, values, reason, remedy):
    sentence = refusal({'t': TIMES, header: values}, 'acceleration=az')
    assert reason in sentence
    assert remedy in sentence


def test_metres_need_not_be_said_of_a_displacement_but_are_noted():
    found = read({'t': TIMES, 'x': TRAVEL}, 'displacement=x')
    assert any('taken as m' in note for note in found['displacement'].notes)


@pytest.mark.parametrize(('step', 'guess'), [(1.0, 'ms'), (1e6, 'ns'), (10.0, 'ms')])
def test_steps_tell_the_unit_of_time_in_the_refusal(step, guess):
    columns = {'t': step * np.arange(4000), 'x': TRAVEL}
    assert f'write --time t:{guess}' in refusal(columns, 'displacement=x:m')
    assert read(columns, 'displacement=x:m', time=f't:{guess}')


def test_times_since_1970_give_the_date():
    found = read({'t': 1.7e9 + TIMES, 'x': TRAVEL}, 'displacement=x:m')
    assert abs(found['displacement'].begin - 1_700_000_000_000_000_000) < 1000
    in_ns = read({'t': 1.7e18 + 1e9 * TIMES, 'x': TRAVEL}, 'displacement=x:m', time='t:ns')
    assert in_ns['displacement'].begin == 1_700_000_000_000_000_000


def test_a_stated_rate_gives_the_times():
    found = read({'x': TRAVEL}, 'displacement=x:m', rate=2000.0)
    assert found['displacement'].times[-1] == pytest.approx(3999 / 2000.0)


def test_times_of_the_format_go_before_columns():
    file = measured({'t': 5.0 * TIMES, 'x': TRAVEL}, begin=1_700_000_000_000_000_000)
    found = select(file, with_options(Mapping(), ['displacement=x:m'])).signals
    assert found['displacement'].clock == 'times of the format'
    assert found['displacement'].begin == 1_700_000_000_000_000_000


def test_samples_without_a_number_are_left_out_and_told():
    values = TRAVEL.copy()
    values[[0, 7]] = np.nan
    found = read({'t': TIMES, 'x': values}, 'displacement=x:m')
    assert found['displacement'].values.size == TIMES.size - 2
    assert found['displacement'].begin == 1_000_000
    assert any('2 samples without a number' in note for note in found['displacement'].notes)
    values[9] = np.inf
    assert 'value number 9 is inf, at 0.0090 s' in refusal({'t': TIMES, 'x': values}, 'displacement=x:m')
