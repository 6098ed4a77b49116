"""From a profile and a speed to the height under the wheel."""

from dataclasses import replace

import numpy as np
import pytest

from engine_mount.signals.formats.measured import Provenance
from engine_mount.signals.roads.driving import STEP_TIME, Speed, recorded_speed, speed_of, wheel_height
from engine_mount.signals.roads.iso8608 import RoadProfile
from engine_mount.signals.signal import SignalError

SOURCE = Provenance('folder/made.csv', 'aa', 1, 'CSV', 'test')


def wave(length=200.0, wavelength=1.0, spacing=0.01, amplitude=0.005, effective=False):
    places = np.arange(0.0, length, spacing)
    height = amplitude * np.sin(2.0 * np.pi * places / wavelength)
    return RoadProfile(0.0, spacing, height, SOURCE, (), effective)


@pytest.fixture
def speeds(tmp_path):
    """A function that writes columns NAME=(unit, values)."""

    def write(**columns):
        titles = [f'{name} [{unit}]' if unit else name for name, (unit, _) in columns.items()]
        rows = np.column_stack([values for _, values in columns.values()])
        np.savetxt(tmp_path / 'speed.csv', rows, delimiter=',', header=','.join(titles), comments='')
        return tmp_path / 'speed.csv'

    return write


@pytest.mark.parametrize(
    ('text', 'wanted'),
    [
        ('60/3.6', 60.0 / 3.6),
        ('16.7', 16.7),
        ('60km/h', 60.0 / 3.6),
        ('37 mph', 16.54048),
    ],
)
def test_a_speed_is_a_number_with_or_without_arithmetic_and_unit(text, wanted):
    assert speed_of(text).mean == pytest.approx(wanted)


def test_a_speed_that_is_none_is_refused_with_a_guess():
    with pytest.raises(
        SignalError, match=r'120 m/s; it must lie within 0\.5 \.\. 90 m/s; is it in km/h\? Write 120/3\.6'
    ):
        speed_of('120')
    assert 'if 60 km/h are meant, write --speed 60/3.6' in speed_of('60').notes()[0]
    assert not speed_of('60/3.6').notes()


def test_a_wave_is_met_at_speed_over_wavelength():
    over = wheel_height(wave(), speed_of('20'), contact_length=0.0)
    times = STEP_TIME * np.arange(over.height.size)
    wanted = 0.005 * np.sin(2.0 * np.pi * 20.0 * times)
    middle = (times > 2.0) & (times < times[-1] - 0.2)
    np.testing.assert_allclose(over.height[middle], wanted[middle], atol=5e-5)
    assert times[-1] == pytest.approx(10.0, abs=0.002)


def test_the_road_is_faded_in_over_the_first_second():
    over = wheel_height(wave(), speed_of('20'))
    assert np.abs(over.height[:100]).max() < 0.12 * np.abs(over.height[2000:]).max()
    assert over.height[0] == 0.0


def test_a_tyre_averages_over_what_it_stands_on_unless_the_road_is_effective():
    def size(profile, **how):
        return np.std(wheel_height(profile, speed_of('10'), **how).height[2000:])

    short = {'wavelength': 0.25}
    bare = size(wave(**short), contact_length=0.0)
    share = np.sinc(0.1 / 0.25)
    assert size(wave(**short)) == pytest.approx(share * bare, rel=0.01)
    assert size(wave(**short, effective=True)) == pytest.approx(bare)


def test_hills_are_taken_out_and_what_the_mount_feels_is_kept():
    plain = wave(length=600.0)
    hilly = replace(
        plain, height=plain.height + 50.0 + 0.03 * plain.distance + 5.0 * np.sin(plain.distance / 200.0)
    )
    over, flat = (wheel_height(road, speed_of('30')).height for road in (hilly, plain))
    assert np.abs(over).max() < 0.5
    middle = slice(4000, -4000)
    assert np.std((over - flat)[middle] - np.mean((over - flat)[middle])) < 0.03


def test_a_recorded_speed_leads_to_the_place_it_says(speeds):
    seconds = np.arange(0.0, 21.0)
    speed = recorded_speed(speeds(t=('s', seconds), speed=('km/h', 3.6 * (5.0 + 0.5 * seconds))))
    over = wheel_height(wave(wavelength=4.0), speed, contact_length=0.0)
    times = STEP_TIME * np.arange(over.height.size)
    places = 5.0 * times + 0.25 * times**2
    wanted = 0.005 * np.sin(2.0 * np.pi * places / 4.0)
    middle = (times > 2.0) & (places < 195.0)
    np.testing.assert_allclose(over.height[middle], wanted[middle], atol=2e-4)
    assert places[-1] == pytest.approx(199.99, abs=0.05)


@pytest.mark.parametrize(
    ('columns', 'reason'),
    [
        ({'t': ('s', [0.0, 1.0]), 'speed': ('', [50.0, 60.0])}, r'no unit is said; .*write the title of its'),
        ({'t': ('s', [0.0, 1.0, 9.0]), 'speed': ('m/s', [5.0, 6.0, 6.0])}, r'behind 1 s \(6 m/s\)'),
        ({'t': ('s', [0.0, 1.0, 0.5]), 'speed': ('m/s', [5.0, 6.0, 6.0])}, r'behind 1 s \(6 m/s\)'),
        ({'t': ('s', [0.0, 1.0]), 'w': ('m/s', [5.0, 6.0])}, 'has no column for speed'),
        ({'t': ('s', [0.0, 1.0]), 'v': ('m/s', [5.0, -6.0])}, r'behind 1 s \(-6 m/s\)'),
    ],
)
def test_a_recorded_speed_without_unit_or_with_gaps_is_refused(speeds, columns, reason):
    with pytest.raises(SignalError, match=reason):
        recorded_speed(speeds(**columns))


def test_a_road_too_coarse_for_its_speed_is_refused_and_one_on_the_edge_told():
    with pytest.raises(SignalError, match=r'places 0\.5 m apart at 16\.7 m/s hold 13 Hz; at least 20 Hz'):
        wheel_height(wave(spacing=0.5, wavelength=7.0), speed_of('60/3.6'))
    told = wheel_height(wave(spacing=0.25, wavelength=7.0), speed_of('60/3.6')).notes
    assert any('no more than 26.7 Hz at this speed' in note for note in told)


def test_a_short_road_is_refused_unless_it_is_driven_forth_and_back():
    with pytest.raises(
        SignalError, match=r'last 0\.6 s; at least 1 s are needed: drive slower, or forth and back'
    ):
        wheel_height(wave(length=10.0), speed_of('60/3.6'))
    over = wheel_height(wave(length=10.0), speed_of('60/3.6'), repeat=True, duration=4.0)
    assert over.height.size == pytest.approx(4000, abs=2)
    forth, back = over.height[1300:1700], over.height[2500:2900]
    assert np.std(forth) == pytest.approx(np.std(back), rel=0.1)


def test_provenance_and_class_go_into_the_session(tmp_path):
    over = wheel_height(wave(), speed_of('20'))
    assert over.told['file'] == 'made.csv'
    assert over.told['sha256'] == 'aa'
    assert over.told['speed'] == '20 m/s (72 km/h)'
    file = over.write(tmp_path / 'given')
    np.testing.assert_array_equal(np.load(file), over.height)
    np.testing.assert_allclose(np.diff(np.load(file.with_name('road_t.npy'))), STEP_TIME)


def test_a_speed_over_time_is_straight_between_its_values():
    assert Speed(np.array([0.0, 10.0]), np.array([10.0, 20.0]), '').mean == pytest.approx(15.0)
