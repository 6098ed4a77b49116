"""Columns of a table as a road, and what is refused of them, each with its guess."""

import numpy as np
import pytest

from engine_mount.signals.roads.table import road_profile
from engine_mount.signals.signal import SignalError

PLACES = np.arange(0.0, 60.0, 0.05)
HEIGHTS = 0.01 * np.cumsum(np.random.default_rng(5).normal(0.0, 0.05, PLACES.size))
ACCELERATION = np.random.default_rng(2).normal(0.0, 0.8, PLACES.size)
LATE = np.arange(PLACES.size) >= 500


@pytest.fixture
def road(tmp_path):
    """A function that writes columns {title: values} and reads them as a road."""

    def read(columns, **how):
        rows, path = np.column_stack(list(columns.values())), tmp_path / 'road.csv'
        np.savetxt(path, rows, '%.17g', delimiter=',', header=','.join(columns), comments='')
        return road_profile(path, **how)

    return read


@pytest.mark.parametrize(('unit', 'size'), [('m', 1.0), ('mm', 1e-3), ('in', 0.0254)])
def test_heights_come_in_any_length_and_leave_in_m(road, unit, size):
    made = road({'distance [m]': PLACES, f'height [{unit}]': HEIGHTS / size})
    np.testing.assert_allclose(made.height, HEIGHTS, atol=1e-12)
    assert made.spacing == pytest.approx(0.05)
    assert not made.effective


def test_columns_are_known_by_usual_names_or_named(road):
    columns = {'Weg [km]': PLACES / 1000.0, 'other [V]': PLACES, 'Profil': 1000.0 * HEIGHTS}
    np.testing.assert_allclose(road(columns, column='Profil:mm').height, HEIGHTS, atol=1e-12)
    with pytest.raises(SignalError, match=r'no column for height \(its columns: Weg \[km\], other'):
        road(columns)
    spaced = road({'effective_height [m]': HEIGHTS}, distance='0.05')
    assert (spaced.effective, spaced.spacing) == (True, pytest.approx(0.05))


@pytest.mark.parametrize(
    ('columns', 'how', 'reason'),
    [
        ({'distance [m]': PLACES, 'height': 1000.0 * HEIGHTS}, {}, r'no unit is said; values from'),
        ({'distance [m]': PLACES, 'height [V]': HEIGHTS}, {}, 'of voltage, but height is of length'),
        ({'distance [m]': PLACES, 'height [m]': 1e3 * HEIGHTS}, {}, 'than any road .* mm instead of m'),
        ({'distance [m]': PLACES, 'height [mm]': HEIGHTS}, {}, 'than any road .* m instead of mm'),
        ({'distance [m]': PLACES, 'height [m/s^2]': ACCELERATION}, {}, 'of acceleration, but height is'),
        ({'distance [m]': PLACES, 'acc_z': ACCELERATION}, {'column': 'acc_z'}, 'no unit is said'),
        ({'x [m]': PLACES, 'z [m]': 0.2 * ACCELERATION}, {}, r'not that of heights .* road invert'),
        ({'t [s]': PLACES, 'height [m]': HEIGHTS}, {}, 'has no column for distance'),
        ({'t [s]': PLACES, 'z [m]': HEIGHTS}, {'distance': 't'}, 'of time, but distance is of length'),
        ({'x [m]': PLACES - 3.0 * LATE, 'z [m]': HEIGHTS}, {}, 'the distance does not rise'),
        ({'x [m]': PLACES[::-1], 'z [m]': HEIGHTS}, {}, 'the distance does not rise'),
        ({'x [m]': PLACES - 0.05 * LATE, 'z [m]': HEIGHTS}, {}, 'the distance does not rise'),
        ({'x [m]': PLACES + 3.0 * LATE, 'z [m]': HEIGHTS}, {}, r'no heights from 24.95 to 28 m \(3.05 m;'),
        ({'x [m]': np.where(PLACES[7] == PLACES, np.nan, PLACES), 'z [m]': HEIGHTS}, {}, 'row 8 is nan'),
        ({'x [m]': PLACES / 1e3, 'z [m]': HEIGHTS}, {}, 'is the unit of the distance another one'),
    ],
)  # fmt: skip
def test_what_is_no_road_is_refused_with_its_guess(road, columns, how, reason):
    with pytest.raises(SignalError, match=reason):
        road(columns, **how)


def test_uneven_places_are_brought_onto_an_even_grid(road):
    uneven = np.sort(PLACES + 0.01 * np.random.default_rng(3).uniform(-1.0, 1.0, PLACES.size))
    made = road({'x [m]': uneven, 'z [m]': 0.01 * np.sin(uneven)})
    np.testing.assert_allclose(made.height, 0.01 * np.sin(made.distance), atol=1e-6)
    assert any('uneven places' in note for note in made.notes)
