"""Columns of a table as a road, and what is refused of them, each with its guess."""

import numpy as np
import pytest

from engine_mount.signals.formats.measured import Measured, MeasuredColumn, Provenance
from engine_mount.signals.roads.profile import ProfileError
from engine_mount.signals.roads.reading import checked_profile
from engine_mount.signals.roads.table import heights_of

PLACES = np.arange(0.0, 60.0, 0.05)
HEIGHTS = 0.01 * np.cumsum(np.random.default_rng(5).normal(0.0, 0.05, PLACES.size))


def table(**columns):
    """A table with columns NAME=(unit, values)."""
    made = {
        name: MeasuredColumn(name, name, unit, number, values=np.asarray(values, float))
        for number, (name, (unit, values)) in enumerate(columns.items())
    }
    return Measured(made, Provenance('folder/road.csv', '', 0, 'CSV', 'test'))


def road(measured, **how):
    along, height, unit, size, effective = heights_of(measured, **how)
    return checked_profile(along, height, measured.provenance, unit=unit, size=size, effective=effective)


def refusal(measured, **how):
    with pytest.raises(ProfileError) as caught:
        road(measured, **how)
    return str(caught.value)


@pytest.mark.parametrize(('unit', 'size'), [('m', 1.0), ('mm', 1e-3), ('um', 1e-6), ('in', 0.0254)])
def test_heights_come_in_any_length_and_leave_in_m(unit, size):
    made = road(table(distance=('m', PLACES), height=(unit, HEIGHTS / size)))
    np.testing.assert_allclose(made.height, HEIGHTS, atol=1e-12)
    assert made.spacing == pytest.approx(0.05)
    assert not made.effective


def test_columns_are_known_by_usual_names_or_named():
    measured = table(Weg=('km', PLACES / 1000.0), other=('V', PLACES), Profil=('', 1000.0 * HEIGHTS))
    np.testing.assert_allclose(road(measured, column='Profil:mm').height, HEIGHTS, atol=1e-12)
    assert 'which column is the height? Name it with --column' in refusal(measured)
    spaced = table(effective_height=('m', HEIGHTS))
    assert road(spaced, spacing=0.05).effective


def test_a_unit_that_is_not_said_is_asked_for_with_a_guess():
    assert 'has no unit in its header; say it as in --column height:mm' in refusal(
        table(distance=('m', PLACES), height=('', 1000.0 * HEIGHTS))
    )
    assert "the unit 'V', which is no length" in refusal(table(distance=('m', PLACES), height=('V', HEIGHTS)))


@pytest.mark.parametrize(('factor', 'unit', 'guess'), [(1e3, 'm', 'mm'), (1e6, 'm', 'um'), (1e-3, 'mm', 'm')])
def test_heights_in_another_unit_than_said_are_refused_with_the_guess(factor, unit, guess):
    said = refusal(
        table(distance=('m', PLACES), height=(unit, factor * HEIGHTS / (1e-3 if unit == 'mm' else 1.0)))
    )
    assert 'than any road' in said
    assert guess in said.partition('are they in ')[2].replace(' instead', ' or ').split(' or ')


def test_an_acceleration_is_refused_by_name_unit_and_shape():
    acceleration = np.random.default_rng(2).normal(0.0, 0.8, PLACES.size)
    words = 'is an acceleration, not a height; drive it with --scenario recorded'
    assert words in refusal(table(distance=('m', PLACES), height=('m/s^2', acceleration)))
    assert words in refusal(table(distance=('m', PLACES), acc_z=('', acceleration)), column='acc_z')
    shaped = refusal(table(distance=('m', PLACES), height=('m', 0.2 * acceleration)))
    assert 'is not that of heights (1.5 to 3.5) but of accelerations (about 0)' in shaped
    assert 'road invert' in shaped


def test_a_time_in_place_of_the_distance_is_refused():
    measured = table(t=('s', PLACES), height=('m', HEIGHTS))
    assert "'t' is a time: a road is height over distance" in refusal(measured)
    assert 'a road is height over distance' in refusal(measured, distance='t')


def test_distances_that_go_back_have_gaps_or_are_no_numbers_are_refused():
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
    assert 'distance number 7 is nan' in refusal(table(x=('m', none), z=('m', HEIGHTS)))
    assert 'are the distances in km?' in refusal(table(x=('m', PLACES / 1000.0), z=('m', HEIGHTS)))


def test_uneven_places_and_a_standing_car_are_brought_onto_an_even_grid():
    random = np.random.default_rng(3)
    uneven = np.sort(PLACES + 0.01 * random.uniform(-1.0, 1.0, PLACES.size))
    smooth = 0.01 * np.sin(uneven)
    made = road(table(x=('m', uneven), z=('m', smooth)))
    np.testing.assert_allclose(made.height, 0.01 * np.sin(made.distance), atol=1e-6)
    assert any('uneven places' in note for note in made.notes)
    stood = np.insert(PLACES, 300, PLACES[300])
    made = road(table(x=('m', stood), z=('m', np.insert(HEIGHTS, 300, HEIGHTS[300]))))
    np.testing.assert_allclose(made.height, HEIGHTS, atol=1e-9)


def test_a_road_that_was_measured_backwards_is_driven_from_its_other_end():
    made = road(table(x=('m', PLACES[::-1]), z=('m', HEIGHTS)))
    np.testing.assert_allclose(made.height, HEIGHTS[::-1])
    assert any('other end' in note for note in made.notes)
