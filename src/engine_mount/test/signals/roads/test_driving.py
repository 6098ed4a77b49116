"""From a profile and a speed to the height under the wheel."""

import numpy as np
import pytest

from engine_mount.drives.external_excitation import measured_road
from engine_mount.signals.formats.measured import Provenance
from engine_mount.signals.roads.driving import STEP_TIME, Road, doubts_of_speed, speed_of, wheel_height
from engine_mount.signals.roads.iso8608 import RoadProfile, unevenness
from engine_mount.signals.signal import SignalError

SOURCE = Provenance('folder/made.csv', 'aa', 1, 'CSV', 'test')


def wave(length=200.0, wavelength=1.0, spacing=0.01, effective=False):
    places = np.arange(0.0, length, spacing)
    height = 0.005 * np.sin(2.0 * np.pi * places / wavelength)
    return RoadProfile(0.0, spacing, height, SOURCE, (), effective)


def test_a_speed_is_a_number_with_or_without_arithmetic_and_unit():
    wanted = {'60/3.6': 60.0 / 3.6, '16.7': 16.7, '60km/h': 60.0 / 3.6, '37 mph': 16.54048}
    assert [speed_of(text) for text in wanted] == pytest.approx(list(wanted.values()))


def test_a_speed_that_is_none_is_refused_with_a_guess():
    with pytest.raises(SignalError, match=r'120 m/s; it must lie within 0\.5 .. 90 m/s; .* Write 120/3\.6'):
        speed_of('120')
    with pytest.raises(SignalError, match=r'speed\.csv is no speed; write it in m/s, as in 60/3\.6'):
        speed_of('speed.csv')
    assert 'if 60 km/h are meant, write --speed 60/3.6' in doubts_of_speed(60.0)[0]
    assert not doubts_of_speed(60 / 3.6)


def test_a_wave_is_met_at_speed_over_wavelength_and_faded_in():
    over = wheel_height(wave(), 20.0, contact_length=0.0)
    times = STEP_TIME * np.arange(over.height.size)
    wanted = 0.005 * np.sin(2.0 * np.pi * 20.0 * times)
    middle = (times > 2.0) & (times < times[-1] - 0.2)
    np.testing.assert_allclose(over.height[middle], wanted[middle], atol=5e-5)
    assert times[-1] == pytest.approx(10.0, abs=0.002)
    assert np.abs(over.height[:100]).max() < 0.12 * 0.005
    assert over.height[0] == 0.0


def test_a_tyre_averages_over_what_it_stands_on_unless_the_road_is_effective():
    def size(effective=False, **how):
        return np.std(wheel_height(wave(wavelength=0.25, effective=effective), 10.0, **how).height[2000:])

    bare = size(contact_length=0.0)
    assert size() == pytest.approx(np.sinc(0.1 / 0.25) * bare, rel=0.01)
    assert size(effective=True) == pytest.approx(bare)


def test_hills_are_taken_out_and_what_the_mount_feels_is_kept():
    plain = wave(length=600.0)
    hills = 50.0 + 0.03 * plain.distance + 5.0 * np.sin(plain.distance / 200.0)
    roads = (plain._replace(height=plain.height + hills), plain)
    over, flat = (wheel_height(road, 30.0).height for road in roads)
    assert np.abs(over).max() < 0.5
    assert np.std((over - flat)[4000:-4000]) < 0.03


def test_a_road_too_coarse_for_its_speed_is_refused_and_one_on_the_edge_told():
    with pytest.raises(SignalError, match=r'places 0\.5 m apart at 16\.7 m/s hold 13 Hz; at least 20 Hz'):
        wheel_height(wave(spacing=0.5, wavelength=7.0), 60 / 3.6)
    told = wheel_height(wave(spacing=0.25, wavelength=7.0), 60 / 3.6).notes
    assert any('no more than 26.7 Hz at this speed' in note for note in told)


def test_a_short_road_is_refused_unless_it_is_driven_forth_and_back():
    with pytest.raises(SignalError, match=r'last 0\.6 s; at least 1 s are needed: drive slower, or forth'):
        wheel_height(wave(length=10.0), 60 / 3.6)
    over = wheel_height(wave(length=10.0), 60 / 3.6, repeat=True, duration=4.0)
    assert over.height.size == pytest.approx(4000, abs=2)
    forth, back = over.height[1300:1700], over.height[2500:2900]
    assert np.std(forth) == pytest.approx(np.std(back), rel=0.1)


def test_provenance_and_class_go_into_the_session(tmp_path):
    over = wheel_height(wave(), 20.0)
    told = [over.told[name] for name in ('file', 'sha256', 'speed')]
    assert told == ['made.csv', 'aa', '20 m/s (72 km/h)']
    road = wave()
    file = measured_road(Road(road, unevenness(road), 20.0)).write(tmp_path / 'given')
    np.testing.assert_array_equal(np.load(file), over.height)
    np.testing.assert_allclose(np.diff(np.load(file.with_name('road_t.npy'))), STEP_TIME)
