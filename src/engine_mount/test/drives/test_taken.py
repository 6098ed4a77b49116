"""Rows of stamps looked up in one another."""

import numpy as np
import pytest

from engine_mount.drives.inputs.consumed_samples import looked_up, places_in

STAMPS = np.arange(100, 200, 5)


@pytest.mark.parametrize(
    'wanted',
    [
        STAMPS,
        STAMPS[3:9],
        np.arange(50, 180, 5),
        np.arange(150, 400, 5),
        np.arange(50, 400, 5),
        np.delete(STAMPS, [4, 5]),
        np.array([101, 105, 111]),
        np.array([10, 20]),
        np.array([300, 305]),
        STAMPS[:0],
    ],
    ids=['same', 'inside', 'before', 'behind', 'around', 'holes', 'between', 'below', 'above', 'none'],
)
def test_places_are_those_of_a_search(wanted):
    found, places = places_in(STAMPS, wanted)
    np.testing.assert_array_equal(found, np.isin(wanted, STAMPS))
    np.testing.assert_array_equal(places, np.clip(np.searchsorted(STAMPS, wanted), 0, len(STAMPS) - 1))
    known, values = looked_up(wanted, STAMPS, STAMPS / 10)
    np.testing.assert_array_equal(known, found)
    np.testing.assert_array_equal(values, np.where(found, wanted / 10, np.nan))


def test_nothing_is_found_among_no_stamps():
    found, places = places_in(STAMPS[:0], STAMPS)
    assert not found.any()
    assert not places.any()
