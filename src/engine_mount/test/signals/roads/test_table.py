"""Columns of a table as a road, and what is refused of them, each with its guess."""

import numpy as np
import pytest

from engine_mount.signals.roads.table import road_profile
from engine_mount.signals.signal import SignalError

PLACES = np.arange(0.0, 60.0, 0.05)
HEIGHTS = 0.01 * np.cumsum(np.random.default_rng(5).normal(0.0, 0.05, PLACES.size))


@pytest.fixture
def table(tmp_path):
    """A function that writes columns NAME=(unit, values)."""

    def write(**columns):
        titles = [f'{name} [{unit}]' if unit else name for name, (unit, _) in columns.items()]
        rows = np.column_stack([values for _, values in columns.values()])
        np.savetxt(tmp_path / 'road.csv', rows, '%.17g', delimiter=',', header=','.join(titles), comments='')
        return tmp_path / 'road.csv'

    return write


def refusal(measured, **how):
    with pytest.raises(SignalError) as caught:
        road_profile(measured, **how)
    return str(caught.value)


@pytest.mark.parametrize(('unit', 'size'), [('m', 1.0), ('mm', 1e-3), ('um', 1e-6), ('in', 0.0254)])
def test_heights_come_in_any_length_and_leave_in_m(table, unit, size):
    made = road_profile(table(distance=('m', PLACES), height=(unit, HEIGHTS / size)))
    np.testing.assert_allclose(made.height, HEIGHTS, atol=1e-12)
    assert made.spacing == pytest.approx(0.05)
    assert not made.effective


def test_columns_are_known_by_usual_names_or_named(table):
    measured = table(Weg=('km', PLACES / 1000.0), other=('V', PLACES), Profil=('', 1000.0 * HEIGHTS))
    np.testing.assert_allclose(road_profile(measured, column='Profil:mm').height, HEIGHTS, atol=1e-12)
    assert 'has no column for height (its columns: Weg [km], other [V], Profil; ' in refusal(measured)
    spaced = table(effective_height=('m', HEIGHTS))
    assert road_profile(spaced, spacing=0.05).effective


def test_a_unit_that_is_not_said_is_refused_with_a_guess(table):
    assert 'no unit is said; values from' in refusal(
        table(distance=('m', PLACES), height=('', 1000.0 * HEIGHTS))
    )
    assert 'that is of voltage, but height is of length' in refusal(
        table(distance=('m', PLACES), height=('V', HEIGHTS))
    )


@pytest.mark.parametrize(
    ('factor', 'unit', 'guess'), [(1e3, 'm', 'mm instead of m'), (1e-3, 'mm', 'm instead of mm')]
)
def test_heights_in_another_unit_than_said_are_refused_with_the_guess(table, factor, unit, guess):
    said = refusal(
        table(distance=('m', PLACES), height=(unit, factor * HEIGHTS / (1e-3 if unit == 'mm' else 1.0)))
    )
    assert 'than any road' in said
    assert f'are they in {guess}?' in said


def test_an_acceleration_is_refused_by_name_unit_and_shape(table):
    acceleration = np.random.default_rng(2).normal(0.0, 0.8, PLACES.size)
    words = 'that is of acceleration, but height is of length'
    assert words in refusal(table(distance=('m', PLACES), height=('m/s^2', acceleration)))
    unsaid = refusal(table(distance=('m', PLACES), acc_z=('', acceleration)), column='acc_z')
    assert 'no unit is said' in unsaid
    shaped = refusal(table(distance=('m', PLACES), height=('m', 0.2 * acceleration)))
    assert 'is not that of heights (1.5 to 3.5) but of accelerations (about 0)' in shaped
    assert 'road invert' in shaped


def test_a_time_in_place_of_the_distance_is_refused(table):
    measured = table(t=('s', PLACES), height=('m', HEIGHTS))
    assert 'has no column for distance' in refusal(measured)
    assert 'that is of time, but distance is of length' in refusal(measured, distance='t')


def test_distances_that_go_back_have_gaps_or_are_no_numbers_are_refused(table):
    back = PLACES.copy()
    back[500:] -= 3.0
    assert 'the distance does not rise' in refusal(table(x=('m', back), z=('m', HEIGHTS)))
    gap = PLACES.copy()
    gap[500:] += 3.0
    assert 'no heights from 24.95 to 28 m (3.05 m; 1 gaps in all)' in refusal(
        table(x=('m', gap), z=('m', HEIGHTS))
    )
    none = PLACES.copy()
    none[7] = np.nan
    assert "column 'x': row 8 is nan (1 such of 1200)" in refusal(table(x=('m', none), z=('m', HEIGHTS)))
    assert 'is the unit of the distance another one?' in refusal(
        table(x=('m', PLACES / 1000.0), z=('m', HEIGHTS))
    )


def test_uneven_places_are_brought_onto_an_even_grid(table):
    random = np.random.default_rng(3)
    uneven = np.sort(PLACES + 0.01 * random.uniform(-1.0, 1.0, PLACES.size))
    smooth = 0.01 * np.sin(uneven)
    made = road_profile(table(x=('m', uneven), z=('m', smooth)))
    np.testing.assert_allclose(made.height, 0.01 * np.sin(made.distance), atol=1e-6)
    assert any('uneven places' in note for note in made.notes)


def test_a_road_measured_backwards_or_by_a_car_that_stood_is_refused(table):
    assert 'does not rise' in refusal(table(x=('m', PLACES[::-1]), z=('m', HEIGHTS)))
    stood = np.insert(PLACES, 300, PLACES[300])
    assert 'does not rise' in refusal(table(x=('m', stood), z=('m', np.insert(HEIGHTS, 300, HEIGHTS[300]))))
